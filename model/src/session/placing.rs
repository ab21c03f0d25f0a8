//! Axis positions that place the balls as requested, for proposals of candidate tests.

use super::trajectory;
use crate::chain::Machine;
use crate::instrument::ballbar::BallBar;

/// Largest accepted position error of the balls, mm.
const POSITION_TOLERANCE_MM: f64 = 1e-6;

/// The two balls in R, nominal: workpiece ball, spindle ball; mm.
pub fn balls(machine: &Machine, bar: &BallBar<f64>, at: &[f64]) -> ([f64; 3], [f64; 3]) {
    let [workpiece, spindle] = bar.nominal_mm(machine, &machine.axis_positions(at));
    (workpiece, spindle)
}

/// The positions of all axes at which the linear axes place the spindle ball at `requested` from the workpiece ball
/// (mm, in R), with the rotary axes `at` their positions. `None` if that is impossible.
pub fn positions_for_bar(machine: &Machine, bar: &BallBar<f64>, at: &[f64], requested: [f64; 3]) -> Option<Vec<f64>> {
    let (state, missed) = trajectory::solve_linear_axes(machine, bar, at, &trajectory::linear_axes(machine), requested);
    (missed <= POSITION_TOLERANCE_MM).then_some(state)
}

/// A point of an axis and its direction in R, carried by the axes between it and the bed.
pub fn axis_line(machine: &Machine, at: &[f64], axis: usize) -> ([f64; 3], [f64; 3]) {
    machine.axis_line(axis, &machine.axis_positions(at))
}
