//! The circular path of a test: angle, direction and radial deviation of every reading.

use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::driver::DriverSample;
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::Test;

use crate::numerics::{circle, range};

/// Least number of readings of a run.
const MIN_READINGS: usize = 8;
/// Tolerance of positions about a circle, as a share of its radius.
const OFF_CIRCLE: f64 = 1e-3;
/// Tolerance of the nominal length about the radius for a bar in the plane of the circle, as a share.
const OFF_PLANE: f64 = 0.02;

/// The axes that move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum MovingAxes {
    /// Two linear axes, by index, on a circle of this radius, mm.
    Linear {
        axes: [usize; 2],
        radius_mm: f64,
        /// Whether the bar lies along the radius and thus measures the radius of the path.
        radial: bool,
    },
    /// A rotary axis, by index.
    Rotary(usize),
}

/// The readings of one run in one direction.
#[derive(Clone, Debug)]
pub(super) struct DirectionRun {
    /// Its rows.
    pub rows: Range<usize>,
    /// +1 if the angle increases.
    pub direction: f64,
}

/// A test's path.
#[derive(Clone, Debug)]
pub(super) struct Path {
    /// The model of the test.
    pub model: TestModel,
    pub moves: MovingAxes,
    pub runs: Vec<DirectionRun>,
    /// Angle of each row, rad, unwrapped within a run.
    pub angle: Vec<f64>,
    /// Observed less nominal length, mm.
    pub deviation_mm: Vec<f64>,
    /// Nominal length, mm.
    pub nominal_mm: Vec<f64>,
    /// Outliers.
    pub left_out: Vec<bool>,
    /// Positions and velocities of the two linear axes.
    pub samples: [Vec<DriverSample<f64>>; 2],
    /// Speed along the path, mm/s, if the data have times and linear axes move.
    pub feed_mm_s: Option<f64>,
}

impl Path {
    /// The path of a ball-bar test that is circular.
    pub fn of(machine: &Arc<Machine>, test: &Test) -> Option<Path> {
        let readings = test.readings.as_ref()?;
        test.station.bar()?;
        let model = TestModel::new(Arc::clone(machine), test.station.clone(), readings);
        let nominal_mm = model.readings(&SlotValues::zero(model.slots()));
        let moves = moves(machine, &readings.positions, &nominal_mm)?;
        let mut angle = match moves {
            MovingAxes::Rotary(axis) => readings.positions[axis].clone(),
            MovingAxes::Linear { axes, .. } => around(&readings.positions, axes)?,
        };
        let mut runs = Vec::new();
        for rows in readings.runs() {
            for row in rows.start + 1..rows.end {
                if let MovingAxes::Linear { .. } = moves {
                    angle[row] -= ((angle[row] - angle[row - 1]) / TAU).round() * TAU;
                }
            }
            if rows.len() >= MIN_READINGS {
                let direction = (angle[rows.end - 1] - angle[rows.start]).signum();
                runs.push(DirectionRun { rows, direction });
            }
        }
        if runs.is_empty() {
            return None;
        }
        let samples = match moves {
            MovingAxes::Linear { axes, .. } => axes.map(|axis| readings.axis_samples(axis, AxisKind::Linear)),
            MovingAxes::Rotary(_) => [Vec::new(), Vec::new()],
        };
        let feed_mm_s = feed(&samples, !readings.time_s.is_empty());
        Some(Path {
            model,
            moves,
            runs,
            angle,
            deviation_mm: readings.observed.iter().zip(&nominal_mm).map(|(read, nominal)| read - nominal).collect(),
            nominal_mm,
            left_out: vec![false; readings.rows()],
            samples,
            feed_mm_s,
        })
    }

    /// Whether the path was traversed in both directions.
    pub fn both_directions(&self) -> bool {
        self.runs.iter().any(|run| run.direction > 0.0) && self.runs.iter().any(|run| run.direction < 0.0)
    }

    /// Arc of the longest run, rad, at most one full turn.
    pub fn arc(&self) -> f64 {
        self.runs.iter().map(|run| range(&self.angle[run.rows.clone()])).fold(0.0, f64::max).min(TAU)
    }
}

/// The moving axes of a test, if they make a circle.
fn moves(machine: &Machine, positions: &[Vec<f64>], nominal_mm: &[f64]) -> Option<MovingAxes> {
    let moving = |kind: AxisKind, least: f64| -> Vec<usize> {
        (0..machine.axes.len())
            .filter(|&axis| machine.axes[axis].kind == kind && range(&positions[axis]) > least)
            .collect()
    };
    let (linear, rotary) = (moving(AxisKind::Linear, 1e-3), moving(AxisKind::Rotary, 1e-4));
    match (&linear[..], &rotary[..]) {
        (_, [axis]) => Some(MovingAxes::Rotary(*axis)),
        (&[first, second], []) => {
            let points: Vec<[f64; 2]> = points(positions, [first, second]);
            let circle = circle::through(&points)?;
            let off = points
                .iter()
                .map(|p| ((p[0] - circle.centre[0]).hypot(p[1] - circle.centre[1]) - circle.radius).abs())
                .fold(0.0, f64::max);
            (off < OFF_CIRCLE * circle.radius).then(|| MovingAxes::Linear {
                axes: ordered(machine, [first, second]),
                radius_mm: circle.radius,
                radial: nominal_mm.iter().all(|length| (length - circle.radius).abs() < OFF_PLANE * circle.radius),
            })
        }
        _ => None,
    }
}

/// The two axes in the order of their names: XY, XZ, YZ.
fn ordered(machine: &Machine, axes: [usize; 2]) -> [usize; 2] {
    if machine.axes[axes[0]].name <= machine.axes[axes[1]].name { axes } else { [axes[1], axes[0]] }
}

fn points(positions: &[Vec<f64>], axes: [usize; 2]) -> Vec<[f64; 2]> {
    positions[axes[0]].iter().zip(&positions[axes[1]]).map(|(a, b)| [*a, *b]).collect()
}

/// Angles of positions about the centre of their circle, in (−π, π].
fn around(positions: &[Vec<f64>], axes: [usize; 2]) -> Option<Vec<f64>> {
    let points = points(positions, axes);
    let centre = circle::through(&points)?.centre;
    let angle = |p: &[f64; 2]| {
        let angle = (p[1] - centre[1]).atan2(p[0] - centre[0]);
        if angle <= -PI + 1e-9 { PI } else { angle }
    };
    Some(points.iter().map(angle).collect())
}

/// The median speed along the path.
fn feed(samples: &[Vec<DriverSample<f64>>; 2], timed: bool) -> Option<f64> {
    if !timed || samples[0].is_empty() {
        return None;
    }
    let mut speeds: Vec<f64> = samples[0].iter().zip(&samples[1]).map(|(a, b)| a.rate.hypot(b.rate)).collect();
    speeds.sort_by(f64::total_cmp);
    speeds.get(speeds.len() / 2).copied().filter(|speed| *speed > 0.0)
}
