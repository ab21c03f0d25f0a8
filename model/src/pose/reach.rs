//! Axis positions at which the machine without errors brings the tool to a pose.
//!
//! Newton's iteration `q ← q − J⁺ r` with limited steps, from several starts: the last solution first, then points of a
//! low-discrepancy sequence over the travel. Of the solutions within the travel the nearest to the last one counts.

use std::f64::consts::TAU;

use crate::axis::AxisKind;
use crate::chain::{AxisPosition, Machine};
use nalgebra::Matrix3;

use super::jacobian::{Inverse, lever_mm};
use super::{Aim, Pose, TOLERANCE_MM, TOLERANCE_RAD, size};

/// Number of starts besides the last solution.
const STARTS: usize = 64;
/// Maximum number of iterations from a start.
const MAX_STEPS: usize = 80;
/// Longest step of an axis, mm or mm of arc at a radius of 1 m.
const LONGEST_STEP_MM: f64 = 400.0;
/// Half the range of starts of an axis without a stated travel, mm; a rotary axis has a full turn.
const HALF_RANGE_MM: f64 = 500.0;

/// The axis positions at which the tool point is at a pose; `last` are positions to stay close to. `None` if no start
/// leads there within the travel.
pub fn axis_positions(machine: &Machine, tool_mm: [f64; 3], aim: Aim, wanted: &Pose, last: &[f64]) -> Option<Vec<f64>> {
    let axes = aim.axes(machine);
    let solve = |start: Vec<f64>| {
        let found = newton(machine, tool_mm, aim, wanted, &axes, start)?;
        within_travel(machine, found, last)
    };
    if let Some(found) = solve(last.to_vec()).filter(|found| distance(machine, found, last) < LONGEST_STEP_MM) {
        return Some(found);
    }
    let starts = (1..=STARTS).map(|number| start(machine, &axes, number, last));
    let solutions = std::iter::once(last.to_vec()).chain(starts).filter_map(solve);
    solutions.min_by(|a, b| distance(machine, a, last).total_cmp(&distance(machine, b, last)))
}

/// The axis positions at which some axes bring the tool point to a point of the table frame, mm, by the iteration from
/// one start. `None` if it does not lead there within the travel.
pub fn from_start(
    machine: &Machine,
    tool_mm: [f64; 3],
    wanted_mm: [f64; 3],
    axes: &[usize],
    start: &[f64],
) -> Option<Vec<f64>> {
    let wanted = Pose { point_mm: wanted_mm.into(), directions: Matrix3::identity() };
    let found = newton(machine, tool_mm, Aim::Position, &wanted, axes, start.to_vec())?;
    within_travel(machine, found, start)
}

/// Point `number` of the sequence with the golden ratio's generalisation as its step, over the travel of the axes.
/// Other axes stand where they stood.
fn start(machine: &Machine, axes: &[usize], number: usize, last: &[f64]) -> Vec<f64> {
    // The root of x^(d+1) = x + 1: Roberts (2018), "The unreasonable effectiveness of quasirandom sequences".
    let dimensions = axes.len() as f64;
    let root = (0..40).fold(2.0_f64, |root, _| (1.0 + root).powf(1.0 / (dimensions + 1.0)));
    let mut start = last.to_vec();
    for (place, axis) in axes.iter().enumerate() {
        let share = (0.5 + number as f64 * root.powi(-(place as i32 + 1))).fract();
        let [low, high] = range(machine, *axis);
        start[*axis] = low + share * (high - low);
    }
    start
}

/// The range of starts: the travel, at most a turn.
fn range(machine: &Machine, axis: usize) -> [f64; 2] {
    let axis = &machine.axes[axis];
    let half = match axis.kind {
        AxisKind::Linear => HALF_RANGE_MM,
        AxisKind::Rotary => 0.5 * TAU,
    };
    match axis.travel {
        Some([low, high]) if axis.kind == AxisKind::Linear || high - low < TAU => [low, high],
        _ => [-half, half],
    }
}

fn newton(
    machine: &Machine,
    tool_mm: [f64; 3],
    aim: Aim,
    wanted: &Pose,
    axes: &[usize],
    mut positions: Vec<f64>,
) -> Option<Vec<f64>> {
    for _ in 0..MAX_STEPS {
        let state = machine.axis_positions(&positions);
        let deviation = aim.deviation(&Pose::nominal(machine, &state, tool_mm), wanted);
        let [mm, rad] = size(&deviation);
        if mm <= TOLERANCE_MM * 1e-3 && rad <= TOLERANCE_RAD * 1e-3 && faces(aim, &state, machine, tool_mm, wanted) {
            return Some(positions);
        }
        let step = Inverse::at(machine, &state, tool_mm, aim, axes).step(&deviation);
        let longest = step.iter().fold(0.0_f64, |longest, arc| longest.max(arc.abs()));
        let share = if longest > LONGEST_STEP_MM { LONGEST_STEP_MM / longest } else { 1.0 };
        for (axis, arc) in axes.iter().zip(step.iter()) {
            positions[*axis] -= share * arc / lever_mm(machine.axes[*axis].kind);
        }
        if positions.iter().any(|position| !position.is_finite()) {
            return None;
        }
    }
    None
}

/// Whether the tool points the wanted way: the sine of the angle vanishes for the opposite way too.
fn faces(aim: Aim, state: &[AxisPosition<f64>], machine: &Machine, tool_mm: [f64; 3], wanted: &Pose) -> bool {
    let actual = Pose::nominal(machine, state, tool_mm).directions;
    let along = |i: usize| actual.column(i).dot(&wanted.directions.column(i)) > 0.0;
    match aim {
        Aim::Position => true,
        Aim::PositionAndAxis => along(2),
        Aim::Pose => (0..3).all(along),
    }
}

/// The positions with rotary axes shifted by whole turns: within the travel, and there as near to `last` as possible.
fn within_travel(machine: &Machine, mut positions: Vec<f64>, last: &[f64]) -> Option<Vec<f64>> {
    for ((axis, position), last) in machine.axes.iter().zip(&mut positions).zip(last) {
        if axis.kind == AxisKind::Rotary {
            *position += ((last - *position) / TAU).round() * TAU;
        }
        let Some([low, high]) = axis.travel else { continue };
        if axis.kind == AxisKind::Rotary {
            if *position < low {
                *position += ((low - *position) / TAU).ceil() * TAU;
            }
            if *position > high {
                *position -= ((*position - high) / TAU).ceil() * TAU;
            }
        }
        if *position < low || *position > high {
            return None;
        }
    }
    Some(positions)
}

/// The largest change of an axis, mm or mm of arc at a radius of 1 m.
fn distance(machine: &Machine, positions: &[f64], last: &[f64]) -> f64 {
    let axes = machine.axes.iter().zip(positions).zip(last);
    axes.map(|((axis, a), b)| ((a - b) * lever_mm(axis.kind)).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// A tool that points the opposite way has no angle to the wanted axis whose sine does not vanish: the machine turns it
    /// nevertheless.
    #[test]
    fn a_tool_that_points_the_opposite_way_is_turned() {
        let machine = Machine::from_code("w b X Y Z A t").unwrap();
        let tool_mm = [0.0, 0.0, -100.0];
        let [z, a] = ["Z", "A"].map(|name| machine.axis_index(name).unwrap());
        let at = |position: f64, angle: f64| {
            let mut positions = vec![0.0; machine.axes.len()];
            (positions[z], positions[a]) = (position, angle);
            positions
        };
        let pose = |positions: &[f64]| Pose::nominal(&machine, &machine.axis_positions(positions), tool_mm);
        let (wanted, last) = (pose(&at(0.0, PI)), at(200.0, 0.0));
        assert!((pose(&last).point_mm - wanted.point_mm).norm() < 1e-9, "the tool point is there already");
        let found = axis_positions(&machine, tool_mm, Aim::PositionAndAxis, &wanted, &last).unwrap();
        assert!((found[a].abs() - PI).abs() < 1e-6 && found[z].abs() < 1e-5, "{found:?}");
    }

    /// A tool point that only Z reaches up to two angles of the head: the nearer of the two counts.
    #[test]
    fn the_nearest_solution_counts() {
        let machine = Machine::from_code("w b Y Z A t").unwrap();
        let a = machine.axis_index("A").unwrap();
        let tool_mm = [0.0, 0.0, -100.0];
        let wanted = Pose::nominal(&machine, &machine.axis_positions(&[0.0; 3]), tool_mm);
        for (last, wanted_angle) in [(0.4, 0.0), (-0.4, 0.0), (6.0, TAU), (-6.5, -TAU)] {
            let mut from = vec![0.0; 3];
            from[a] = last;
            let found = axis_positions(&machine, tool_mm, Aim::PositionAndAxis, &wanted, &from).unwrap();
            assert!((found[a] - wanted_angle).abs() < 1e-6, "{last}: {found:?}");
        }
    }
}
