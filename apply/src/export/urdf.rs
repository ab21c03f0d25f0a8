//! The calibrated chain as URDF (ROS, "XML Robot Description Format", wiki.ros.org/urdf/XML; lengths in m, angles in
//! rad).
//!
//! The bed is the link `base`. Each joint carries its calibrated pose in the link before it, so that a program that
//! reads URDF gives the tool positions of the model. The tool frame at the tool point is the link `tool`; machines with
//! axes on the workpiece side have a second branch with the link `table`.

use std::fmt::Write;

use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::frames::roll_pitch_yaw;
use abbe_model::unit::Unit;
use nalgebra::Isometry3;

use super::entries::best_locations;
use super::frames::{Branch, tool_side, workpiece_side};
use super::left_out;
use abbe_identify::model_file::IdentifiedModel;

/// Mass and inertia of a link. URDF has no place for a link without them in simulators of dynamics.
const MASS_KG: f64 = 1.0;

/// The URDF of a model with its tool point in the tool frame, mm.
///
/// # Errors
/// If the machine's error angles are small-angle matrices.
pub fn urdf(model: &IdentifiedModel, tool_mm: [f64; 3]) -> Result<String, Diagnostic> {
    let machine = &model.machine;
    let (errors, remaining) = best_locations(model, tool_mm)?;
    let mut text = String::from("<?xml version=\"1.0\"?>\n");
    let mut line = |indent: usize, what: std::fmt::Arguments<'_>| {
        let _ = writeln!(text, "{:indent$}{what}", "");
    };
    line(0, format_args!("<!-- Calibrated by Abbe {}: {} location errors.", env!("CARGO_PKG_VERSION"), machine.code()));
    line(0, format_args!("     Lengths in m, angles in rad. The link `base` is the reference frame R. -->"));
    let missing = left_out(model);
    if !missing.is_empty() {
        let list = missing.join(", ").replace("--", "- -");
        line(0, format_args!("<!-- Not part of a fixed geometry, and left out: {list} -->"));
    }
    if let Some(remaining) = remaining {
        line(0, format_args!("<!-- {} -->", remaining.words()));
    }
    line(0, format_args!("<robot name=\"{}\">", escaped(&machine.name)));
    link(&mut line, "base");
    branch(&mut line, machine, &tool_side(machine, &errors, tool_mm)?, "tool");
    if machine.workpiece_side > 0 {
        branch(&mut line, machine, &workpiece_side(machine, &errors, [0.0; 3])?, "table");
    }
    line(0, format_args!("</robot>"));
    Ok(text)
}

/// Writes a line with an indent.
type Line<'l> = &'l mut dyn FnMut(usize, std::fmt::Arguments<'_>);

fn link(line: Line<'_>, name: &str) {
    line(2, format_args!("<link name=\"{name}\">"));
    line(4, format_args!("<inertial>"));
    line(6, format_args!("<mass value=\"{MASS_KG}\"/>"));
    line(6, format_args!("<inertia ixx=\"0.01\" ixy=\"0\" ixz=\"0\" iyy=\"0.01\" iyz=\"0\" izz=\"0.01\"/>"));
    line(4, format_args!("</inertial>"));
    line(2, format_args!("</link>"));
}

fn branch(line: Line<'_>, machine: &Machine, branch: &Branch, end: &str) {
    let mut parent = "base".to_string();
    for joint in &branch.joints {
        let axis = &machine.axes[joint.axis];
        let name = escaped(&axis.name);
        let kind = match (axis.kind, axis.travel) {
            (AxisKind::Linear, _) => "prismatic",
            (AxisKind::Rotary, Some(_)) => "revolute",
            (AxisKind::Rotary, None) => "continuous",
        };
        line(2, format_args!("<joint name=\"{name}\" type=\"{kind}\">"));
        line(4, format_args!("<parent link=\"{parent}\"/>"));
        line(4, format_args!("<child link=\"link_{name}\"/>"));
        origin(line, &joint.pose);
        let [x, y, z]: [f64; 3] = joint.direction.normalize().into();
        line(4, format_args!("<axis xyz=\"{x:?} {y:?} {z:?}\"/>"));
        if kind != "continuous" {
            let scale = if axis.kind == AxisKind::Linear { Unit::Metre.per_internal() } else { 1.0 };
            let [low, high] = axis.travel.unwrap_or([-10_000.0, 10_000.0]).map(|end| end * scale);
            line(4, format_args!("<limit lower=\"{low:?}\" upper=\"{high:?}\" effort=\"0\" velocity=\"0\"/>"));
        }
        line(2, format_args!("</joint>"));
        parent = format!("link_{name}");
        link(line, &parent);
    }
    line(2, format_args!("<joint name=\"{end}_frame\" type=\"fixed\">"));
    line(4, format_args!("<parent link=\"{parent}\"/>"));
    line(4, format_args!("<child link=\"{end}\"/>"));
    origin(line, &branch.end);
    line(2, format_args!("</joint>"));
    link(line, end);
}

fn origin(line: Line<'_>, pose: &Isometry3<f64>) {
    let [x, y, z]: [f64; 3] = (pose.translation.vector * Unit::Metre.per_internal()).into();
    let [roll, pitch, yaw] = roll_pitch_yaw(&pose.rotation);
    line(4, format_args!("<origin xyz=\"{x:?} {y:?} {z:?}\" rpy=\"{roll:?} {pitch:?} {yaw:?}\"/>"));
}

/// A name without characters that XML reserves.
fn escaped(name: &str) -> String {
    let replaced = |c: char| if c.is_alphanumeric() || " ._-".contains(c) { c } else { '_' };
    name.chars().map(replaced).collect()
}
