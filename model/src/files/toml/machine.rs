//! Reader of `machine.toml`, or of the same tables in a session.

use std::path::Path;

use super::body::{self, BodyFiles};
use super::{ReadOptions, quantity};
use crate::axis::{Axis, AxisKind};
use crate::chain::Machine;
use crate::code::StructuralCode;
use crate::error::ModelError;
use crate::files::spelling::known_names;
use crate::files::store::Store;
use crate::files::toml::document::{Source, Table};
use crate::frames::Rotation;

/// Reads a machine file.
///
/// # Errors
/// If the file cannot be read or does not describe a machine, with its line and what to do.
pub fn machine(path: &Path) -> Result<Machine, ModelError> {
    machine_of(&source(&Store::Disk, path)?)
}

/// As [`machine`], from a machine file that has been read.
///
/// # Errors
/// As [`machine`].
pub fn machine_of(source: &Source) -> Result<Machine, ModelError> {
    let options = ReadOptions::default();
    let path = source.file.as_path();
    let mut files = BodyFiles { from: Some((path, path, &options)), ..BodyFiles::default() };
    from_table(source.parse()?, &mut files)
}

/// The text of a machine file.
pub(super) fn source(store: &Store, path: &Path) -> Result<Source, ModelError> {
    Source::read(store, path, "the machine file")
}

/// A machine from the tables `name`, `chain`, `[axis.…]`, `[[body]]`.
pub(super) fn from_table(mut table: Table<'_>, files: &mut BodyFiles<'_>) -> Result<Machine, ModelError> {
    let chain = table.require("chain", "the axes from workpiece over bed to tool, such as \"w C A b Y X Z t\"")?;
    let text = chain.text()?;
    let code = StructuralCode::parse(&text).map_err(|fault| chain.error(fault.to_string(), None))?;
    let name = match table.take("name") {
        Some(name) => name.text()?,
        None => text.clone(),
    };
    let rotation = match table.take("rotation") {
        None => Rotation::Exact,
        Some(value) => match value.text()?.as_str() {
            "exact" => Rotation::Exact,
            "small-angle" => Rotation::SmallAngle,
            _ => return Err(value.unexpected("\"exact\" or \"small-angle\"")),
        },
    };
    let gravity = match table.take("gravity") {
        None => [0.0, 0.0, -1.0],
        Some(value) => {
            let (source, span) = (value.source, value.span.clone());
            unit(value.vector()?)
                .ok_or_else(|| source.error(span, "`gravity` has no direction", Some("down is [0, 0, -1]".into())))?
        }
    };

    let mut tables = Vec::new();
    if let Some(value) = table.take("axis") {
        for entry in value.table("[axis]".into())?.remaining_values()? {
            let name = entry.key.clone();
            if !code.axes().any(|axis| *axis == name) {
                let known: Vec<&str> = code.axes().map(String::as_str).collect();
                let message = format!("axis `{name}` is not in the chain `{text}`");
                let help = format!("add it to `chain` or remove its table; {}", known_names(&name, &known));
                return Err(entry.source.error(entry.key_span.clone(), message, Some(help)));
            }
            let called = format!("[axis.{name}]");
            tables.push((name, entry.table(called)?));
        }
    }
    let mut axes = Vec::new();
    for name in code.axes() {
        let Some(index) = tables.iter().position(|(called, _)| called == name) else {
            let message = format!("axis `{name}` of the chain `{text}` has no table");
            let help = format!("add [axis.{name}] with its `direction` and `origin_mm`");
            return Err(chain.error(message, Some(help)));
        };
        let (_, table) = tables.remove(index);
        axes.push(axis(name, table)?);
    }
    let mut machine =
        Machine { name, workpiece_side: code.workpiece_side.len(), axes, rotation, gravity, bodies: Vec::new() };
    machine.bodies = body::bodies(&machine, &mut table, files)?;
    table.finish()?;
    Ok(machine)
}

fn axis(name: &str, mut table: Table<'_>) -> Result<Axis, ModelError> {
    let of_letter = AxisKind::of_letter(name);
    let stated = match table.take("kind") {
        None => None,
        Some(value) => {
            let kind = match value.text()?.as_str() {
                "rotary" => AxisKind::Rotary,
                "linear" => AxisKind::Linear,
                _ => return Err(value.unexpected("\"rotary\" or \"linear\"")),
            };
            if of_letter.is_some_and(|letter| letter != kind) {
                let message = format!(
                    "axis `{name}` is {} by ISO 841, not {}",
                    quantity::kind_word(of_letter.unwrap_or(kind)),
                    quantity::kind_word(kind)
                );
                let help = "A B C are rotary and X Y Z U V W linear; give another axis another name, such as `J1`";
                return Err(value.error(message, Some(help.into())));
            }
            Some(kind)
        }
    };
    let Some(kind) = stated.or(of_letter) else {
        let message = format!("axis `{name}` is not an ISO 841 letter and has no `kind`");
        return Err(table.error(message, Some("add `kind = \"rotary\"` or `kind = \"linear\"`".into())));
    };
    let direction = match table.take("direction") {
        Some(value) => {
            let (source, span) = (value.source, value.span.clone());
            unit(value.vector()?).ok_or_else(|| {
                let message = format!("`direction` of axis `{name}` is zero");
                let help = "a direction of any length above 0, such as [0, 0, 1]";
                source.error(span, message, Some(help.into()))
            })?
        }
        None => Axis::direction_of_letter(name).ok_or_else(|| {
            table.error(
                format!("axis `{name}` is not an ISO 841 letter and has no `direction`"),
                Some("add `direction`: the direction in R along or about which it moves, such as [0, 0, 1]".into()),
            )
        })?,
    };
    let origin_mm = match table.take("origin_mm") {
        Some(value) => value.vector()?,
        None => [0.0; 3],
    };
    let travel = travel(name, kind, &mut table)?;
    table.finish()?;
    Ok(Axis { name: name.to_string(), kind, direction, origin_mm, travel })
}

fn travel(name: &str, kind: AxisKind, table: &mut Table<'_>) -> Result<Option<[f64; 2]>, ModelError> {
    let (mm, deg) = (table.take("travel_mm"), table.take("travel_deg"));
    let (right, wrong) = match kind {
        AxisKind::Linear => (mm, deg),
        AxisKind::Rotary => (deg, mm),
    };
    if let Some(wrong) = wrong {
        let message = format!("`{}` for the {} axis `{name}`", wrong.key, quantity::kind_word(kind));
        let right = if kind == AxisKind::Rotary { "travel_deg" } else { "travel_mm" };
        let help = format!("use `{right}`");
        return Err(wrong.source.error(wrong.key_span.clone(), message, Some(help)));
    }
    let Some(value) = right else { return Ok(None) };
    let (source, span) = (value.source, value.span.clone());
    let key = value.key.clone();
    let ends = value.list("a list of two numbers, minimum and maximum")?;
    let numbers = ends.iter().map(|end| end.number()).collect::<Result<Vec<_>, _>>()?;
    match numbers[..] {
        [least, greatest] if least < greatest => Ok(Some([least, greatest].map(|end| kind.to_internal(end)))),
        _ => Err(source.error(
            span,
            format!("`{key}` of axis `{name}` is not a list of two numbers, minimum and maximum"),
            None,
        )),
    }
}

/// The vector scaled to length 1; `None` for a zero vector.
fn unit(vector: [f64; 3]) -> Option<[f64; 3]> {
    let largest = vector.iter().fold(0.0_f64, |largest, v| largest.max(v.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return None;
    }
    let scaled = vector.map(|v| v / largest);
    let norm = scaled.iter().map(|v| v * v).sum::<f64>().sqrt();
    Some(scaled.map(|v| v / norm))
}
