//! Lookup of axes by name, and of their positions by the unit in the name.

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::unit::Unit;

use crate::spelling::suggestion;

/// The axis of this name; the case of letters is ignored if that is unambiguous.
pub(crate) fn axis_index(machine: &Machine, name: &str) -> Option<usize> {
    if let Some(index) = machine.axis_index(name) {
        return Some(index);
    }
    let lower = name.to_lowercase();
    let mut alike = (0..machine.axes.len()).filter(|&index| machine.axes[index].name.to_lowercase() == lower);
    alike.next().filter(|_| alike.next().is_none())
}

/// As [`axis_index`]; the fault names the most similar axis.
pub(crate) fn axis(machine: &Machine, name: &str) -> Result<usize, (String, String)> {
    axis_index(machine, name).ok_or_else(|| no_axis(machine, name))
}

/// Message and help for an unknown axis, with the most similar name.
pub(crate) fn no_axis(machine: &Machine, name: &str) -> (String, String) {
    let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
    (
        format!("the machine \"{}\" has no axis `{name}`", machine.name),
        format!("{}its axes are {}", suggestion(name, &names), names.join(", ")),
    )
}

/// Interprets the name of an axis position, such as `x_mm`, `a_deg`, `J1_rad`: the axis and the unit.
pub(crate) fn axis_position(machine: &Machine, name: &str) -> Option<(usize, Unit)> {
    let (axis, unit) = name.rsplit_once('_')?;
    let axis = axis_index(machine, axis)?;
    let is_rotary = machine.axes[axis].kind == AxisKind::Rotary;
    let unit = Unit::of_column(unit, is_rotary)?;
    (!is_rotary || matches!(unit, Unit::Degree | Unit::Radian)).then_some((axis, unit))
}
