//! Where a target or a ball is that no one knows: the point of the tool frame with which the nominal machine explains the
//! readings best.
//!
//! The position of a point in R is affine in the point, `P_i(t) = P_i(t₀) + A_i·(t − t₀)`. A ball in sockets therefore is a
//! linear least-squares problem, and a target before an instrument one for a given orientation of the instrument, which
//! alternates with the orientation for a given target (Kabsch, Acta Cryst. A32 (1976) 922). The place of instrument or
//! socket is eliminated: positions count from their mean. Along directions that the readings leave open, the point stays
//! where it is stated.

use abbe_model::chain::Machine;
use abbe_model::instrument::{Group, InstrumentKind, SharedBy, Station, Target};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use nalgebra::{Matrix3, Vector3};

use super::{MAX_ROWS, is_unknown, set_point};
use crate::numerics::median;
use crate::set_up_points::points;

/// Maximum number of alternations, and the step at which they end, mm.
const MAX_ROUNDS: usize = 200;
const SETTLED_MM: f64 = 1e-4;
/// The side of the tool among the points of a set-up.
const TOOL: usize = 1;
/// A position is a gross error if its residual is this many times the median, and so many mm.
const GROSS: f64 = 10.0;
const MIN_GROSS_MM: f64 = 1.0;
/// Residual, as a share of the scatter of the positions, from which a target may be the mirror image of the right one.
const MIRRORED: f64 = 0.01;
/// Singular values below this share of the number of positions leave their direction as it is stated.
const OPEN: f64 = 1e-9;

/// Moves the targets and balls without a prior to where the nominal machine explains the readings best.
pub(super) fn locate(session: &Session, tests: &mut [Test]) {
    let is_open = |test: &Test| test.readings.is_some() && is_free(test);
    let mut groups: Vec<(InstrumentKind, String)> = Vec::new();
    for test in tests.iter().filter(|test| is_open(test)) {
        let group = (test.station.kind(), test.group(SharedBy::SpindleSetup).to_string());
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    for (kind, name) in groups {
        let is_member = |test: &Test| test.station.kind() == kind && test.group(SharedBy::SpindleSetup) == name;
        let members: Vec<Member> = tests
            .iter()
            .filter(|test| is_open(test) && is_member(test))
            .map(|test| Member::new(session, test))
            .collect();
        let Some(target) = target(session, &members) else { continue };
        for test in tests.iter_mut().filter(|test| is_member(test)) {
            set_point(&mut test.station, TOOL, target.into());
        }
    }
}

/// Whether the point of the tool frame of a test is a target or a ball without a prior.
fn is_free(test: &Test) -> bool {
    let kind = test.station.kind();
    matches!(kind, InstrumentKind::Tracker | InstrumentKind::Pose | InstrumentKind::Socket)
        && points(&test.station)[TOOL].is_some_and(|first| is_unknown(test, first))
}

/// The readings of a test: `P_i(t₀)` and the columns of `A_i`, and what was observed.
struct Member {
    /// The tracker or the socket.
    place: String,
    station: Station<f64>,
    readings: Readings,
    origin: Vec<Vector3<f64>>,
    along: Vec<Matrix3<f64>>,
    observed: Vec<Vector3<f64>>,
}

impl Member {
    fn new(session: &Session, test: &Test) -> Member {
        let readings = test.readings.as_deref().cloned().unwrap_or_default();
        let step = readings.rows().div_ceil(MAX_ROWS).max(1);
        let readings = readings.of_rows(&(0..readings.rows()).step_by(step).collect::<Vec<_>>());
        let (readings, observed) = complete(&test.station, &readings);
        let stated = test.station.tool_point();
        let points = |by: Vector3<f64>| {
            let moved = Target { mm: (Vector3::from(stated.mm) + by).into(), ..stated };
            readings.nominal_points(&session.machine, &moved)
        };
        let origin = points(Vector3::zeros());
        let units = [Vector3::x(), Vector3::y(), Vector3::z()].map(points);
        let along =
            (0..origin.len()).map(|i| Matrix3::from_columns(&[0, 1, 2].map(|k| units[k][i] - origin[i]))).collect();
        Member {
            place: test.free_place().unwrap_or_default().to_string(),
            station: test.station.clone(),
            origin,
            along,
            observed,
            readings,
        }
    }

    /// The root mean square distance of the measured positions from their mean, mm.
    fn scatter_mm(&self) -> f64 {
        let share = 1.0 / self.observed.len().max(1) as f64;
        let mean = self.observed.iter().sum::<Vector3<f64>>() * share;
        (self.observed.iter().map(|point| (point - mean).norm_squared()).sum::<f64>() * share).sqrt()
    }
}

/// The rows with all coordinates, and these. A row without one says nothing of the point. Of an instrument that measures no
/// position, all rows.
fn complete(station: &Station<f64>, readings: &Readings) -> (Readings, Vec<Vector3<f64>>) {
    let measured = |row: usize| station.measured_mm(&readings.observed[row * readings.channels..][..readings.channels]);
    let is_complete = |row: &usize| measured(*row).is_none_or(|point| point.iter().all(|x| x.is_finite()));
    let rows: Vec<usize> = (0..readings.rows()).filter(is_complete).collect();
    let points = rows.iter().filter_map(|row| measured(*row)).collect();
    (readings.of_rows(&rows), points)
}

/// The point that all members share.
fn target(session: &Session, members: &[Member]) -> Option<Vector3<f64>> {
    let first = &members.first()?.station;
    let stated = Vector3::from(first.tool_point().mm);
    if first.kind() == InstrumentKind::Socket {
        return linear(members, &vec![None; members.len()], Vector3::zeros()).map(|(step, _)| stated + step);
    }
    let best = |starts: &[Vector3<f64>]| {
        let found = starts.iter().filter_map(|start| alternated(&session.machine, members, start - stated));
        found.min_by(|a, b| a.1.total_cmp(&b.1))
    };
    // Where it is stated, and at the end of the chain.
    let end = session.machine.axes.last().map_or(stated, |axis| axis.origin_mm.into());
    let mut found = best(&[stated, end]);
    let scatter = members.iter().map(Member::scatter_mm).fold(0.0, f64::max);
    if found.is_none_or(|(_, squares)| squares > (MIRRORED * scatter).powi(2)) {
        // Few axes see a target and its mirror image nearly alike: from the other side the alternation ends elsewhere.
        let beside = [Vector3::x(), Vector3::y(), Vector3::z()].map(|unit| unit * scatter);
        let sides = beside.iter().flat_map(|beside| [end + beside, end - beside]).collect::<Vec<_>>();
        found = best(&sides).into_iter().chain(found).min_by(|a, b| a.1.total_cmp(&b.1));
    }
    found.map(|(step, _)| stated + step)
}

/// The target less the stated one with the median of squared residuals that it leaves, from a start.
fn alternated(machine: &Machine, members: &[Member], start: Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
    let (mut step, mut left) = (start, f64::INFINITY);
    for _ in 0..MAX_ROUNDS {
        let turned: Vec<Option<Matrix3<f64>>> =
            members.iter().map(|member| orientation(machine, members, &member.place, step)).collect();
        let (next, squares) = linear(members, &turned, step)?;
        let change = (next - step).norm();
        (step, left) = (next, squares);
        if change < SETTLED_MM {
            break;
        }
    }
    left.is_finite().then_some((step, left))
}

/// The orientation of an instrument for a target.
fn orientation(machine: &Machine, members: &[Member], place: &str, step: Vector3<f64>) -> Option<Matrix3<f64>> {
    let own: Vec<(Station<f64>, &Readings)> = (members.iter())
        .filter(|member| member.place == place)
        .map(|member| {
            let mut station = member.station.clone();
            let target = Vector3::from(station.tool_point().mm) + step;
            set_point(&mut station, TOOL, target.into());
            (station, &member.readings)
        })
        .collect();
    let group = Group { machine, tests: own.iter().map(|(station, readings)| (station, *readings)).collect() };
    let stand = match own.first()?.0.placed(&group)? {
        Station::Tracker(tracker) => tracker.stand,
        Station::Pose(pose) => pose.stand,
        _ => return None,
    };
    Some(Matrix3::from_fn(|i, j| stand.rotation[i][j]))
}

/// The target less the stated one for given orientations, by least squares, without the gross errors at `before`; and the
/// median of the squared residuals there.
fn linear(members: &[Member], turned: &[Option<Matrix3<f64>>], before: Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
    let mut places: Vec<&str> = members.iter().map(|member| member.place.as_str()).collect();
    places.sort_unstable();
    places.dedup();
    let (mut normal, mut right, mut squares) = (Matrix3::zeros(), Vector3::zeros(), Vec::new());
    for place in places {
        // R·(P + A·t) + p = m before an instrument, P + A·t = s in a socket.
        let mut rows: Vec<(Matrix3<f64>, Vector3<f64>)> = Vec::new();
        for (member, turned) in members.iter().zip(turned).filter(|(member, _)| member.place == place) {
            let turn = turned.unwrap_or_else(Matrix3::identity);
            for (i, (origin, along)) in member.origin.iter().zip(&member.along).enumerate() {
                let observed = if turned.is_some() { *member.observed.get(i)? } else { Vector3::zeros() };
                rows.push((turn * along, observed - turn * origin));
            }
        }
        let apart = |rows: &[(Matrix3<f64>, Vector3<f64>)]| -> Vec<f64> {
            let left: Vec<Vector3<f64>> = rows.iter().map(|(matrix, rest)| rest - matrix * before).collect();
            let middle = Vector3::from_fn(|k, _| median(&mut left.iter().map(|v| v[k]).collect::<Vec<_>>()));
            left.iter().map(|left| (left - middle).norm()).collect()
        };
        let distances = apart(&rows);
        squares.extend(distances.iter().map(|distance| distance * distance));
        let limit = (GROSS * median(&mut distances.clone())).max(MIN_GROSS_MM);
        let kept: Vec<_> =
            rows.iter().zip(&distances).filter(|(_, distance)| **distance <= limit).map(|(row, _)| row).collect();
        let share = 1.0 / kept.len().max(1) as f64;
        let mean_matrix = kept.iter().map(|(matrix, _)| matrix).sum::<Matrix3<f64>>() * share;
        let mean_rest = kept.iter().map(|(_, rest)| rest).sum::<Vector3<f64>>() * share;
        for (matrix, rest) in kept {
            let (matrix, rest) = (matrix - mean_matrix, rest - mean_rest);
            normal += matrix.transpose() * matrix;
            right += matrix.transpose() * rest;
        }
    }
    let svd = normal.svd(true, true);
    // Rotations that differ have singular values of the number of positions.
    let step = svd.solve(&right, OPEN * squares.len() as f64).ok()?;
    Some((step, median(&mut squares)))
}
