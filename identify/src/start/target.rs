//! Where a target or a ball is that no one knows: the point of the tool frame with which the nominal machine explains the
//! readings best.
//!
//! The position of a point in R is affine in the point, `P_i(t) = P_i(0) + A_i·t`. A ball in sockets therefore is a linear
//! least-squares problem, and a target before a tracker one for a given orientation of the tracker, which alternates with
//! the orientation for a given target (Kabsch, Acta Cryst. A32 (1976) 922).

use abbe_model::chain::Machine;
use abbe_model::instrument::{Group, InstrumentKind, SharedBy, Station};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Prior, Session, Test};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Readings of a test that are used.
const MAX_ROWS: usize = 300;
/// Maximum number of alternations, and the step at which they end, mm.
const MAX_ROUNDS: usize = 200;
const SETTLED_MM: f64 = 1e-4;

/// The session with the targets and balls found that have no prior. Others stay.
pub fn with_targets(session: &Session) -> Session {
    let mut found = session.clone();
    let is_open = |test: &Test| test.readings.is_some() && is_unknown(test);
    let mut groups: Vec<(InstrumentKind, &str)> = Vec::new();
    for test in session.tests.iter().filter(|test| is_open(test)) {
        let group = (test.station.kind(), test.group(SharedBy::SpindleSetup));
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    for (kind, name) in groups {
        let is_member = |test: &Test| test.station.kind() == kind && test.group(SharedBy::SpindleSetup) == name;
        let members: Vec<Member> = session
            .tests
            .iter()
            .filter(|test| is_open(test) && is_member(test))
            .map(|test| Member::new(session, test))
            .collect();
        let Some(target) = target(session, &members) else { continue };
        for test in found.tests.iter_mut().filter(|test| is_member(test)) {
            set_tool_point(&mut test.station, target);
        }
    }
    found
}

/// Whether the point of the tool frame of a test is a tracker's target or a ball without a prior.
fn is_unknown(test: &Test) -> bool {
    if !matches!(test.station.kind(), InstrumentKind::Tracker | InstrumentKind::Socket) {
        return false;
    }
    let points = test.station.kind().unknowns().iter().zip(&test.priors);
    let mut of_tool = points.filter(|(unknown, _)| matches!(unknown.thing, "target" | "ball")).peekable();
    of_tool.peek().is_some() && of_tool.all(|(_, prior)| *prior == Prior::Free)
}

fn set_tool_point(station: &mut Station<f64>, point: Vector3<f64>) {
    if let [_, Some(own)] = station.points_mut() {
        *own = point.into();
    }
}

/// The readings of a test: `P_i(0)` and the columns of `A_i`, and what was observed.
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
        let points = |at: Vector3<f64>| readings.nominal_points(&session.machine, at.into());
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
    if first.kind() == InstrumentKind::Socket {
        let turned: Vec<Option<Matrix3<f64>>> = vec![None; members.len()];
        return linear(members, &turned).map(|(target, _)| target);
    }
    // At the end of the chain, and where it is stated.
    let end = session.machine.axes.last().map_or([0.0; 3], |axis| axis.origin_mm);
    let starts = [end, first.tool_point_mm()].map(Vector3::from);
    let found = starts.into_iter().filter_map(|start| alternated(&session.machine, members, start));
    found.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(target, _)| target)
}

/// The target with the sum of squares that it leaves, from a start.
fn alternated(machine: &Machine, members: &[Member], start: Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
    let mut target = start;
    let mut left = f64::INFINITY;
    for _ in 0..MAX_ROUNDS {
        let turned: Vec<Option<Matrix3<f64>>> =
            members.iter().map(|member| orientation(machine, members, &member.place, target)).collect();
        let (next, squares) = linear(members, &turned)?;
        let step = (next - target).norm();
        (target, left) = (next, squares);
        if step < SETTLED_MM {
            break;
        }
    }
    left.is_finite().then_some((target, left))
}

/// The orientation of a tracker for a target.
fn orientation(machine: &Machine, members: &[Member], place: &str, target: Vector3<f64>) -> Option<Matrix3<f64>> {
    let own: Vec<(Station<f64>, &Readings)> = (members.iter())
        .filter(|member| member.place == place)
        .map(|member| {
            let mut station = member.station.clone();
            set_tool_point(&mut station, target);
            (station, &member.readings)
        })
        .collect();
    let group = Group { machine, tests: own.iter().map(|(station, readings)| (station, *readings)).collect() };
    match own.first()?.0.placed(&group)? {
        Station::Tracker(tracker) => Some(Matrix3::from_fn(|i, j| tracker.stand.rotation[i][j])),
        _ => None,
    }
}

/// The target and the place of each tracker or socket for given orientations, by least squares; and the sum of squares.
fn linear(members: &[Member], turned: &[Option<Matrix3<f64>>]) -> Option<(Vector3<f64>, f64)> {
    let mut places: Vec<&str> = members.iter().map(|member| member.place.as_str()).collect();
    places.sort_unstable();
    places.dedup();
    let count = 3 + 3 * places.len();
    let (mut normal, mut right, mut squares) = (DMatrix::zeros(count, count), DVector::zeros(count), 0.0);
    for (member, turned) in members.iter().zip(turned) {
        let place = 3 + 3 * places.iter().position(|place| *place == member.place)?;
        let turn = turned.unwrap_or_else(Matrix3::identity);
        for (i, (origin, along)) in member.origin.iter().zip(&member.along).enumerate() {
            // R·(P(0) + A·t) + p = m before a tracker, P(0) + A·t − s = 0 in a socket.
            let (sign, observed) =
                if turned.is_some() { (1.0, *member.observed.get(i)?) } else { (-1.0, Vector3::zeros()) };
            let (matrix, rest) = (turn * along, observed - turn * origin);
            for row in 0..3 {
                let mut line = DVector::zeros(count);
                (0..3).for_each(|k| line[k] = matrix[(row, k)]);
                line[place + row] = sign;
                normal.ger(1.0, &line, &line, 1.0);
                right.axpy(rest[row], &line, 1.0);
                squares += rest[row] * rest[row];
            }
        }
    }
    let solution = normal.svd(true, true).solve(&right, 1e-9).ok()?;
    Some((Vector3::new(solution[0], solution[1], solution[2]), squares - right.dot(&solution)))
}
