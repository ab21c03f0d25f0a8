//! Files of a new machine: `machine.toml` and a plan for any structural code, with a comment on each line.
//!
//! A code states neither lengths nor travels. The files hold usual ones, and each comment says what to enter.

mod body;
mod mounts;
mod plan;

use std::fmt::Write;

use crate::axis::{Axis, AxisKind};
use crate::code::StructuralCode;
use crate::error::ModelError;

use self::body::Body;

/// The texts of `machine.toml` and of a plan that refers to it: two tests of each rotary axis, a circle of each pair of
/// linear axes.
///
/// # Errors
/// If the code is invalid, has no axis, or has an axis that is no letter of ISO 841, so that its kind is not known.
pub fn of_code(code: &str) -> Result<[String; 2], ModelError> {
    let parsed = StructuralCode::parse(code)?;
    let mut bodies = Vec::new();
    for (index, name) in parsed.axes().enumerate() {
        let (Some(kind), Some(direction)) = (AxisKind::of_letter(name), Axis::direction_of_letter(name)) else {
            return Err(ModelError::UnknownAxisKind { axis: name.clone() });
        };
        bodies.push(Body {
            name: name.clone(),
            kind,
            along: (0..3).find(|k| direction[*k] != 0.0).unwrap_or(0),
            on_table: index < parsed.workpiece_side.len(),
        });
    }
    if bodies.is_empty() {
        return Err(ModelError::StructuralCode { code: code.to_string(), found: "it has no axis".into() });
    }
    Ok([machine(&parsed, &bodies), plan::text(&bodies)])
}

fn machine(code: &StructuralCode, bodies: &[Body]) -> String {
    let mut text = format!(
        "# Name of the machine in results.\n\
         name = \"Machine {spaced}\"\n\
         # The axes from the workpiece (w) over the bed (b) to the tool (t). Axes before b carry the workpiece.\n\
         chain = \"{spaced}\"\n\
         # Rotation by the angles of an error: \"exact\" is Rx·Ry·Rz, \"small-angle\" is I + [θ]×, the form of the literature.\n\
         rotation = \"exact\"\n\
         # Direction of gravity in the frame R of the bed. Only effects with the driver gravity use it.\n\
         gravity = [0, 0, -1]\n",
        spaced = code.spaced()
    );
    for body in bodies {
        let name = &body.name;
        let direction = vector(body.along);
        let carries = if body.on_table { "workpiece" } else { "tool" };
        let (physical, moves, turning, rest) = match body.kind {
            AxisKind::Linear => (
                "direction of motion",
                "moves",
                "",
                "# Smallest and largest position, mm. Enter the travel of the machine.\ntravel_mm = [-300, 300]"
                    .to_string(),
            ),
            AxisKind::Rotary => (
                "axis of rotation",
                "turns",
                " (right-hand rule)",
                format!(
                    "# A point on the axis of rotation in R, mm. Choose the origin of R where the rotary axes meet, and enter the \
                     offset of others.\n\
                     origin_mm = [0, 0, 0]\n\
                     # Smallest and largest position, degrees. Enter the travel of the machine.\n\
                     travel_deg = {}",
                    if body.along == 2 { "[-360, 360]" } else { "[-120, 120]" }
                ),
            ),
        };
        let _ = write!(
            text,
            "\n[axis.{name}]\n\
             # Physical {physical} of the body that carries the {carries} for an increasing command of {name}{turning}.\n"
        );
        if body.on_table {
            let _ = writeln!(
                text,
                "# By ISO 841 a table {moves} against the direction of its letter. Reverse the sign for such a table."
            );
        }
        let _ = writeln!(text, "direction = {direction}\n{rest}");
    }
    text
}

/// The unit vector along a direction of R.
fn vector(along: usize) -> String {
    let vector: [f64; 3] = std::array::from_fn(|k| if k == along { 1.0 } else { 0.0 });
    format!("[{}, {}, {}]", vector[0], vector[1], vector[2])
}
