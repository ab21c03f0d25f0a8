//! Errors as changes of the position of an axis.

use abbe_model::chain::Machine;

use super::curves::ErrorCurve;

/// The axis that moves in the freedom of an error, and the change of its position that equals an error of 1 in R (tool
/// against workpiece, rotary axes at zero).
pub(crate) fn as_position(machine: &Machine, curve: &ErrorCurve) -> Option<(usize, f64)> {
    let side = |axis: usize| if axis < machine.workpiece_side { -1.0 } else { 1.0 };
    let freedom = curve.error.freedom;
    let moves = |axis: usize| machine.axes[axis].own_freedom() == freedom && machine.axes[axis].principal().is_some();
    // The axis of the error before another axis with the same freedom.
    let axis = std::iter::once(curve.axis)
        .chain((0..machine.axes.len()).filter(|_| !freedom.is_angle()))
        .find(|axis| moves(*axis))?;
    let (_, sign) = machine.axes[axis].principal()?;
    Some((axis, side(curve.axis) / (side(axis) * sign)))
}

/// A curve whose table contains only the mean of both directions.
pub(crate) fn without_direction(curve: &ErrorCurve) -> String {
    format!("{}: the difference between the directions; the table contains the mean of both", curve.error)
}
