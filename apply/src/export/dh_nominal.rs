//! Denavit–Hartenberg frames of a nominal machine whose maker's table is not given.

use nalgebra::{Isometry3, Vector3};

use super::dh_frames::{Frames, PARALLEL, foot, pose};
use super::frames::Branch;

/// The frames of a branch: the first at the axis' own point, each further one where the one before meets its axis, unless the
/// common normal decides. Rows before the first and behind the last axis are empty.
pub(super) fn frames(branch: &Branch) -> Frames {
    let (lines, end) = branch.at_zero();
    let mut own: Vec<Isometry3<f64>> = Vec::with_capacity(lines.len());
    for (k, &(point, z)) in lines.iter().enumerate() {
        // Where the frame lies along its axis if nothing else decides.
        let met = match own.last() {
            Some(before) => meets(before.translation.vector, lines[k - 1].1, point, z),
            None => point,
        };
        let (origin, x) = match lines.get(k + 1) {
            None => (met, Vector3::zeros()),
            Some((next, next_z)) => {
                let across = z.cross(next_z);
                match across.norm() >= PARALLEL {
                    true => (foot(point, z, *next, *next_z), across),
                    false => (met, meets(met, z, *next, *next_z) - met),
                }
            }
        };
        own.push(pose(origin, x, z));
    }
    let tool = own.last().map_or(end, |last| last.inverse() * end);
    let base = own.first().copied().unwrap_or_else(Isometry3::identity);
    Frames { base, first: [0.0; 2], last: [0.0; 2], own, tool }
}

/// The point of a line in the plane through `origin` across `z`.
fn meets(origin: Vector3<f64>, z: Vector3<f64>, point: Vector3<f64>, direction: Vector3<f64>) -> Vector3<f64> {
    let along = direction.dot(&z);
    if along.abs() < PARALLEL {
        return point;
    }
    point + direction * ((origin - point).dot(&z) / along)
}
