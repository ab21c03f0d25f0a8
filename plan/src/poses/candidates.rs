//! Candidate poses: drawn within the travel of the axes, brought to where the instrument measures, and kept where the
//! limits permit them.

use std::f64::consts::TAU;

use abbe_model::Diagnostic;
use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::Machine;
use abbe_model::instrument::{Contact, Station};
use abbe_model::session::placing::axis_line;
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use rand_pcg::Pcg64;

use super::between;
use super::place::Place;
use crate::collision::{Bodies, Parts, segment_distance};
use abbe_identify::numerics::parallel;

/// Where poses may be. Lengths in mm, in R.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseLimits {
    /// Least and greatest X, Y, Z of the instrument's point of the tool.
    pub box_mm: Option<[[f64; 2]; 3]>,
    /// A tracker that has to see that point.
    pub sight: Option<LineOfSight>,
    /// Part of a probe's cylinder that may be touched: least and greatest distance along its axis from its point.
    pub height_mm: [f64; 2],
}

/// The line of sight from a tracker to the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineOfSight {
    /// The tracker.
    pub from_mm: [f64; 3],
    /// Least distance of the line from the links of the machine: the lines between the origins of its axes.
    pub clearance_mm: f64,
}

/// Candidate poses of one test.
pub(super) struct Candidates {
    /// Positions of all axes, mm or rad.
    pub states: Vec<Vec<f64>>,
    /// Number of drawn poses that do not meet the instrument's condition or the limits.
    pub excluded: usize,
    /// Number of those that do not meet the instrument's condition.
    pub unmet: usize,
}

/// Most poses that are drawn for a candidate.
const DRAWS_PER_CANDIDATE: usize = 200;
/// The same if each needs iterations.
const SOLVED_DRAWS_PER_CANDIDATE: usize = 20;
/// Number of draws without a candidate after which none is expected, if iterations are needed or no draw has met the
/// instrument's condition.
const FRUITLESS_DRAWS: usize = 1000;
/// Poses that are drawn before they are judged together.
const BATCH: usize = 250;
/// Travel of a rotary axis that states none, rad.
const TURN: [f64; 2] = [-0.5 * TAU, 0.5 * TAU];
/// Part of the sight beside the target that is not compared with the links, as a multiple of the clearance: the last link
/// ends at the target.
const AT_TARGET: f64 = 2.0;

/// Draws candidate poses of a test.
///
/// # Errors
/// If a linear axis has to be drawn and states no travel.
pub(super) fn draw(
    session: &Session,
    test: &Test,
    limits: &PoseLimits,
    count: usize,
    random: &mut Pcg64,
) -> Result<Candidates, Diagnostic> {
    let machine = &*session.machine;
    let station = &test.station;
    let is_placed = station.table_point().is_some();
    let untravelled = machine.axes.iter().find(|axis| axis.kind == AxisKind::Linear && axis.travel.is_none());
    if let (Some(axis), false) = (untravelled, is_placed) {
        return Err(Diagnostic::identification(format!(
            "axis `{}` states no travel, so that no poses can be drawn; add `travel_mm` to the machine",
            axis.name
        )));
    }
    let iterates = match station.contact() {
        Contact::None => false,
        Contact::InR(_) => true,
        _ => machine.axes.iter().all(|axis| axis.kind == AxisKind::Rotary),
    };
    let most = count * if iterates { SOLVED_DRAWS_PER_CANDIDATE } else { DRAWS_PER_CANDIDATE };
    let bodies = Bodies::of(machine);
    let parts = Parts::of(session, &bodies, test);
    let mut found = Candidates { states: Vec::with_capacity(count), excluded: 0, unmet: 0 };
    while found.states.len() < count && found.excluded < most {
        let fruitless = found.states.is_empty() && found.excluded >= FRUITLESS_DRAWS;
        if fruitless && (iterates || found.unmet == found.excluded) {
            break;
        }
        let batch: Vec<(Vec<f64>, Place)> =
            (0..BATCH).map(|_| (drawn(machine, random), Place::draw(station, limits.height_mm, random))).collect();
        let met = parallel::map(BATCH, &|k| {
            let (drawn, goal) = &batch[k];
            let at = goal.met(machine, station, drawn)?;
            let kept = is_permitted(machine, station, &at, limits) && parts.as_ref().is_none_or(|it| it.clears(&at));
            Some(kept.then_some(at))
        });
        for pose in met {
            match pose {
                _ if found.states.len() == count => break,
                Some(Some(at)) => found.states.push(at),
                Some(None) => found.excluded += 1,
                None => {
                    found.excluded += 1;
                    found.unmet += 1;
                }
            }
        }
    }
    Ok(found)
}

/// Positions of all axes within their travel.
fn drawn(machine: &Machine, random: &mut Pcg64) -> Vec<f64> {
    let position = |axis: &Axis| match (axis.kind, axis.travel) {
        // A turn at most, about the middle of the travel: positions beyond it are the same poses.
        (AxisKind::Rotary, Some([low, high])) => {
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low).min(TAU));
            between(random, [middle - half, middle + half])
        }
        (AxisKind::Rotary, None) => between(random, TURN),
        (AxisKind::Linear, Some(travel)) => between(random, travel),
        (AxisKind::Linear, None) => 0.0,
    };
    machine.axes.iter().map(position).collect()
}

fn is_permitted(machine: &Machine, station: &Station<f64>, at: &[f64], limits: &PoseLimits) -> bool {
    let inside =
        machine.axes.iter().zip(at).all(|(axis, q)| axis.travel.is_none_or(|[low, high]| *q >= low && *q <= high));
    if !inside {
        return false;
    }
    let tool = station.tool_point().nominal_mm(machine, &machine.axis_positions(at));
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
pub(super) fn states_of(machine: &Machine, poses: &[&[f64]], station: &Station<f64>) -> Readings {
    let channels = station.channels().len();
    Readings {
        positions: (0..machine.axes.len()).map(|axis| poses.iter().map(|pose| pose[axis]).collect()).collect(),
        channels,
        observed: vec![0.0; poses.len() * channels],
        ..Readings::default()
    }
}

#[cfg(test)]
mod tests {
    use super::shortened;

    /// A line of 13 mm along (3, 4, 12).
    #[test]
    fn a_line_is_shortened_at_its_end() {
        let (from, to) = ([1.0, 2.0, 3.0], [4.0, 6.0, 15.0]);
        let found = shortened(from, to, 6.5);
        let middle = [2.5, 4.0, 9.0];
        assert!((0..3).all(|i| (found[i] - middle[i]).abs() < 1e-12), "{found:?}");
        assert_eq!(shortened(from, to, 0.0), to);
        for by in [13.0, 20.0] {
            assert_eq!(shortened(from, to, by), from);
        }
        assert_eq!(shortened(from, from, 0.0), from);
    }
}
