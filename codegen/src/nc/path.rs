//! The path of a test in legs: overshoot, measured path, overshoot.

use std::f64::consts::{PI, TAU};

use abbe_model::Diagnostic;
use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::{BodyErrors, Frame, Machine};
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::session::Test;
use abbe_model::session::motion::{Course, Motion, Moved, Traversals, length_of};
use abbe_model::session::placing::balls;
use abbe_model::session::planned::{planned, reaches};

use super::block::Block;
use super::{Control, NcOptions, Plane};
use crate::error;

/// Overshoot of a full circle, degrees: half a turn before and after (ISO 230-4 leaves it to the user).
const FULL_CIRCLE_DEG: f64 = 180.0;
/// Overshoot of a part of a circle or of a turn, degrees.
const PART_DEG: f64 = 2.0;
/// Overshoot of a linear axis, or along a line, mm.
const USUAL_MM: f64 = 2.0;
/// Steps of an overshoot in which the clearance of its states is compared.
const OVERSHOOT_STEPS: usize = 90;
/// Largest number of segments of a leg.
const MOST_SEGMENTS: usize = 100_000;

/// The path of a test: legs that follow each other.
pub(super) struct Path {
    pub legs: Vec<Leg>,
    /// Close states of each overshoot.
    pub overshoots: Vec<Vec<Vec<f64>>>,
    pub traversals: Traversals,
    /// How long the axes rest at each target, s; `None` of an instrument that reads along the motion.
    pub rest_s: Option<f64>,
    /// The feed of the measured path and its unit.
    pub feed: (f64, &'static str),
    /// What the operator must know of it.
    pub remarks: Vec<String>,
    /// Where it is less than is usual.
    pub warnings: Vec<String>,
}

/// A part of the path, through states of all axes in mm and rad.
pub(super) struct Leg {
    pub vertices: Vec<Vec<f64>>,
    pub measured: bool,
    /// How long the axes rest at each vertex, s; `None` if they go through.
    pub rest_s: Option<f64>,
    shape: Shape,
}

#[derive(Clone)]
enum Shape {
    /// One axis moves, at a feed in mm/min or °/min.
    Line(f64),
    /// Two linear axes move on a circle about a centre, at a feed in mm/min.
    Arc { plane: Plane, axes: [usize; 2], centre: [f64; 2], counterclockwise: bool, feed: f64 },
    /// A polyline; the duration of a segment, s, and the tool point over the table, mm, if it is to be written.
    Segments { seconds: f64, tool_points: Option<Vec<[f64; 3]>> },
}

impl Path {
    /// # Errors
    /// If the test has no motion, or an axis would leave its travel.
    pub fn of(machine: &Machine, test: &Test, control: &dyn Control, options: &NcOptions) -> Result<Path, Diagnostic> {
        let motion = test.motion.as_ref().ok_or_else(|| {
            error::nc(
                format!("test \"{}\" states no motion", test.name),
                "add `sweep = { … }` or `path = { kind = \"circle\" | \"line\" | \"follow\", … }`",
            )
        })?;
        reaches(machine, test).map_err(of_plan)?;
        let (speed, is_rotary) = motion.feed(machine);
        let feed = (speed, if is_rotary { "°/min" } else { "mm/min" });
        let Course { from, to, traversals, .. } = motion.course;
        let (mut remarks, mut warnings) = (Vec::new(), Vec::new());
        let ends = overshot(machine, test, motion, options, &mut warnings)?;
        let (mut legs, mut overshoots) = (Vec::new(), Vec::new());
        for (range, measured) in [([ends[0], from], false), ([from, to], true), ([to, ends[1]], false)] {
            if range[0] != range[1] {
                legs.push(Leg::of(machine, (test, motion), range, measured, control, options)?);
                if !measured {
                    overshoots.push(states(machine, test, range, OVERSHOOT_STEPS)?);
                }
            }
        }
        let rest_s = test.station.handling().reads_at_rest.then_some(options.dwell_s);
        if legs.iter().any(|leg| matches!(leg.shape, Shape::Segments { .. })) {
            remarks.push(format!("Segments with a chord error of at most {} um", options.chord_error_mm * 1e3));
        }
        Ok(Path { legs, overshoots, traversals, rest_s, feed, remarks, warnings })
    }

    /// Number of states of the measured path at which the axes rest.
    pub fn targets(&self) -> usize {
        self.legs.iter().filter(|leg| leg.rest_s.is_some()).map(|leg| leg.vertices.len()).sum()
    }

    /// The first state, with overshoot.
    pub fn start(&self) -> &[f64] {
        self.legs.first().and_then(|leg| leg.vertices.first()).map_or(&[], Vec::as_slice)
    }

    /// The last state of a forward traversal, with overshoot.
    pub fn end(&self) -> &[f64] {
        self.legs.last().and_then(|leg| leg.vertices.last()).map_or(&[], Vec::as_slice)
    }
}

/// The test with another range of its motion, traversed once with this many steps.
fn with_range(test: &Test, range: [f64; 2], steps: usize) -> Test {
    let motion =
        test.motion.as_ref().map(|motion| Motion { course: motion.course.once(range, steps), ..motion.clone() });
    Test { motion, ..test.clone() }
}

fn of_plan(error: Diagnostic) -> Diagnostic {
    let help = error.help().unwrap_or("plan within the travel of the machine").to_string();
    error::nc(error.to_string(), help)
}

/// The states of a range in equal steps.
fn states(machine: &Machine, test: &Test, range: [f64; 2], steps: usize) -> Result<Vec<Vec<f64>>, Diagnostic> {
    let readings = planned(machine, &with_range(test, range, steps)).map_err(of_plan)?;
    Ok((0..readings.rows()).map(|row| readings.positions.iter().map(|column| column[row]).collect()).collect())
}

/// The range with its overshoot, mm or rad.
fn overshot(
    machine: &Machine,
    test: &Test,
    motion: &Motion,
    options: &NcOptions,
    warnings: &mut Vec<String>,
) -> Result<[f64; 2], Diagnostic> {
    let Course { from, to, .. } = motion.course;
    let sign = (to - from).signum();
    let linear = !motion.is_angular(machine);
    let full = !linear && (to - from).abs() > TAU - 1e-9;
    let stated = if linear { options.overshoot_mm } else { options.overshoot_deg.map(f64::to_radians) };
    let usual = match (linear, full) {
        (true, _) => USUAL_MM,
        (false, true) => FULL_CIRCLE_DEG.to_radians(),
        (false, false) => PART_DEG.to_radians(),
    };
    let wanted = stated.unwrap_or(usual);
    let with = |before: f64, after: f64| [from - sign * before, to + sign * after];
    let whole = with(wanted, wanted);
    let reached = states(machine, test, whole, 64);
    if reached.is_ok() || stated.is_some() {
        return reached.map(|_| whole);
    }
    // Less where the travel of the axis, or of an axis that follows it, ends.
    let room = |end: f64, sign: f64| match &motion.moved {
        Moved::Line { axes, ends, .. } => room_on_line(machine, axes, ends, end, sign, wanted),
        _ => motion.axis().map_or(wanted, |axis| room_of(&machine.axes[axis], end, sign, wanted)),
    };
    let less = with(room(from, -sign), room(to, sign));
    let range = if states(machine, test, less, 64).is_ok() { less } else { [from, to] };
    states(machine, test, range, 64)?;
    let unit = if linear { "mm" } else { "deg" };
    let [before, after] = [from - range[0], range[1] - to].map(|part| {
        let part = part.abs();
        if linear { part } else { part.to_degrees() }
    });
    warnings.push(format!(
        "Overshoot {before:.3} {unit} before and {after:.3} {unit} after the measured path: the travel ends there"
    ));
    Ok(range)
}

/// How far an axis can go beyond a position, at most as far as wanted, mm or rad.
fn room_of(axis: &Axis, end: f64, sign: f64, wanted: f64) -> f64 {
    match axis.travel {
        Some([low, high]) => if sign > 0.0 { high - end } else { end - low }.clamp(0.0, wanted),
        None => wanted,
    }
}

/// How far a line can go beyond a distance along it, at most as far as wanted, mm.
fn room_on_line(machine: &Machine, axes: &[usize], ends: &[[f64; 2]], at: f64, sign: f64, wanted: f64) -> f64 {
    let length = length_of(ends);
    axes.iter().zip(ends).fold(wanted, |least, (axis, [start, end])| {
        let rate = (end - start) / length;
        let position = start + rate * at;
        least.min(room_of(&machine.axes[*axis], position, sign * rate, wanted * rate.abs()) / rate.abs())
    })
}

impl Leg {
    fn of(
        machine: &Machine,
        (test, motion): (&Test, &Motion),
        range: [f64; 2],
        measured: bool,
        control: &dyn Control,
        options: &NcOptions,
    ) -> Result<Leg, Diagnostic> {
        let span = (range[1] - range[0]).abs();
        let rest_s = (measured && test.station.handling().reads_at_rest).then_some(options.dwell_s);
        let stated = (span / motion.course.step).round().max(1.0) as usize;
        let (feed, _) = motion.feed(machine);
        let radius = match &motion.moved {
            Moved::Axis(_) => {
                let vertices = states(machine, test, range, rest_s.map_or(1, |_| stated))?;
                return Ok(Leg { vertices, measured, rest_s, shape: Shape::Line(feed) });
            }
            Moved::Line { in_turn, .. } => {
                // Axes that move in turn leave the line at every step.
                let steps = if *in_turn || rest_s.is_some() { stated } else { 1 };
                let vertices = states(machine, test, range, steps)?;
                return Ok(Leg { vertices, measured, rest_s, shape: Shape::Line(feed) });
            }
            Moved::Circle { axes, radius, .. } => {
                // Half a turn at most: a block with equal ends means nothing or a whole turn, as the control has it.
                let least = (span / (0.9 * PI)).ceil().max(1.0) as usize;
                let vertices = states(machine, test, range, rest_s.map_or(least, |_| stated.max(least)))?;
                let whole = states(machine, test, [0.0, PI], 1);
                if let (Some((plane, order)), Ok(whole)) = (plane(machine, *axes), whole) {
                    let centre = axes.map(|axis| 0.5 * (whole[0][axis] + whole[1][axis]));
                    let round = vertices.iter().all(|state| {
                        let [x, y] = [0, 1].map(|i| state[axes[i]] - centre[i]);
                        (x.hypot(y) - radius).abs() < 1e-6
                    });
                    if round && control.has_arc(plane) {
                        let forward = range[1] > range[0];
                        let swapped = order == [1, 0];
                        let shape = Shape::Arc {
                            plane,
                            axes: order.map(|i| axes[i]),
                            centre: order.map(|i| centre[i]),
                            counterclockwise: forward != swapped,
                            feed,
                        };
                        return Ok(Leg { vertices, measured, rest_s, shape });
                    }
                }
                *radius
            }
            Moved::Follow { .. } => 1.0,
        };
        let mut steps = match rest_s {
            Some(_) => stated,
            None => (span / 2_f64.to_radians()).ceil().max(1.0) as usize,
        };
        let vertices = loop {
            let vertices = states(machine, test, range, steps)?;
            let error_mm = chord_error_mm(machine, test, &vertices);
            // Between targets nothing is read.
            if error_mm <= options.chord_error_mm || rest_s.is_some() {
                break vertices;
            }
            // The error falls with the square of the step.
            let factor = (error_mm / options.chord_error_mm).sqrt() * 1.02;
            steps = ((steps as f64 * factor).ceil() as usize).max(steps + 1);
            if steps > MOST_SEGMENTS {
                return Err(error::nc(
                    format!("test \"{}\" needs more than {MOST_SEGMENTS} segments", test.name),
                    "allow a larger chord error",
                ));
            }
        };
        let seconds = span * radius / motion.course.speed / (vertices.len() - 1) as f64;
        let vertices = match motion.axis() {
            Some(axis) => {
                let increment = 0.1_f64.powi(options.decimals(control) as i32);
                on_the_grid(machine, test, axis, vertices, increment)?
            }
            None => vertices,
        };
        let tool_points = (options.tool_point && motion.axis().is_some())
            .then(|| vertices.iter().map(|state| tool_over_table(machine, test, state)).collect());
        Ok(Leg { vertices, measured, rest_s, shape: Shape::Segments { seconds, tool_points } })
    }

    /// The blocks of the leg, from its first state to its last or back, with a rest at each state if it has rests.
    pub fn blocks(&self, letters: &[char], machine: &Machine, back: bool) -> Vec<Block> {
        let Some(rest_s) = self.rest_s else { return self.through(letters, machine, back) };
        let rest = Block::Dwell(rest_s);
        let each = (0..self.vertices.len().saturating_sub(1)).map(|k| {
            let k = if back { self.vertices.len() - 2 - k } else { k };
            let mut blocks = self.part(k).through(letters, machine, back);
            blocks.push(rest.clone());
            blocks
        });
        std::iter::once(vec![rest.clone()]).chain(each).flatten().collect()
    }

    /// The part between the `k`-th state and the next.
    fn part(&self, k: usize) -> Leg {
        let shape = match &self.shape {
            Shape::Segments { seconds, tool_points } => Shape::Segments {
                seconds: *seconds,
                tool_points: tool_points.as_ref().map(|points| points[k..k + 2].to_vec()),
            },
            other => other.clone(),
        };
        Leg { vertices: self.vertices[k..k + 2].to_vec(), measured: self.measured, rest_s: None, shape }
    }

    /// The blocks of the leg without a rest.
    pub fn through(&self, letters: &[char], machine: &Machine, back: bool) -> Vec<Block> {
        let order: Vec<usize> =
            if back { (0..self.vertices.len()).rev().collect() } else { (0..self.vertices.len()).collect() };
        let display = |axis: usize, state: &[f64]| (letters[axis], machine.axes[axis].kind.to_display(state[axis]));
        let pairs = order.windows(2).map(|pair| (&self.vertices[pair[0]], &self.vertices[pair[1]]));
        match &self.shape {
            Shape::Line(feed) => pairs
                .map(|(from, to)| {
                    let moved = |state: &[f64]| -> Vec<(char, f64)> {
                        (0..letters.len()).filter(|k| from[*k] != to[*k]).map(|axis| display(axis, state)).collect()
                    };
                    Block::Line { from: moved(from), to: moved(to), feed: *feed }
                })
                .collect(),
            Shape::Arc { plane, axes, centre, counterclockwise, feed } => pairs
                .map(|(from, to)| Block::Arc {
                    plane: *plane,
                    from: axes.map(|axis| display(axis, from)),
                    to: axes.map(|axis| display(axis, to)),
                    centre_at: *centre,
                    counterclockwise: *counterclockwise != back,
                    feed: *feed,
                })
                .collect(),
            Shape::Segments { seconds, tool_points: None } => {
                let moves = |axis: &usize| self.vertices.iter().any(|state| state[*axis] != self.vertices[0][*axis]);
                let moving: Vec<usize> = (0..letters.len()).filter(moves).collect();
                let at = |state: &[f64]| moving.iter().map(|axis| display(*axis, state)).collect();
                vec![Block::Segments {
                    from: order.first().map(|first| at(&self.vertices[*first])).unwrap_or_default(),
                    ends: pairs.map(|(_, to)| (at(to), *seconds)).collect(),
                    tool_point: false,
                }]
            }
            Shape::Segments { seconds, tool_points: Some(points) } => {
                let rotary: Vec<usize> =
                    (0..letters.len()).filter(|axis| machine.axes[*axis].kind == AxisKind::Rotary).collect();
                let at = |number: usize| -> Vec<(char, f64)> {
                    let linear = ['X', 'Y', 'Z'].into_iter().zip(points[number]);
                    linear.chain(rotary.iter().map(|axis| display(*axis, &self.vertices[number]))).collect()
                };
                let same = |p: &[f64; 3]| (0..3).all(|i| (p[i] - points[0][i]).abs() < 1e-7);
                let count = order.len() - 1;
                // A tool point that stays over its place of the table needs one block.
                let ends = match points.iter().all(same) {
                    true => vec![(at(order[count]), seconds * count as f64)],
                    false => order[1..].iter().map(|number| (at(*number), *seconds)).collect(),
                };
                vec![Block::Segments { from: at(order[0]), ends, tool_point: true }]
            }
        }
    }
}

/// The vertices moved along the path to where the axis that the others follow is a whole number of increments: the
/// rounding of its position then costs nothing, however long the lever. The ends stay.
fn on_the_grid(
    machine: &Machine,
    test: &Test,
    axis: usize,
    mut vertices: Vec<Vec<f64>>,
    increment: f64,
) -> Result<Vec<Vec<f64>>, Diagnostic> {
    let kind = machine.axes[axis].kind;
    let last = vertices.len() - 1;
    let Some(end) = vertices.last().map(|end| end[axis]) else { return Ok(vertices) };
    for vertex in &mut vertices[1..last] {
        let whole = (kind.to_display(vertex[axis]) / increment).round() * increment;
        let range = [kind.to_internal(whole), end];
        if range[0] != vertex[axis] && range[0] != end {
            *vertex = states(machine, test, range, 1)?.swap_remove(0);
        }
    }
    Ok(vertices)
}

/// The plane of two axes, and the order in which a counterclockwise turn goes through them.
fn plane(machine: &Machine, axes: [usize; 2]) -> Option<(Plane, [usize; 2])> {
    match axes.map(|axis| machine.axes[axis].name.as_str()) {
        ["X", "Y"] => Some((Plane::Xy, [0, 1])),
        ["Y", "X"] => Some((Plane::Xy, [1, 0])),
        ["Z", "X"] => Some((Plane::Zx, [0, 1])),
        ["X", "Z"] => Some((Plane::Zx, [1, 0])),
        ["Y", "Z"] => Some((Plane::Yz, [0, 1])),
        ["Z", "Y"] => Some((Plane::Yz, [1, 0])),
        _ => None,
    }
}

/// The largest deviation of the distance of the balls at the middle of a segment from that at its ends, mm.
fn chord_error_mm(machine: &Machine, test: &Test, vertices: &[Vec<f64>]) -> f64 {
    let bar = test
        .station
        .between_points()
        .unwrap_or(BallBar { spindle_ball: test.station.tool_point(), ..BallBar::ORIGINS });
    let distance = |at: &[f64]| {
        let (workpiece, spindle) = balls(machine, &bar, at);
        (0..3).map(|i| (spindle[i] - workpiece[i]).powi(2)).sum::<f64>().sqrt()
    };
    let of_segment = |pair: &[Vec<f64>]| {
        let middle: Vec<f64> = pair[0].iter().zip(&pair[1]).map(|(a, b)| 0.5 * (a + b)).collect();
        (distance(&middle) - 0.5 * (distance(&pair[0]) + distance(&pair[1]))).abs()
    };
    vertices.windows(2).map(of_segment).fold(0.0, f64::max)
}

/// The tool point in the table frame, mm.
fn tool_over_table(machine: &Machine, test: &Test, state: &[f64]) -> [f64; 3] {
    let states = machine.axis_positions(state);
    let none = vec![BodyErrors::<f64>::NONE; state.len()];
    let tool = test.station.tool_point().nominal_in_r(machine, &states);
    machine.in_frame::<f64>(Frame::Table, &states, &none, tool).0
}

impl Path {
    /// Duration of all traversals with pauses of `dwell_s` between them, min.
    pub fn minutes(&self, machine: &Machine, dwell_s: f64) -> f64 {
        let once: f64 = self.legs.iter().map(|leg| leg.minutes(machine)).sum();
        let traversals = self.traversals.are_backward().len();
        // In one direction alone the axes go back between two runs.
        let ways = if self.traversals.both_directions() { traversals } else { 2 * traversals - 1 };
        let rests_s = self.rest_s.unwrap_or(0.0) * (self.targets() * traversals) as f64;
        once * ways as f64 + dwell_s / 60.0 * (traversals - 1) as f64 + rests_s / 60.0
    }
}

impl Leg {
    /// Its duration, min.
    fn minutes(&self, machine: &Machine) -> f64 {
        let pairs = self.vertices.windows(2);
        match &self.shape {
            Shape::Line(feed) => {
                let longest = |pair: &[Vec<f64>]| {
                    let moved = machine.axes.iter().zip(pair[0].iter().zip(&pair[1]));
                    moved.map(|(axis, (a, b))| axis.kind.to_display(b - a).abs()).fold(0.0, f64::max)
                };
                pairs.map(longest).sum::<f64>() / feed
            }
            Shape::Arc { axes, centre, feed, .. } => {
                let angle = |state: &[f64]| (state[axes[1]] - centre[1]).atan2(state[axes[0]] - centre[0]);
                let radius = |state: &[f64]| (state[axes[0]] - centre[0]).hypot(state[axes[1]] - centre[1]);
                // No arc is longer than half a turn.
                let turn = |a: f64, b: f64| ((b - a + PI).rem_euclid(TAU) - PI).abs();
                pairs.map(|pair| radius(&pair[0]) * turn(angle(&pair[0]), angle(&pair[1]))).sum::<f64>() / feed
            }
            Shape::Segments { seconds, .. } => seconds / 60.0 * pairs.len() as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use abbe_model::session::motion::Traversals;

    /// One way through a leg of each kind. The machine has the axes X, Y and C in this order.
    fn minutes(shape: Shape, vertices: &[[f64; 3]]) -> f64 {
        let vertices = vertices.iter().map(|state| state.to_vec()).collect();
        let leg = Leg { vertices, measured: true, rest_s: None, shape };
        let machine = Machine::from_code("w C b X Y t").unwrap();
        let place = |name: &str| machine.axis_index(name).unwrap();
        let order = [place("X"), place("Y"), place("C")];
        let ordered = |state: &Vec<f64>| {
            let mut own = vec![0.0; 3];
            order.iter().zip(state).for_each(|(place, value)| own[*place] = *value);
            own
        };
        let leg = Leg { vertices: leg.vertices.iter().map(ordered).collect(), ..leg };
        let path = Path {
            legs: vec![leg],
            overshoots: Vec::new(),
            traversals: Traversals::new(1, false),
            rest_s: None,
            feed: (0.0, ""),
            remarks: Vec::new(),
            warnings: Vec::new(),
        };
        path.minutes(&machine, 60.0)
    }

    /// 500 mm at 1000 mm/min take half a minute, 180° at 90°/min two minutes, ten segments of 3 s half a minute.
    #[test]
    fn a_path_takes_its_length_over_its_feed() {
        assert!((minutes(Shape::Line(1000.0), &[[0.0, 0.0, 0.0], [-500.0, 0.0, 0.0]]) - 0.5).abs() < 1e-12);
        assert!((minutes(Shape::Line(1000.0), &[[200.0, 50.0, 0.0], [-300.0, 0.0, 0.0]]) - 0.5).abs() < 1e-12);
        assert!((minutes(Shape::Line(90.0), &[[0.0, 0.0, 0.0], [0.0, 0.0, PI]]) - 2.0).abs() < 1e-12);
        let steps: Vec<[f64; 3]> = (0..=10).map(|k| [f64::from(k), 0.0, 0.0]).collect();
        assert!((minutes(Shape::Segments { seconds: 3.0, tool_points: None }, &steps) - 0.5).abs() < 1e-12);
    }
}
