//! Reader of `[[body]]` of a machine and `[clearance]` of a session: what can collide.

use std::path::Path;

use super::{ReadOptions, data_folder, quantity};
use crate::body::{Body, BodyShape, ClearanceSizes, Holder};
use crate::chain::Machine;
use crate::error::ModelError;
use crate::files::source_map::BodyFile;
use crate::files::stl;
use crate::files::toml::document::{Table, Value};

/// The files of bodies: where they may lie, and which were read.
#[derive(Default)]
pub(super) struct BodyFiles<'f> {
    /// The session file or the machine file that is read, the file that names the bodies, and the options; `None` for a
    /// text from no file.
    pub from: Option<(&'f Path, &'f Path, &'f ReadOptions)>,
    /// The files that were read.
    pub read: Vec<BodyFile>,
    /// Warnings about usable files.
    pub warnings: Vec<String>,
}

impl BodyFiles<'_> {
    /// Reads the surface of a body.
    fn surface(&mut self, body: &str, value: &Value<'_>) -> Result<BodyShape, ModelError> {
        let named = value.text()?;
        let Some((reader, beside, options)) = self.from else {
            let help = "write the machine to a file beside the STL file";
            return Err(value.error("`stl` names a file, but this text is in none", Some(help.into())));
        };
        let found = data_folder::folder(beside).join(&named);
        if !options.store.exists(&found) {
            let message = format!("the STL file `{named}` does not exist; looked for {}", found.display());
            return Err(value.file_error(message, "its name is relative to the file that names it"));
        }
        data_folder::check(reader, options, value, &found)?;
        let surface = stl::surface(&options.store, &found)
            .map_err(|(message, help)| value.error(format!("{} {message}", found.display()), Some(help)))?;
        if surface.open_edges > 0 {
            self.warnings.push(format!(
                "body `{body}`: the surface of {named} is not closed: {} of its edges belong to one triangle only; \
                 what is wholly inside is not noticed",
                surface.open_edges
            ));
        }
        self.read.push(BodyFile { name: named, stamp: surface.stamp, contents: surface.contents });
        Ok(surface.shape)
    }
}

/// Reads the bodies of a machine.
pub(super) fn bodies(
    machine: &Machine,
    table: &mut Table<'_>,
    files: &mut BodyFiles<'_>,
) -> Result<Vec<Body>, ModelError> {
    let Some(value) = table.take("body") else {
        return Ok(Vec::new());
    };
    let mut bodies: Vec<Body> = Vec::new();
    for item in value.list("tables [[body]]")? {
        let mut table = item.table("[[body]]".into())?;
        let called = table.require("name", "a name that no other body has")?;
        let name = called.text()?;
        if bodies.iter().any(|other| other.name == name) {
            return Err(called.error(format!("two bodies are called `{name}`"), Some("give each its own name".into())));
        }
        let axis = match table.take("axis") {
            None => None,
            Some(value) => {
                let text = value.text()?;
                let Some(axis) = quantity::axis_index(machine, &text) else {
                    let (message, help) = quantity::no_axis(machine, &text);
                    return Err(value.error(message, Some(format!("{help}; a body of the bed has no `axis`"))));
                };
                Some(axis)
            }
        };
        let shape = match (table.take("box_mm"), table.take("capsule"), table.take("stl")) {
            (Some(corners), None, None) => cuboid(corners)?,
            (None, Some(capsule), None) => shape_of_capsule(capsule)?,
            (None, None, Some(file)) => files.surface(&name, &file)?,
            _ => {
                let help = "box_mm = [[-160, -160, -60], [160, 160, -10]], or capsule = { from_mm = [0, 0, 60], to_mm = [0, 0, 300], radius_mm = 40 }, or stl = \"table.stl\"; in R with all axes at zero";
                return Err(table.error(format!("body `{name}` has no shape, or two"), Some(help.into())));
            }
        };
        table.finish()?;
        bodies.push(Body { name, axis, shape });
    }
    Ok(bodies)
}

fn cuboid(value: Value<'_>) -> Result<BodyShape, ModelError> {
    let (source, span) = (value.source, value.span.clone());
    let fault = |message: &str| {
        source.error(span.clone(), message, Some("the least corner, then the greatest: [[x, y, z], [x, y, z]]".into()))
    };
    let corners = value.list("a list of two corners")?;
    let corners = corners.into_iter().map(Value::vector).collect::<Result<Vec<_>, _>>()?;
    match corners[..] {
        [low_mm, high_mm] if (0..3).all(|i| low_mm[i] < high_mm[i]) => Ok(BodyShape::Box { low_mm, high_mm }),
        [_, _] => Err(fault("`box_mm`: a coordinate of the second corner is not greater than that of the first")),
        _ => Err(fault("`box_mm` is not a list of two corners")),
    }
}

fn shape_of_capsule(value: Value<'_>) -> Result<BodyShape, ModelError> {
    let mut table = value.table("`capsule`".into())?;
    let mut end = |key: &'static str| table.require(key, "an end of the line, [x, y, z]")?.vector();
    let ends_mm = [end("from_mm")?, end("to_mm")?];
    let radius_mm = table.require("radius_mm", "the radius")?.positive()?;
    table.finish()?;
    Ok(BodyShape::Capsule { ends_mm, radius_mm })
}

/// Reads `[clearance]` of a session.
pub(super) fn clearance(root: &mut Table<'_>) -> Result<Option<ClearanceSizes>, ModelError> {
    let Some(value) = root.take("clearance") else {
        return Ok(None);
    };
    let mut table = value.table("[clearance]".into())?;
    let usual = ClearanceSizes::default();
    let bar_radius_mm = table.take("bar_radius_mm").map_or(Ok(usual.bar_radius_mm), |value| value.positive())?;
    let workpiece_holder = table.take("workpiece_holder").map(holder).transpose()?;
    let spindle_holder = table.take("spindle_holder").map(holder).transpose()?;
    let least_mm = match table.take("least_mm") {
        None => usual.least_mm,
        Some(value) => {
            let least = value.number()?;
            if least < 0.0 {
                return Err(value.error(format!("`least_mm` is {least}; it cannot be negative"), None));
            }
            least
        }
    };
    table.finish()?;
    Ok(Some(ClearanceSizes { bar_radius_mm, workpiece_holder, spindle_holder, least_mm }))
}

fn holder(value: Value<'_>) -> Result<Holder, ModelError> {
    let name = format!("`{}`", value.key);
    let mut table = value.table(name)?;
    let radius_mm = table.require("radius_mm", "the radius of the stem")?.positive()?;
    let length_mm = table.require("length_mm", "its length from the centre of the ball")?.positive()?;
    table.finish()?;
    Ok(Holder { radius_mm, length_mm })
}
