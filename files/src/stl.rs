//! Surfaces in STL files, binary or ASCII, read by the crate `stl_io`.
//!
//! The crate trusts the header of a binary file and stops at the first `endsolid` of an ASCII file. Both are checked
//! here, so that no triangle is lost without a word.

use std::collections::HashMap;
use std::io::{Cursor, Read};
use std::path::Path;
use std::sync::Arc;

use abbe_model::body::BodyShape;
use abbe_model::session::limits;

use super::stamp::FileStamp;
use super::store::Store;

/// Largest size of a file, bytes: 1.3 million triangles of a binary file.
const MAX_BYTES: u64 = 64 << 20;
/// Bytes of a binary file before its triangles: a header and their number.
const BEFORE_TRIANGLES: usize = 84;
/// Bytes of the header.
const HEADER: usize = 80;
/// Bytes of a triangle of a binary file.
const TRIANGLE: usize = 50;

/// A surface, and the state of its file.
pub(crate) struct Surface {
    /// The shape: a mesh.
    pub shape: BodyShape,
    /// The file when it was read.
    pub stamp: FileStamp,
    /// Its content.
    pub contents: Arc<[u8]>,
    /// Number of edges that belong to one triangle only.
    pub open_edges: usize,
}

/// Reads a surface. The error is what was found, without the file, and what to do.
pub(crate) fn surface(store: &Store, file: &Path) -> Result<Surface, (String, String)> {
    let unreadable = |cause: std::io::Error| (format!("cannot be read: {cause}"), "check the name".to_string());
    let mut opened = store.open(file).map_err(unreadable)?;
    let stamp = FileStamp::of(file, opened.state().map_err(unreadable)?);
    let mut bytes = Vec::new();
    opened.by_ref().take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_BYTES {
        let help = "export it with fewer triangles: a body for clearances needs no fillets and threads";
        return Err((format!("has more than {MAX_BYTES} bytes, which is the limit"), help.into()));
    }
    stamp.finish(&opened).map_err(|fault| (fault.to_string(), "wait until it is written and try again".into()))?;
    let contents = Arc::from(bytes.as_slice());
    let triangles = triangles(bytes)?;
    let open_edges = open_edges(&triangles);
    let is_closed = open_edges == 0;
    // A surface that is turned inside out encloses a negative volume.
    let inside_out = is_closed && triangles.iter().map(volume).sum::<f64>() < 0.0;
    let outward = |[a, b, c]: [[f64; 3]; 3]| if inside_out { [a, c, b] } else { [a, b, c] };
    let triangles_mm = triangles.into_iter().map(outward).collect();
    Ok(Surface { shape: BodyShape::Mesh { triangles_mm, is_closed }, stamp, contents, open_edges })
}

/// The triangles of a file.
fn triangles(mut bytes: Vec<u8>) -> Result<Vec<[[f64; 3]; 3]>, (String, String)> {
    const AGAIN: &str = "export it again as STL, binary or ASCII";
    let fault = |message: String| (message, AGAIN.to_string());
    let count = bytes.get(HEADER..BEFORE_TRIANGLES).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
    let stated = count.map(|count| BEFORE_TRIANGLES as u64 + TRIANGLE as u64 * u64::from(count));
    let is_binary = stated == Some(bytes.len() as u64);
    let is_text = !is_binary && bytes.starts_with(b"solid");
    if !is_binary && !is_text {
        let (Some(count), Some(stated)) = (count, stated) else {
            return Err(fault(format!(
                "is no STL file: it has {} bytes, and does not begin with `solid`",
                bytes.len()
            )));
        };
        let found = bytes.len() - BEFORE_TRIANGLES;
        return Err(fault(if (bytes.len() as u64) < stated {
            format!("states {count} triangles, but ends in triangle {}", found / TRIANGLE + 1)
        } else {
            format!(
                "states {count} triangles, but has {found} bytes for them in place of {}",
                TRIANGLE * count as usize
            )
        }));
    }
    let facets = if is_text { facets(&bytes) } else { 0 };
    if is_binary {
        // Some programs begin binary files with `solid` too.
        bytes[..HEADER].fill(0);
    } else if !bytes.starts_with(b"solid ") {
        // A surface without a name.
        bytes.insert("solid".len(), b' ');
    }
    let mut bytes = Cursor::new(bytes);
    let reader = stl_io::create_stl_reader(&mut bytes).map_err(|cause| fault(format!("is no STL file: {cause}")))?;
    let mut triangles = Vec::new();
    for (number, triangle) in reader.enumerate() {
        let number = number + 1;
        let triangle = triangle.map_err(|cause| fault(format!("triangle {number}: {cause}")))?;
        // The sum makes one zero of both.
        let corners = triangle.vertices.map(|corner| corner.0.map(|x| f64::from(x) + 0.0));
        if let Some(x) = corners.iter().flatten().find(|x| !x.is_finite()) {
            return Err(fault(format!("triangle {number} has the coordinate {x}")));
        }
        if let Some(found) = corners.iter().flatten().find_map(|x| limits::too_large_for("coordinate_mm", *x)) {
            return Err((format!("triangle {number} has a coordinate that is {found}"), "the unit is mm".into()));
        }
        triangles.push(corners);
    }
    if is_text && triangles.len() < facets {
        let message = format!("has {facets} triangles in several solids, of which the first has {}", triangles.len());
        return Err((message, "write each solid to a file, with a [[body]] of its own".into()));
    }
    if triangles.is_empty() {
        return Err(fault("has no triangles".into()));
    }
    Ok(triangles)
}

/// The number of lines of an ASCII file that begin a triangle.
fn facets(bytes: &[u8]) -> usize {
    bytes.split(|byte| *byte == b'\n').filter(|line| line.trim_ascii_start().starts_with(b"facet")).count()
}

/// The number of edges that no other triangle passes in the opposite direction.
fn open_edges(triangles: &[[[f64; 3]; 3]]) -> usize {
    let bits = |corner: [f64; 3]| corner.map(f64::to_bits);
    let mut edges: HashMap<_, i64> = HashMap::new();
    for [a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (from, to) = (bits(*from), bits(*to));
            if from < to {
                *edges.entry((from, to)).or_default() += 1;
            } else if to < from {
                *edges.entry((to, from)).or_default() -= 1;
            }
        }
    }
    edges.values().map(|count| count.unsigned_abs() as usize).sum()
}

/// Six times the volume of a triangle's tetrahedron with the origin.
fn volume([a, b, c]: &[[f64; 3]; 3]) -> f64 {
    let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
    (0..3).map(|i| a[i] * cross[i]).sum()
}
