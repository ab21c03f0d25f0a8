//! Files of a new machine: `machine.toml` and a plan for any structural code, with a comment on each line.
//!
//! A code states neither lengths nor travels. The files hold usual ones, and each comment says what to enter. Table surface
//! and spindle are bodies, so that the clearance of every test and every program is checked.

mod body;
mod geometry;
mod mounts;
mod plan;
mod rotary;

use std::fmt::Write;

use abbe_model::Diagnostic;
use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::unknown_axis_kind;
use abbe_model::code::StructuralCode;
use abbe_model::code::structural_code;

use self::body::{Body, Side};
use self::geometry::Geometry;
pub use self::geometry::Sizes;

/// The texts of `machine.toml` and of a plan that refers to it: two tests of each rotary axis, a circle of each pair of
/// linear axes. Spindle and holders stay clear of the table in all of them, with these sizes.
///
/// # Errors
/// If the code is invalid, has no axis, or has an axis that is no letter of ISO 841, so that its kind is not known; if a
/// size is out of its range; if no test is possible.
pub fn of_code(code: &str, sizes: Sizes) -> Result<[String; 2], Diagnostic> {
    let parsed = StructuralCode::parse(code)?;
    let mut bodies = Vec::new();
    for (index, name) in parsed.axes().enumerate() {
        let (Some(kind), Some(direction)) = (AxisKind::of_letter(name), Axis::direction_of_letter(name)) else {
            return Err(unknown_axis_kind(name));
        };
        bodies.push(Body {
            name: name.clone(),
            kind,
            along: (0..3).find(|k| direction[*k] != 0.0).unwrap_or(0),
            on_table: index < parsed.workpiece_side.len(),
        });
    }
    if bodies.is_empty() {
        return Err(structural_code(code, "it has no axis"));
    }
    let geometry = Geometry::of(&bodies, sizes)?;
    let plan = plan::text(&bodies, &geometry).ok_or_else(|| Diagnostic::session(format!(
            "a bar cannot be set up for any test of {}: linear axes along X, Y and Z have to follow an axis of the head, \
             because a ball on it would be in the head",
            parsed.spaced()
        ), "write the chain and its axes into a machine file, and plan the tests of an instrument without a bar, such as \
               `kind = \"laser\"`, `\"angle\"` or `\"tracker\"`; or use a code with linear axes along X, Y and Z"))?;
    Ok([machine(&parsed, &bodies, &geometry), plan])
}

fn machine(code: &StructuralCode, bodies: &[Body], geometry: &Geometry) -> String {
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
                format!(
                    "# Smallest and largest position, mm. Enter the travel of the machine.\ntravel_mm = {:?}",
                    geometry.travel(body)
                ),
            ),
            AxisKind::Rotary => (
                "axis of rotation",
                "turns",
                " (right-hand rule)",
                format!(
                    "# A point on the axis of rotation in R, mm. {}\n\
                     origin_mm = [0, 0, {}]\n\
                     # Smallest and largest position, degrees. Enter the travel of the machine.\n\
                     travel_deg = {}",
                    match body.side() {
                        Side::Workpiece => "Choose the origin of R where the rotary axes of the table meet, and enter the offset of others.".to_string(),
                        Side::Tool => format!(
                            "{}: pivot length and gauge length above the spindle ball, which is at the origin of R with all axes at zero.",
                            Geometry::origin(geometry.stated.pivot_mm)
                        ),
                    },
                    if body.on_table { 0.0 } else { geometry.lever },
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
    shapes(&mut text, bodies, geometry);
    text
}

/// The bodies that clearance is checked against.
fn shapes(text: &mut String, bodies: &[Body], geometry: &Geometry) {
    let table = bodies.first().filter(|body| body.on_table);
    let spindle = bodies.last().filter(|body| !body.on_table);
    for (name, about, stated, carrier, corners) in [
        ("table", "Table, up to its surface", geometry.stated.table_mm, table, geometry.table_box()),
        ("spindle", "Spindle, from its nose upwards", geometry.stated.gauge_mm, spindle, geometry.spindle_box()),
    ] {
        let _ = write!(text, "\n# {about}.\n[[body]]\nname = \"{name}\"\n");
        if let Some(carrier) = carrier {
            let _ = writeln!(text, "# The axis that carries it.\naxis = \"{}\"", carrier.name);
        }
        let _ = writeln!(
            text,
            "# {}: least and greatest corner in R with all axes at zero, mm.\nbox_mm = {corners:?}",
            Geometry::origin(stated)
        );
    }
}

/// The unit vector along a direction of R.
fn vector(along: usize) -> String {
    let vector: [f64; 3] = std::array::from_fn(|k| if k == along { 1.0 } else { 0.0 });
    format!("[{}, {}, {}]", vector[0], vector[1], vector[2])
}
