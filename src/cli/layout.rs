//! `abbe new --from-code`: a machine and a plan for any structural code, each line explained.

use std::fmt::Write;

use abbe::model::axis::{Axis, AxisKind};
use abbe::model::code::StructuralCode;

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
        ("plan.toml".into(), plan(&bodies)),
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

/// A direction across another one, for the ball that goes round: Y, or X where that is along.
fn across(along: usize) -> usize {
    if along == 1 { 0 } else { 1 }
}

fn plan(bodies: &[Body]) -> String {
    let rotary: Vec<&Body> = bodies
        .iter()
        .filter(|body| body.kind == AxisKind::Rotary)
        .collect();
    let linear: Vec<&Body> = bodies
        .iter()
        .filter(|body| body.kind == AxisKind::Linear)
        .collect();
    let mut text = String::from(
        "# A plan: what could `abbe plan plan.toml` see with these tests? Change it, ask again, measure when it says what you want.\n\
         # `abbe simulate plan.toml --out run1 --error …` draws readings from it; a measured test gets a line `data = \"….csv\"`.\n\n\
         [machine]\n\
         # The chain and its axes, beside this file.\n\
         file = \"machine.toml\"\n\n\
         [constants]\n\
         # From an axis to the ball that goes round it, mm; lengths below may be written over these names.\n\
         R = 100.0\n\
         # Calibrated length of the bar, mm.\n\
         R_c = 100.0\n\
         # The same with its 50 mm extension.\n\
         R_e = 150.0\n\n\
         [instrument]\n\
         # \"ballbar\"; others are \"probe\", \"tracker\", \"socket\".\n\
         kind = \"ballbar\"\n\
         # Standard deviation of one reading, µm.\n\
         noise_um = 0.3\n\
         # Least step of a reading, µm.\n\
         resolution_um = 0.1\n\n",
    );
    text.push_str("[unknowns]\n# The errors to identify, by ISO 230-1: EX0C is where C lies along X, EA0C how it leans about X.\nerrors = [\n");
    for body in &rotary {
        let letters: Vec<usize> = (0..3).filter(|k| *k != body.along).collect();
        let names: Vec<String> = ["X", "Y", "Z"]
            .iter()
            .enumerate()
            .chain(["A", "B", "C"].iter().enumerate())
            .filter(|(k, _)| letters.contains(k))
            .map(|(_, letter)| format!("\"E{letter}0{}\"", body.name))
            .collect();
        let _ = writeln!(
            text,
            "  {},  # where {} lies, and how it leans",
            names.join(", "),
            body.name
        );
    }
    let planes = planes(&linear);
    for [first, second] in &planes {
        let about = ["A", "B", "C"][3 - first.along - second.along];
        let _ = writeln!(
            text,
            "  \"E{about}0{}\",  # squareness of {} and {}",
            second.name, first.name, second.name
        );
    }
    text.push_str("]\n");
    for body in &rotary {
        sweep(&mut text, body, false);
        sweep(&mut text, body, true);
    }
    for [first, second] in planes {
        let _ = write!(
            text,
            "\n# {a} and {b} move the spindle ball on a circle about the workpiece ball.\n\
             [[test]]\n\
             name = \"{a}{b}\"\n\
             # Calibrated length.\n\
             bar_mm = \"R_c\"\n\
             # The workpiece ball in the frame of the table, the spindle ball in that of the tool: both at R with all axes at zero.\n\
             workpiece_ball_mm = [0, 0, 0]\n\
             spindle_ball_mm = [0, 0, 0]\n\
             {SETUP}\
             # Two linear axes, a full turn from the first towards the second and back; `runs` repeats both.\n\
             path = {{ kind = \"circle\", plane = \"{a}{b}\", radius_mm = \"R_c\", step_deg = 2, feed_mm_min = 1000, runs = 1, both_directions = true }}\n",
            a = first.name,
            b = second.name,
        );
    }
    text
}

/// What is known of where the balls really are.
const SETUP: &str = "# How well it is known where the balls really are and how long the bar really is: standard uncertainty, µm. 0 is exactly, inf not at all.\n\
workpiece_ball_u_um = [2, 2, 2]\n\
spindle_ball_u_um = [1, 1, 1]\n\
bar_u_um = 0.5\n";

/// Pairs of linear axes at right angles, without those that lie parallel to one already paired.
fn planes<'b>(linear: &[&'b Body]) -> Vec<[&'b Body; 2]> {
    let mut first_along: Vec<&Body> = Vec::new();
    for body in linear {
        if first_along.iter().all(|other| other.along != body.along) {
            first_along.push(body);
        }
    }
    first_along.sort_by_key(|body| body.along);
    let mut pairs = Vec::new();
    for (index, first) in first_along.iter().enumerate() {
        for second in &first_along[index + 1..] {
            pairs.push([*first, *second]);
        }
    }
    pairs
}

fn sweep(text: &mut String, body: &Body, extended: bool) {
    let name = &body.name;
    let (bar, length) = if extended { ("R_e", 150) } else { ("R_c", 100) };
    let mut round = ["0".to_string(), "0".to_string(), "0".to_string()];
    round[across(body.along)] = "\"R\"".into();
    let mut stands = ["0".to_string(), "0".to_string(), "0".to_string()];
    if extended {
        stands[body.along] = "\"sqrt(R_e^2 - R^2)\"".into();
    }
    let list = |point: &[String; 3]| format!("[{}]", point.join(", "));
    let (workpiece, spindle, carried) = if body.on_table {
        (list(&round), list(&stands), "workpiece")
    } else {
        (list(&stands), list(&round), "spindle")
    };
    let sees = if extended {
        "lifted along the axis by the extension, so that the bar sees how the axis leans"
    } else {
        "on the axis, so that the bar sees where the axis lies"
    };
    let (from, to, step) = if body.along == 2 {
        (0, 360, 2)
    } else {
        (-90, 90, 1)
    };
    let _ = write!(
        text,
        "\n# {name} turns the {carried} ball about the other one, which stands {sees}.\n\
         [[test]]\n\
         name = \"{name}{length}\"\n\
         # Calibrated length.\n\
         bar_mm = \"{bar}\"\n\
         # The workpiece ball in the frame of the table, the spindle ball in that of the tool, all axes at zero.\n\
         workpiece_ball_mm = {workpiece}\n\
         spindle_ball_mm = {spindle}\n\
         # Tests that name the same setup share the mounted ball.\n\
         setup = \"{name}\"\n\
         {SETUP}\
         # The axis goes there and back; set the ends to what it can do. `runs` repeats both.\n\
         sweep = {{ axis = \"{name}\", from_deg = {from}, to_deg = {to}, step_deg = {step}, feed_deg_min = 500, runs = 1, both_directions = true }}\n"
    );
}
