//! Plain descriptions of parameters for work at the machine:
//! `C table: inclination of the axis about Y (squareness to X)`, `A100: bar length`.

use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::effect::{Component, Effect};

use crate::parameters::Role;
use crate::problem::Problem;
use abbe_model::effect::description::{component_meaning, meaning};

/// The description of a location error or an error motion; empty if the name is not an error of ISO 230-1.
pub(crate) fn error_meaning(machine: &Machine, id: &str) -> String {
    let Some(name) = ErrorName::parse(id) else {
        return String::new();
    };
    let reference = match squareness_reference(machine, &name) {
        Some(axis) => format!(" (squareness to {axis})"),
        None => String::new(),
    };
    format!("{}{reference}", component_meaning(machine, &Component::Axis(name)))
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

/// The description of a set-up parameter: `A100: bar length`, `P1: workpiece ball, shift in X`. Empty if the identifier
/// is not a set-up parameter.
pub(crate) fn setup_meaning(machine: &Machine, id: &str) -> String {
    let (quantity, group) = match id.strip_suffix(']').and_then(|id| id.split_once('[')) {
        Some((quantity, group)) => (quantity, Some(group)),
        None => (id, None),
    };
    let (thing, coordinate) = quantity.split_once('.').unwrap_or((quantity, ""));
    let component = Component::Instrument { thing: thing.to_string(), coordinate: coordinate.to_string() };
    let described = component_meaning(machine, &component);
    let quantity = match thing {
        "bar" => format!("{} {}", described.part, described.what),
        _ => format!("{}, {}", described.part, described.what),
    };
    match group {
        Some(group) => format!("{group}: {quantity}"),
        None => quantity,
    }
}

/// The description of a coefficient: the effect, then the coefficient if the effect has several.
pub(crate) fn coefficient_meaning(machine: &Machine, effect: &Effect, coefficient: &str) -> String {
    let effect = meaning(machine, effect);
    match coefficient {
        "" => effect.to_string(),
        "amplitude" | "phase" | "rms" | "cos" | "sin" => format!("{effect}, {coefficient}"),
        number => format!("{effect}, coefficient {number}"),
    }
}

/// The description of parameter `index` of a problem. `coefficient` replaces the name of a coefficient: `amplitude`,
/// `phase`.
pub fn parameter_meaning(problem: &Problem, index: usize, coefficient: Option<&str>) -> String {
    let (machine, parameter) = (&problem.session.machine, &problem.parameters.list[index]);
    match parameter.role {
        Role::Number { effect, number } => {
            let effect = &problem.parameters.effects[effect];
            let name = effect.shape.reported().get(number).map_or("", |(name, _)| *name);
            format!("{}, {name}", meaning(machine, effect))
        }
        Role::Error => error_meaning(machine, &parameter.id),
        Role::Setup => setup_meaning(machine, &parameter.id),
        Role::Coefficient { effect, coefficient: k } => {
            let effect = &problem.parameters.effects[effect];
            let names = effect.shape.coefficient_names();
            let name = coefficient.or(names.get(k).map(String::as_str)).unwrap_or_default();
            coefficient_meaning(machine, effect, name)
        }
    }
}
