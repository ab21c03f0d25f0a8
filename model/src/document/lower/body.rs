//! What can collide: the bodies of a machine, the sizes of a ball bar.

use std::path::Path;

use crate::body::{Body, BodyShape, ClearanceSizes, Holder};
use crate::chain::Machine;
use crate::document::fault::{Fault, Within};
use crate::document::value::Vector;
use crate::document::{machine as document, session};
use crate::files::access::{self, ReadOptions};
use crate::files::source_map::BodyFile;
use crate::files::{quantity, stl};
use crate::session::limits;

/// The files of bodies: where they may lie, and which were read.
#[derive(Default)]
pub(crate) struct BodyFiles<'f> {
    /// The session file or the machine file that is read, the file that names the bodies, and the options; `None` for a
    /// document from no file.
    pub from: Option<(&'f Path, &'f Path, &'f ReadOptions)>,
    /// The files that were read.
    pub read: Vec<BodyFile>,
    /// Warnings about usable files.
    pub warnings: Vec<String>,
}

impl BodyFiles<'_> {
    /// Reads the surface of a body.
    fn surface(&mut self, body: &str, named: &str) -> Result<BodyShape, Fault> {
        let Some((reader, beside, options)) = self.from else {
            let help = "write the machine to a file beside the STL file";
            return Err(Fault::new("`stl` names a file, but this text is in none", Some(help.into())));
        };
        let found = access::folder(beside).join(named);
        if !options.store.exists(&found) {
            let message = format!("the STL file `{named}` does not exist; looked for {}", found.display());
            return Err(Fault::file(message, "its name is relative to the file that names it"));
        }
        access::check(reader, options, ("stl", named), &found)?;
        let surface = stl::surface(&options.store, &found)
            .map_err(|(message, help)| Fault::new(format!("{} {message}", found.display()), Some(help)))?;
        if surface.open_edges > 0 {
            self.warnings.push(format!(
                "body `{body}`: the surface of {named} is not closed: {} of its edges belong to one triangle only; \
                 what is wholly inside is not noticed",
                surface.open_edges
            ));
        }
        self.read.push(BodyFile { name: named.to_string(), stamp: surface.stamp, contents: surface.contents });
        Ok(surface.shape)
    }
}

/// The bodies of a machine.
pub(super) fn bodies(
    machine: &Machine,
    documents: &[document::Body],
    files: &mut BodyFiles<'_>,
) -> Result<Vec<Body>, Fault> {
    let mut bodies: Vec<Body> = Vec::new();
    for (item, document) in documents.iter().enumerate() {
        bodies.push(body(machine, document, &bodies, files).within_item(item)?);
    }
    Ok(bodies)
}

fn body(
    machine: &Machine,
    document: &document::Body,
    others: &[Body],
    files: &mut BodyFiles<'_>,
) -> Result<Body, Fault> {
    let name = document.name.clone();
    if others.iter().any(|other| other.name == name) {
        let help = "give each its own name";
        return Err(Fault::new(format!("two bodies are called `{name}`"), Some(help.into())).at("name"));
    }
    let axis = document.axis.as_ref().map(|text| {
        quantity::axis_index(machine, text).ok_or_else(|| {
            let (message, help) = quantity::no_axis(machine, text);
            Fault::new(message, Some(format!("{help}; a body of the bed has no `axis`"))).at("axis")
        })
    });
    let axis = axis.transpose()?;
    let shape = match (&document.box_mm, &document.capsule, &document.stl) {
        (Some(corners), None, None) => cuboid(corners).within("box_mm")?,
        (None, Some(capsule), None) => {
            let radius_mm = limits::positive(capsule.radius_mm).map_err(Fault::is);
            let radius_mm = radius_mm.within("radius_mm").within("capsule")?;
            BodyShape::Capsule { ends_mm: [capsule.from_mm.0, capsule.to_mm.0], radius_mm }
        }
        (None, None, Some(file)) => files.surface(&name, file).within("stl")?,
        _ => {
            let help = "box_mm = [[-160, -160, -60], [160, 160, -10]], or capsule = { from_mm = [0, 0, 60], to_mm = [0, 0, 300], radius_mm = 40 }, or stl = \"table.stl\"; in R with all axes at zero";
            return Err(Fault::new(format!("body `{name}` has no shape, or two"), Some(help.into())));
        }
    };
    Ok(Body { name, axis, shape })
}

fn cuboid(corners: &[Vector]) -> Result<BodyShape, Fault> {
    let fault =
        |message: &str| Fault::new(message, Some("the least corner, then the greatest: [[x, y, z], [x, y, z]]".into()));
    match corners {
        [low, high] if (0..3).all(|i| low.0[i] < high.0[i]) => Ok(BodyShape::Box { low_mm: low.0, high_mm: high.0 }),
        [_, _] => Err(fault("`box_mm`: a coordinate of the second corner is not greater than that of the first")),
        _ => Err(fault("`box_mm` is not a list of two corners")),
    }
}

/// The sizes of a ball bar.
pub(super) fn clearance(document: &session::Clearance) -> Result<ClearanceSizes, Fault> {
    let usual = ClearanceSizes::default();
    let holder = |document: Option<session::Holder>, key: &str| {
        let positive = |number: f64, of: &str| limits::positive(number).map_err(Fault::is).within(of).within(key);
        let holder = document.map(|holder| {
            Ok::<_, Fault>(Holder {
                radius_mm: positive(holder.radius_mm, "radius_mm")?,
                length_mm: positive(holder.length_mm, "length_mm")?,
            })
        });
        holder.transpose()
    };
    let bar_radius_mm = limits::positive(document.bar_radius_mm.unwrap_or(usual.bar_radius_mm)).map_err(Fault::is);
    let least_mm = limits::not_negative(document.least_mm.unwrap_or(usual.least_mm)).map_err(Fault::is);
    Ok(ClearanceSizes {
        bar_radius_mm: bar_radius_mm.within("bar_radius_mm")?,
        workpiece_holder: holder(document.workpiece_holder, "workpiece_holder")?,
        spindle_holder: holder(document.spindle_holder, "spindle_holder")?,
        least_mm: least_mm.within("least_mm")?,
    })
}
