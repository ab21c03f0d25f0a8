//! What can collide: the bodies of a machine.

use std::path::Path;

use abbe_model::body::{Body, BodyShape};
use abbe_model::chain::Machine;
use abbe_model::document::fault::{Fault, Within};
use abbe_model::document::machine as document;
use abbe_model::document::value::Vector;

use crate::access::{self, ReadOptions};
use crate::source_map::BodyFile;
use crate::{axes, stl};

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
            return Err(Fault::new("`stl` names a file, but this text is in none", help));
        };
        let found = access::folder(beside).join(named);
        if !options.store.exists(&found) {
            let message = format!("the STL file `{named}` does not exist; looked for {}", found.display());
            return Err(Fault::file(message, "its name is relative to the file that names it"));
        }
        access::check(reader, options, ("stl", named), &found)?;
        let surface = stl::surface(&options.store, &found)
            .map_err(|(message, help)| Fault::new(format!("{} {message}", found.display()), help))?;
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
        return Err(Fault::new(format!("two bodies are called `{name}`"), help).at("name"));
    }
    let axis = document.axis.as_ref().map(|text| {
        axes::axis(machine, text).map_err(|(message, help)| {
            Fault::new(message, format!("{help}; a body of the bed has no `axis`")).at("axis")
        })
    });
    let axis = axis.transpose()?;
    let shape = match (&document.box_mm, &document.capsule, &document.stl) {
        (Some(corners), None, None) => cuboid(corners).within("box_mm")?,
        (None, Some(capsule), None) => {
            BodyShape::Capsule { ends_mm: [capsule.from_mm.0, capsule.to_mm.0], radius_mm: capsule.radius_mm.0 }
        }
        (None, None, Some(file)) => files.surface(&name, file).within("stl")?,
        _ => {
            let help = "box_mm = [[-160, -160, -60], [160, 160, -10]], or capsule = { from_mm = [0, 0, 60], to_mm = [0, 0, 300], radius_mm = 40 }, or stl = \"table.stl\"; in R with all axes at zero";
            return Err(Fault::new(format!("body `{name}` has no shape, or two"), help));
        }
    };
    Ok(Body { name, axis, shape })
}

fn cuboid(corners: &[Vector]) -> Result<BodyShape, Fault> {
    let fault = |message: &str| Fault::new(message, "the least corner, then the greatest: [[x, y, z], [x, y, z]]");
    match corners {
        [low, high] if (0..3).all(|i| low.0[i] < high.0[i]) => Ok(BodyShape::Box { low_mm: low.0, high_mm: high.0 }),
        [_, _] => Err(fault("`box_mm`: a coordinate of the second corner is not greater than that of the first")),
        _ => Err(fault("`box_mm` is not a list of two corners")),
    }
}
