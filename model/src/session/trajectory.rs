//! Conversion of a motion to the states of the axes at each reading.

use nalgebra::{DMatrix, DVector};

use super::Test;
use super::motion::{FollowOffset, Motion, Moved, Traversals, length_of};
use super::readings::Readings;
use crate::axis::AxisKind;
use crate::chain::{BodyErrors, Machine};
use crate::frames::Point;
use crate::instrument::ballbar::BallBar;
use crate::instrument::{Station, Target};

/// Pause between two traversals, s.
const BETWEEN_RUNS_S: f64 = 3.0;
/// Planned positions are rounded to this fraction of a millimetre. It is far finer than the resolution of a control and
/// far coarser than the rounding of the solver, so that an axis that need not move does not.
const STEPS_PER_MM: f64 = 1e10;
/// Largest accepted deviation of the balls from the requested path, mm.
const POSITION_TOLERANCE_MM: f64 = 1e-6;

/// A message and what to do.
type Fault = (String, String);

/// Positions, runs and times of a motion.
pub(super) fn states(machine: &Machine, test: &Test, Motion { moved, course }: &Motion) -> Result<Readings, Fault> {
    let along = course.positions();
    let traversed = |way: &[f64], speed: f64, state: &mut dyn FnMut(f64) -> Result<Vec<f64>, Fault>| {
        traversals(machine, way, speed, course.traversals, state)
    };
    match moved {
        Moved::Axis(axis) => traversed(&along, course.speed, &mut |q| {
            let mut at = test.at.clone();
            at[*axis] = q;
            Ok(at)
        }),
        Moved::Circle { axes, radius, centre } => {
            let circle = Circle::new(machine, &bar_of(&test.station), &test.at, *axes, *centre)?;
            traversed(&along, course.speed / radius, &mut |angle| Ok(circle.state(*radius, angle)))
        }
        Moved::Line { axes, ends, in_turn } => {
            let (way, mut states) = on_line(&test.at, axes, ends, &along, *in_turn);
            traversed(&way, course.speed, &mut |_| Ok(states.next().unwrap_or_default()))
        }
        Moved::Follow { axis, offset } => {
            let Some(mut bar) = test.station.between_points() else {
                return Err((
                    format!("test \"{}\" has no point of the table to follow", test.name),
                    "a path of kind \"follow\" needs a ball bar, an R-test or a probe".into(),
                ));
            };
            if *offset == FollowOffset::None {
                bar.workpiece_ball = workpiece_point_at_tool(machine, &bar, &test.at);
            }
            let linear = linear_axes(machine);
            traversed(&along, course.speed, &mut |q| {
                let mut at = test.at.clone();
                at[*axis] = q;
                let requested = offset_vector(machine, &bar, &at, *axis, *offset)?;
                let (mut state, missed) = solve_linear_axes(machine, &bar, &at, &linear, requested);
                for axis in &linear {
                    state[*axis] = (state[*axis] * STEPS_PER_MM).round() / STEPS_PER_MM + 0.0;
                }
                if missed > POSITION_TOLERANCE_MM {
                    return Err((
                        format!(
                            "test \"{}\": the linear axes cannot keep the balls on the path; the deviation is {missed:.3} mm",
                            test.name
                        ),
                        "a path of kind \"follow\" needs linear axes that span the space".into(),
                    ));
                }
                Ok(state)
            })
        }
    }
}

/// The states of linear axes at these distances along a line, in turn with those between them, and the length of the way
/// to each, mm.
fn on_line(
    at: &[f64],
    axes: &[usize],
    ends: &[[f64; 2]],
    along: &[f64],
    in_turn: bool,
) -> (Vec<f64>, impl Iterator<Item = Vec<f64>>) {
    let length = length_of(ends);
    let (mut way, mut states) = (Vec::new(), Vec::<Vec<f64>>::new());
    let mut gone = 0.0;
    for &distance in along {
        let mut state = states.last().cloned().unwrap_or_else(|| at.to_vec());
        for (place, (&axis, [start, end])) in axes.iter().zip(ends).enumerate() {
            let position = start + (end - start) * (distance / length);
            gone += if in_turn && !states.is_empty() { (position - state[axis]).abs() } else { 0.0 };
            state[axis] = position;
            // The first state has all axes on the line.
            let is_last = place + 1 == axes.len();
            if is_last || (in_turn && distance != along[0]) {
                way.push(if in_turn { gone } else { distance });
                states.push(state.clone());
            }
        }
    }
    (way, states.into_iter())
}

/// The instrument's points of table and tool, as the ends of a bar; both at the origin of their frames for an instrument
/// without them.
fn bar_of(station: &Station<f64>) -> BallBar<f64> {
    station.between_points().unwrap_or(BallBar::ORIGINS)
}

/// The point of the workpiece ball's frame at the tool point.
fn workpiece_point_at_tool(machine: &Machine, bar: &BallBar<f64>, at: &[f64]) -> Target<f64> {
    let state = machine.axis_positions(at);
    let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
    let frame = bar.workpiece_ball.frame;
    let tool = Point(bar.spindle_ball.nominal_mm(machine, &state));
    Target { frame, mm: machine.in_frame::<f64>(frame, &state, &none, tool).0 }
}

/// Follows a path as often as it is traversed.
fn traversals(
    machine: &Machine,
    along: &[f64],
    speed: f64,
    traversals: Traversals,
    state: &mut dyn FnMut(f64) -> Result<Vec<f64>, Fault>,
) -> Result<Readings, Fault> {
    let states = along.iter().copied().map(state).collect::<Result<Vec<_>, _>>()?;
    let mut readings = Readings { positions: vec![Vec::new(); machine.axes.len()], ..Readings::default() };
    let last = along.len() - 1;
    let mut start_s = 0.0;
    for (run, back) in traversals.are_backward().enumerate() {
        for k in 0..along.len() {
            let here = if back { last - k } else { k };
            let origin = if back { last } else { 0 };
            for (column, position) in readings.positions.iter_mut().zip(&states[here]) {
                column.push(*position);
            }
            readings.run.push(run as i64 + 1);
            readings.time_s.push(start_s + (along[here] - along[origin]).abs() / speed);
        }
        start_s = readings.time_s.last().copied().unwrap_or(0.0) + BETWEEN_RUNS_S;
    }
    Ok(readings)
}

/// Positions of the axes at these angles of a test's circle; `None` for another motion.
pub fn on_circle(machine: &Machine, test: &Test, angles: &[f64]) -> Option<Result<Vec<Vec<f64>>, Fault>> {
    let Moved::Circle { axes, radius, centre } = test.motion.as_ref()?.moved else { return None };
    let circle = Circle::new(machine, &test.station.between_points()?, &test.at, axes, centre);
    Some(circle.map(|circle| angles.iter().map(|angle| circle.state(radius, *angle)).collect()))
}

/// A circular motion of two linear axes.
struct Circle {
    at: Vec<f64>,
    axes: [usize; 2],
    /// Positions of the two axes at the centre.
    centre: [f64; 2],
    /// Axis travel per millimetre of the path, mm/mm.
    scale: [f64; 2],
}

impl Circle {
    fn new(
        machine: &Machine,
        bar: &BallBar<f64>,
        at: &[f64],
        axes: [usize; 2],
        centre: [f64; 3],
    ) -> Result<Circle, Fault> {
        let moves = axes.map(|axis| relative_move(machine, bar, at, axis));
        let dot: f64 = (0..3).map(|i| moves[0][i] * moves[1][i]).sum();
        if dot.abs() > 1e-9 {
            let names = axes.map(|axis| machine.axes[axis].name.clone());
            return Err((
                format!("axes `{}` and `{}` are not at right angles", names[0], names[1]),
                "a circle needs two linear axes at right angles".into(),
            ));
        }
        let (state, _) = solve_linear_axes(machine, bar, at, &axes, centre);
        Ok(Circle {
            at: state.clone(),
            axes,
            centre: axes.map(|axis| state[axis]),
            scale: moves.map(|way| 1.0 / way.iter().map(|x| x * x).sum::<f64>().sqrt()),
        })
    }

    fn state(&self, radius: f64, angle: f64) -> Vec<f64> {
        let (sin, cos) = angle.sin_cos();
        let mut state = self.at.clone();
        state[self.axes[0]] = self.centre[0] + self.scale[0] * radius * cos;
        state[self.axes[1]] = self.centre[1] + self.scale[1] * radius * sin;
        state
    }
}

/// The circle of a test: its two axes, their positions at the centre, and the amplitude of each, mm.
pub fn circle_of(machine: &Machine, test: &Test) -> Option<([usize; 2], [f64; 2], [f64; 2])> {
    let Moved::Circle { axes, radius, centre } = test.motion.as_ref()?.moved else { return None };
    let circle = Circle::new(machine, &bar_of(&test.station), &test.at, axes, centre).ok()?;
    Some((circle.axes, circle.centre, circle.scale.map(|scale| scale * radius)))
}

/// The linear axes of a machine, by index.
pub(crate) fn linear_axes(machine: &Machine) -> Vec<usize> {
    (0..machine.axes.len()).filter(|&index| machine.axes[index].kind == AxisKind::Linear).collect()
}

/// Moves the `open` axes so that the spindle ball is nominally at `requested` from the workpiece ball, in the
/// least-squares sense. Returns the positions of all axes, and the remaining distance, mm. The difference of the balls
/// is affine in the linear axes, so this is one linear solve.
pub(super) fn solve_linear_axes(
    machine: &Machine,
    bar: &BallBar<f64>,
    at: &[f64],
    open: &[usize],
    requested: [f64; 3],
) -> (Vec<f64>, f64) {
    let apart = spindle_from_workpiece(machine, bar, at);
    let rest = DVector::from_iterator(3, (0..3).map(|i| requested[i] - apart[i]));
    let moves: Vec<[f64; 3]> = open.iter().map(|&axis| relative_move(machine, bar, at, axis)).collect();
    let matrix = DMatrix::from_fn(3, open.len(), |i, j| moves[j][i]);
    let mut state = at.to_vec();
    if open.is_empty() {
        return (state, rest.norm());
    }
    // Directions of unit length: 1e-9 is far below any angle between axes and far above rounding.
    let Ok(step) = matrix.clone().svd(true, true).solve(&rest, 1e-9) else {
        return (state, rest.norm());
    };
    for (axis, change) in open.iter().zip(step.iter()) {
        state[*axis] += change;
    }
    (state, (matrix * step - rest).norm())
}

/// Spindle ball less workpiece ball in R, nominal.
fn spindle_from_workpiece(machine: &Machine, bar: &BallBar<f64>, at: &[f64]) -> [f64; 3] {
    let [workpiece, spindle] = bar.nominal_mm(machine, &machine.axis_positions(at));
    std::array::from_fn(|i| spindle[i] - workpiece[i])
}

/// Movement of the spindle ball relative to the workpiece ball per millimetre of a linear axis.
fn relative_move(machine: &Machine, bar: &BallBar<f64>, at: &[f64], axis: usize) -> [f64; 3] {
    let apart = |position: f64| {
        let mut state = at.to_vec();
        state[axis] = position;
        spindle_from_workpiece(machine, bar, &state)
    };
    let (zero, one) = (apart(0.0), apart(1.0));
    std::array::from_fn(|i| {
        let step = one[i] - zero[i];
        // Differences of positions contain rounding errors; a direction along R's axes is exact.
        if (step - step.round()).abs() < 1e-12 { step.round() } else { step }
    })
}

/// From workpiece ball to spindle ball while the linear axes follow a rotary axis. The vector has the length of the bar
/// and points away from the axis, along the path of the carried ball, or along the axis.
fn offset_vector(
    machine: &Machine,
    bar: &BallBar<f64>,
    at: &[f64],
    axis: usize,
    offset: FollowOffset,
) -> Result<[f64; 3], Fault> {
    let state = machine.axis_positions(at);
    let [workpiece, spindle] = bar.nominal_mm(machine, &state);
    let on_workpiece_side = axis < machine.workpiece_side;
    // A rotating head carries the spindle ball: the workpiece ball is then on the opposite side.
    let (carried, sign) = if on_workpiece_side { (workpiece, 1.0) } else { (spindle, -1.0) };
    let (origin, along) = machine.axis_line(axis, &state);
    let from: [f64; 3] = std::array::from_fn(|i| carried[i] - origin[i]);
    let height: f64 = (0..3).map(|i| from[i] * along[i]).sum();
    let radial: [f64; 3] = std::array::from_fn(|i| from[i] - height * along[i]);
    let radius = radial.iter().map(|x| x * x).sum::<f64>().sqrt();
    let unit = match offset {
        FollowOffset::None | FollowOffset::Touching => [0.0; 3],
        FollowOffset::Axial => along,
        _ if radius < 1e-6 => {
            return Err((
                format!("the ball lies on axis `{}` and does not move on a circle", machine.axes[axis].name),
                "a radial or tangential bar needs a ball away from the axis".into(),
            ));
        }
        FollowOffset::Radial => radial.map(|x| x / radius),
        FollowOffset::Tangential => crate::frames::cross(along, Point(radial.map(|x| x / radius))).0,
    };
    Ok(unit.map(|x| sign * bar.bar * x))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along a diagonal of 3 : 4 the axes move together, or X before Y at each step.
    #[test]
    fn axes_move_on_a_line_together_or_in_turn() {
        let states = |in_turn| {
            let (way, states) =
                on_line(&[0.0, 0.0, 7.0], &[0, 1], &[[-3.0, 3.0], [0.0, 8.0]], &[0.0, 5.0, 10.0], in_turn);
            (way, states.collect::<Vec<_>>())
        };
        let [start, middle, end] = [[-3.0, 0.0, 7.0], [0.0, 4.0, 7.0], [3.0, 8.0, 7.0]].map(|state| state.to_vec());
        assert_eq!(states(false), (vec![0.0, 5.0, 10.0], vec![start.clone(), middle.clone(), end.clone()]));
        let (way, found) = states(true);
        assert_eq!(way, [0.0, 3.0, 7.0, 10.0, 14.0]);
        assert_eq!(found, [start, vec![0.0, 0.0, 7.0], middle, vec![3.0, 4.0, 7.0], end]);
    }
}
