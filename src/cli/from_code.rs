//! `abbe new --from-code`: a machine and a plan for any structural code, with a comment on each line.

mod mounts;
mod plan;

use std::fmt::Write;

use abbe::model::axis::{Axis, AxisKind};
use abbe::model::code::StructuralCode;

use self::mounts::Side;
use super::failure::Failure;
use super::folder::NewFile;

/// An axis of the code.
struct Body {
    name: String,
    kind: AxisKind,
    /// 0, 1, 2 for X, Y, Z of R.
    along: usize,
    on_table: bool,
}

impl Body {
    fn side(&self) -> Side {
        if self.on_table { Side::Workpiece } else { Side::Tool }
    }
}

/// `machine.toml` and `plan.toml` of a structural code.
pub fn files(code: &str) -> Result<Vec<NewFile>, Failure> {
    let parsed = StructuralCode::parse(code).map_err(|fault| Failure::Other(fault.to_string()))?;
    let mut bodies = Vec::new();
    for (index, name) in parsed.axes().enumerate() {
        let (Some(kind), Some(direction)) = (AxisKind::of_letter(name), Axis::direction_of_letter(name)) else {
            return Err(Failure::Other(format!(
                "axis `{name}` of `{code}` is no letter of ISO 841 (X Y Z U V W are linear, A B C rotary), so its kind is not known; \
                 `abbe new DIR --template ur10` shows a machine whose axes state their kind and direction"
            )));
        };
        bodies.push(Body {
            name: name.clone(),
            kind,
            along: (0..3).find(|k| direction[*k] != 0.0).unwrap_or(0),
            on_table: index < parsed.workpiece_side.len(),
        });
    }
    if bodies.is_empty() {
        return Err(Failure::Other(format!("`{code}` has no axis; a code such as [wCXbYZAt] is expected")));
    }
    Ok(vec![("machine.toml".into(), machine(&parsed, &bodies)), ("plan.toml".into(), plan::text(&bodies))])
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
        let vector = vector(body.along, 1.0);
        let _ = writeln!(text, "\n[axis.{name}]");
        let carries = if body.on_table { "workpiece" } else { "tool" };
        match body.kind {
            AxisKind::Linear => {
                let _ = writeln!(
                    text,
                    "# Physical direction of motion of the body that carries the {carries} for an increasing command of {name}."
                );
                if body.on_table {
                    let _ = writeln!(
                        text,
                        "# By ISO 841 a table moves against the direction of its letter. Reverse the sign for such a table."
                    );
                }
                let _ = writeln!(text, "direction = {vector}");
                let _ = writeln!(
                    text,
                    "# Smallest and largest position, mm. Enter the travel of the machine.\ntravel_mm = [-300, 300]"
                );
            }
            AxisKind::Rotary => {
                let _ = writeln!(
                    text,
                    "# Physical axis of rotation of the body that carries the {carries} for an increasing command of {name} (right-hand rule)."
                );
                if body.on_table {
                    let _ = writeln!(
                        text,
                        "# By ISO 841 a table turns against the direction of its letter. Reverse the sign for such a table."
                    );
                }
                let _ = writeln!(text, "direction = {vector}");
                let _ = writeln!(
                    text,
                    "# A point on the axis of rotation in R, mm. Choose the origin of R where the rotary axes meet, and enter the offset of others."
                );
                let _ = writeln!(text, "origin_mm = [0, 0, 0]");
                let _ = writeln!(
                    text,
                    "# Smallest and largest position, degrees. Enter the travel of the machine.\ntravel_deg = {}",
                    if body.along == 2 { "[-360, 360]" } else { "[-120, 120]" }
                );
            }
        }
    }
    text
}

fn vector(along: usize, value: f64) -> String {
    let mut vector = [0.0; 3];
    vector[along] = value;
    format!("[{}, {}, {}]", vector[0], vector[1], vector[2])
}
