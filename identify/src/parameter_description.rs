//! Plain descriptions of parameters for work at the machine:
//! `C table: inclination of the axis about Y (squareness to X)`, `A100: bar length`.

use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::effect::Component;

use crate::problem::Problem;
use abbe_model::effect::description::{component_meaning, meaning};
use abbe_model::parameter_id::{ParameterId, Part};

/// The description of a location error or an error motion.
pub(crate) fn error_meaning(machine: &Machine, name: &ErrorName) -> String {
    let reference = match squareness_reference(machine, name) {
        Some(axis) => format!(" (squareness to {axis})"),
        None => String::new(),
    };
    format!("{}{reference}", component_meaning(machine, &Component::Axis(name.clone())))
}

/// The linear axis relative to which an orientation error of a rotary axis is a squareness error. A tilt about one
/// direction across the axis turns the axis towards the other direction across it.
fn squareness_reference(machine: &Machine, name: &ErrorName) -> Option<String> {
    let axis = &machine.axes[machine.axis_index(&name.axis)?];
    let own = axis.own_freedom().index() % 3;
    let about = name.freedom.index() % 3;
    let tilts =
        name.kind == ErrorKind::Location && axis.kind == AxisKind::Rotary && name.freedom.is_angle() && about != own;
    if !tilts {
        return None;
    }
    // The three directions are 0, 1 and 2; `own` and `about` are two of them.
    let towards = 3 - own - about;
    let is_reference = |other: &&Axis| other.kind == AxisKind::Linear && other.own_freedom().index() % 3 == towards;
    machine.axes.iter().find(is_reference).map(|other| other.name.clone())
}

/// The description of a set-up parameter: `A100: bar length`, `P1: workpiece ball, shift in X`.
fn setup_meaning(machine: &Machine, [thing, coordinate, group]: [&String; 3]) -> String {
    let component = Component::Instrument { thing: thing.clone(), coordinate: coordinate.clone() };
    let described = component_meaning(machine, &component);
    let comma = if thing == "bar" { "" } else { "," };
    let colon = if group.is_empty() { "" } else { ": " };
    format!("{group}{colon}{}{comma} {}", described.part, described.what)
}

/// The description of parameter `index` of a problem. `part` replaces that of its effect: amplitude, phase.
pub fn parameter_meaning(problem: &Problem, index: usize, part: Option<&Part>) -> String {
    let (machine, parameter) = (&problem.session.machine, &problem.parameters.list[index]);
    let of_effect = |effect: usize| &problem.parameters.effects[effect];
    match &parameter.id {
        ParameterId::Error(name) => error_meaning(machine, name),
        ParameterId::Setup { thing, coordinate, group } => setup_meaning(machine, [thing, coordinate, group]),
        ParameterId::Effect(_, own) => parameter.effect.map(of_effect).map_or_else(String::new, |effect| {
            let words = meaning(machine, effect);
            match part.unwrap_or(own) {
                Part::Number(_) => {
                    let name = effect.shape.reported().get(parameter.index).map_or("", |(name, _)| *name);
                    format!("{words}, {name}")
                }
                Part::Coefficient(name) if name.is_empty() => words.to_string(),
                part if part.is_numbered() => format!("{words}, coefficient {part}"),
                part => format!("{words}, {part}"),
            }
        }),
    }
}
