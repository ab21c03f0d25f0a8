//! `abbe new --from-code`: a machine and a plan for any structural code, each line explained.

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
        if self.on_table {
            Side::Workpiece
        } else {
            Side::Tool
        }
    }
}

/// `machine.toml` and `plan.toml` of a structural code.
pub fn files(code: &str) -> Result<Vec<NewFile>, Failure> {
    let parsed = StructuralCode::parse(code).map_err(|fault| Failure::Other(fault.to_string()))?;
    let mut bodies = Vec::new();
    for (index, name) in parsed.axes().enumerate() {
        let (Some(kind), Some(direction)) = (AxisKind::of_letter(name), Axis::direction_of_letter(name))
        else {
            return Err(Failure::Other(format!(
                "axis `{name}` of `{code}` is no letter of ISO 841 (X Y Z U V W slide, A B C turn): what it does is not known; \
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
        return Err(Failure::Other(format!(
            "`{code}` has no axis; nothing can be tested"
        )));
    }
    Ok(vec![
        ("machine.toml".into(), machine(&parsed, &bodies)),
        ("plan.toml".into(), plan::text(&bodies)),
    ])
}

fn machine(code: &StructuralCode, bodies: &[Body]) -> String {
    let mut text = format!(
        "# What results call the machine.\n\
         name = \"Machine {spaced}\"\n\
         # The axes from the workpiece (w) over the bed (b) to the tool (t). What stands before b carries the workpiece.\n\
         chain = \"{spaced}\"\n\
         # How the angles of an error turn: exact is Rx·Ry·Rz; \"small-angle\" is I + [θ]×, as the literature prints it.\n\
         rotation = \"exact\"\n\
         # Down, in the frame R of the bed. Matters only to effects that gravity drives.\n\
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
                    "# Where the body that carries the {carries} physically goes when {name} is commanded to increase."
                );
                if body.on_table {
                    let _ = writeln!(
                        text,
                        "# A table by ISO 841 slides against its letter: if yours does, turn the sign."
                    );
                }
                let _ = writeln!(text, "direction = {vector}");
                let _ = writeln!(
                    text,
                    "# Least and greatest position, mm: set it to the machine's.\ntravel_mm = [-300, 300]"
                );
            }
            AxisKind::Rotary => {
                let _ = writeln!(
                    text,
                    "# About which direction of R the body that carries the {carries} physically turns when {name} increases (right hand)."
                );
                if body.on_table {
                    let _ = writeln!(
                        text,
                        "# A table by ISO 841 turns against its letter: if yours does, turn the sign."
                    );
                }
                let _ = writeln!(text, "direction = {vector}");
                let _ = writeln!(
                    text,
                    "# A point of its line in R, mm. Best: R where the rotary axes meet; else how far this one misses that point."
                );
                let _ = writeln!(text, "origin_mm = [0, 0, 0]");
                let _ = writeln!(
                    text,
                    "# Least and greatest position, degrees: set it to the machine's.\ntravel_deg = {}",
                    if body.along == 2 {
                        "[-360, 360]"
                    } else {
                        "[-120, 120]"
                    }
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
