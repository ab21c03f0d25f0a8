//! Conversion of quantities by the unit in their name, and lookup of axes by name.

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::quantity::{ARCSECOND, MICROMETRE};

use crate::spelling::suggestion;

/// An inch in mm (exact since 1959).
const INCH: f64 = 25.4;

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

/// Interprets the name of an axis position, such as `x_mm`, `a_deg`, `J1_rad`: the axis and the conversion.
pub(crate) fn axis_position(machine: &Machine, name: &str) -> Option<(usize, Unit)> {
    let (axis, unit) = name.rsplit_once('_')?;
    let axis = axis_index(machine, axis)?;
    let unit = match (machine.axes[axis].kind, unit) {
        (AxisKind::Linear, unit) => Unit::of_length(unit)?,
        (AxisKind::Rotary, "rad") => Unit::Times(1.0),
        (AxisKind::Rotary, "deg") => Unit::Degrees,
        _ => return None,
    };
    Some((axis, unit))
}

/// Conversion of a number in a file to the internal unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Unit {
    /// Multiplication by a factor.
    Times(f64),
    /// Degrees to radians.
    Degrees,
}

impl Unit {
    /// The number in the internal unit.
    pub fn to_internal(self, value: f64) -> f64 {
        match self {
            Unit::Times(factor) => value * factor,
            Unit::Degrees => value.to_radians(),
        }
    }

    /// The number of the file from the internal unit.
    pub fn in_unit(self, value: f64) -> f64 {
        match self {
            Unit::Times(factor) => value / factor,
            Unit::Degrees => value.to_degrees(),
        }
    }

    /// A unit of a column: of angle if `is_angle`, else of length.
    pub fn of_column(unit: &str, is_angle: bool) -> Option<Unit> {
        if is_angle { Unit::of_angle(unit) } else { Unit::of_length(unit) }
    }

    /// A unit of angle: `deg`, `arcmin`, `arcsec`, `rad`, `mrad`, `urad`.
    fn of_angle(unit: &str) -> Option<Unit> {
        match unit {
            "deg" => Some(Unit::Degrees),
            "arcmin" => Some(Unit::Times(60.0 * ARCSECOND)),
            "arcsec" => Some(Unit::Times(ARCSECOND)),
            "rad" => Some(Unit::Times(1.0)),
            "mrad" => Some(Unit::Times(1e-3)),
            "urad" => Some(Unit::Times(1e-6)),
            _ => None,
        }
    }

    /// A unit of length: `mm`, `um`, `m`, `in`, `mil` (a thousandth of an inch).
    pub fn of_length(unit: &str) -> Option<Unit> {
        match unit {
            "mm" => Some(Unit::Times(1.0)),
            "um" => Some(Unit::Times(MICROMETRE)),
            "m" => Some(Unit::Times(1e3)),
            "in" => Some(Unit::Times(INCH)),
            "mil" => Some(Unit::Times(INCH * 1e-3)),
            _ => None,
        }
    }
}
