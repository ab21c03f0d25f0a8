//! Candidate poses: drawn within the travel of the axes, kept where the limits permit them.

use std::f64::consts::TAU;

use abbe_model::axis::AxisKind;
use abbe_model::chain::{AxisPosition, BodyErrors, Machine};
use abbe_model::frames::Point;
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::instrument::{InstrumentKind, Station};
use abbe_model::session::placing::{axis_line, positions_for_bar};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use rand_pcg::Pcg64;

use super::between;
use crate::error::IdentifyError;
use crate::plan::collision::{Bodies, Parts, segment_distance};

/// Where poses may be. Lengths in mm, in R.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseLimits {
    /// Least and greatest X, Y, Z of the instrument's point of the tool.
    pub box_mm: Option<[[f64; 2]; 3]>,
    /// A tracker that has to see that point.
    pub sight: Option<LineOfSight>,
}

/// The line of sight from a tracker to the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineOfSight {
    /// The tracker.
    pub from_mm: [f64; 3],
    /// Least distance of the line from the links of the machine: the lines between the origins of its axes.
    pub clearance_mm: f64,
}

/// Candidate poses.
pub(super) struct Candidates {
    /// Positions of all axes, mm or rad.
    pub states: Vec<Vec<f64>>,
    /// Number of poses that the limits excluded.
    pub excluded: usize,
}

/// Most poses that are drawn for a candidate.
const DRAWS_PER_CANDIDATE: usize = 200;
/// Travel of a rotary axis that states none, rad.
const TURN: [f64; 2] = [-0.5 * TAU, 0.5 * TAU];
/// Part of the sight beside the target that is not compared with the links, as a multiple of the clearance: the last link
/// ends at the target.
const AT_TARGET: f64 = 2.0;

/// Draws candidate poses.
pub(super) fn draw(
    session: &Session,
    test: &Test,
    limits: &PoseLimits,
    count: usize,
    random: &mut Pcg64,
) -> Result<Candidates, IdentifyError> {
    let machine = &session.machine;
    let kind = test.station.kind();
    if !matches!(kind, InstrumentKind::Tracker | InstrumentKind::RTest | InstrumentKind::BallBar) {
        return Err(IdentifyError::Request(format!(
            "poses are chosen for trackers, R-tests and ball bars; the states of a {} are not free: {}",
            kind.word(),
            match kind {
                InstrumentKind::Socket => "the ball of the tool has to lie in a socket at each of them",
                _ => "the tool has to touch the artefact at each of them",
            }
        )));
    }
    let bar = bar_of(&test.station);
    let untravelled = machine.axes.iter().find(|axis| axis.kind == AxisKind::Linear && axis.travel.is_none());
    if let (Some(axis), None) = (untravelled, &bar) {
        return Err(IdentifyError::Request(format!(
            "axis `{}` states no travel, so that no poses can be drawn; add `travel_mm` to the machine",
            axis.name
        )));
    }
    let bodies = Bodies::of(machine);
    let parts = Parts::of(session, &bodies, test);
    let mut found = Candidates { states: Vec::with_capacity(count), excluded: 0 };
    while found.states.len() < count && found.excluded < count * DRAWS_PER_CANDIDATE {
        let mut at: Vec<f64> = machine
            .axes
            .iter()
            .map(|axis| match (axis.kind, axis.travel) {
                // A turn at most, about the middle of the travel: positions beyond it are the same poses.
                (AxisKind::Rotary, Some([low, high])) => {
                    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low).min(TAU));
                    between(random, [middle - half, middle + half])
                }
                (AxisKind::Rotary, None) => between(random, TURN),
                (AxisKind::Linear, Some(travel)) => between(random, travel),
                (AxisKind::Linear, None) => 0.0,
            })
            .collect();
        if let Some(bar) = &bar {
            let requested = direction(random).map(|x| x * bar.bar);
            match positions_for_bar(machine, bar, &at, requested) {
                Some(placed) => at = placed,
                None => {
                    found.excluded += 1;
                    continue;
                }
            }
        }
        if is_permitted(machine, &test.station, &at, limits) && parts.as_ref().is_none_or(|parts| parts.clears(&at)) {
            found.states.push(at);
        } else {
            found.excluded += 1;
        }
    }
    Ok(found)
}

/// The points that the linear axes hold at a distance, if the instrument has one on either side.
fn bar_of(station: &Station<f64>) -> Option<BallBar<f64>> {
    Some(BallBar {
        workpiece_ball: station.table_point_mm()?,
        spindle_ball: station.tool_point_mm(),
        bar: station.reference_mm(),
    })
}

/// A direction, uniform over the upper half of the sphere.
fn direction(random: &mut Pcg64) -> [f64; 3] {
    let z = between(random, [0.0, 1.0]);
    let (sin, cos) = between(random, TURN).sin_cos();
    let across = (1.0 - z * z).sqrt();
    [across * cos, across * sin, z]
}

fn is_permitted(machine: &Machine, station: &Station<f64>, at: &[f64], limits: &PoseLimits) -> bool {
    let inside =
        machine.axes.iter().zip(at).all(|(axis, q)| axis.travel.is_none_or(|[low, high]| *q >= low && *q <= high));
    if !inside {
        return false;
    }
    let states: Vec<AxisPosition<f64>> =
        machine.axes.iter().zip(at).map(|(axis, q)| AxisPosition::new(axis.kind, *q)).collect();
    let none = vec![BodyErrors::<f64>::NONE; at.len()];
    let tool = machine.tool_point::<f64>(&states, &none, Point(station.tool_point_mm())).0;
    let in_box = |limits: &[[f64; 2]; 3]| (0..3).all(|i| tool[i] >= limits[i][0] && tool[i] <= limits[i][1]);
    if !limits.box_mm.as_ref().is_none_or(in_box) {
        return false;
    }
    limits.sight.as_ref().is_none_or(|sight| {
        let mut joints: Vec<[f64; 3]> =
            (machine.workpiece_side..machine.axes.len()).map(|axis| axis_line(machine, at, axis).0).collect();
        joints.insert(0, [0.0; 3]);
        joints.push(tool);
        let to = shortened(sight.from_mm, tool, AT_TARGET * sight.clearance_mm);
        joints.windows(2).all(|link| segment_distance(sight.from_mm, to, link[0], link[1]) >= sight.clearance_mm)
    })
}

/// The end of a line, moved back by a length.
fn shortened(from: [f64; 3], to: [f64; 3], by: f64) -> [f64; 3] {
    let along: [f64; 3] = std::array::from_fn(|i| to[i] - from[i]);
    let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length <= by {
        return from;
    }
    std::array::from_fn(|i| from[i] + along[i] * (1.0 - by / length))
}

/// States without readings.
pub(super) fn states_of(machine: &Machine, poses: &[Vec<f64>], coordinates: usize) -> Readings {
    Readings {
        positions: (0..machine.axes.len()).map(|axis| poses.iter().map(|pose| pose[axis]).collect()).collect(),
        coordinates,
        observed: vec![0.0; poses.len() * coordinates],
        ..Readings::default()
    }
}
