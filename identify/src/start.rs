//! Start values without user input: poses of instruments that stand beside the machine, orientations of bodies at the
//! tool, positions of sockets, stations, targets and balls. The numbers that a session states for what it does not know
//! have no influence, except along directions that its readings leave open.
//!
//! In this order: targets from positions (`target`), stations from distances (`distance`), poses of instruments and bodies in
//! closed form, and the points that are left by a fit of the set-up alone to the nominal machine.

mod distance;
mod target;

use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::instrument::{Group, InstrumentKind, SharedBy, Station};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Prior, Session, Test};
use nalgebra::Vector3;

use crate::error;
use crate::fit::minimum;
use crate::noise::Noise;
use crate::problem::Problem;
use crate::set_up_points::{point_mm, points};

/// Readings of a test that are used.
const MAX_ROWS: usize = 300;
/// A set-up that is as near to the stated one needs no other start: the iterations converge, and at the stated geometry its
/// exact dependencies are simpler.
const NEAR_MM: f64 = 1.0;

impl Problem {
    /// The problem of a session with its declared parameters and effects.
    ///
    /// # Errors
    /// If there are no readings, or an effect cannot be evaluated.
    pub fn new(session: &Session, noise: Noise, seed: u64) -> Result<Problem, Diagnostic> {
        let tests: Vec<Test> = session.tests.iter().filter(|test| test.readings.is_some()).cloned().collect();
        if tests.is_empty() {
            return Err(error::no_readings());
        }
        let (tests, stations) = located(session, tests, &noise);
        Problem::at(session, tests, stations, noise, seed)
    }
}

/// Tests with readings, with the points found that have no prior, and their stations, with the poses found that are free.
fn located(session: &Session, stated: Vec<Test>, noise: &Noise) -> (Vec<Test>, Vec<Station<f64>>) {
    if !stated.iter().all(is_read) {
        let stations = stations(session, &stated);
        return (stated, stations);
    }
    let mut tests = stated.clone();
    target::locate(session, &mut tests);
    distance::locate(session, &mut tests);
    let stations = stations(session, &tests);
    let is_left = |test: &Test| test.station.kind().is_two_sided() && free_points(test).next().is_some();
    if tests.iter().any(is_left)
        && let Some(found) = set_up_alone(session, &tests, &stations, noise)
    {
        let found = if are_near(&found, &stated) { stated } else { found };
        let stations = self::stations(session, &found);
        return (found, stations);
    }
    (tests, stations)
}

/// Whether anything was observed. The readings of a plan are zero: they say nothing of where a set-up is. A socket has none.
fn is_read(test: &Test) -> bool {
    let is_observed = |readings: &Arc<Readings>| readings.observed.iter().any(|value| *value != 0.0);
    !test.station.kind().entry().has_readings || test.readings.as_ref().is_some_and(is_observed)
}

/// The session with the targets, balls and stations found that have no prior. Others stay.
pub fn with_targets(session: &Session) -> Session {
    let mut found = session.clone();
    target::locate(session, &mut found.tests);
    distance::locate(session, &mut found.tests);
    found
}

/// The points of a test that have no prior: whether of the tool, and the index of the first parameter.
fn free_points(test: &Test) -> impl Iterator<Item = (usize, usize)> {
    let unknown = |parameter: &usize| test.priors.get(*parameter) == Some(&Prior::Free);
    points(&test.station).into_iter().enumerate().filter_map(move |(side, first)| {
        first.filter(|first| (*first..first + 3).any(|parameter| unknown(&parameter))).map(|first| (side, first))
    })
}

/// Whether the point of the tool frame of a test has no prior at all.
fn is_unknown(test: &Test, first: usize) -> bool {
    (first..first + 3).all(|parameter| test.priors.get(parameter) == Some(&Prior::Free))
}

/// Moves a point of the set-up to other coordinates, mm.
fn set_point(station: &mut Station<f64>, side: usize, to: [f64; 3]) {
    if let Some(point) = &mut station.points_mut()[side] {
        point.mm = to;
    }
}

/// Whether no point is far from where it is stated.
fn are_near(found: &[Test], stated: &[Test]) -> bool {
    found.iter().zip(stated).flat_map(|(found, stated)| [0, 1].map(|side| (found, stated, side))).all(
        |(found, stated, side)| {
            let places = point_mm(&found.station, side).zip(point_mm(&stated.station, side));
            places.is_none_or(|(found, stated)| (Vector3::from(found) - Vector3::from(stated)).norm() <= NEAR_MM)
        },
    )
}

/// The tests with their free points where a fit of the set-up alone to the nominal machine finds them. `None` where it
/// finds nothing better.
fn set_up_alone(session: &Session, tests: &[Test], stations: &[Station<f64>], noise: &Noise) -> Option<Vec<Test>> {
    let alone = Session { unknowns: Vec::new(), effects: Vec::new(), ..session.clone() };
    let problem = Problem::at(&alone, tests.to_vec(), stations.to_vec(), noise.clone(), 1).ok()?;
    let found = minimum(&problem, None).ok()?;
    let list = &problem.parameters.list;
    if problem.sum_of_squares(&found.beta) >= problem.sum_of_squares(&vec![0.0; list.len()]) {
        return None;
    }
    let mut moved = tests.to_vec();
    for (position, test) in moved.iter_mut().enumerate() {
        let slots = session.machine.error_slots();
        for (side, first) in free_points(test).collect::<Vec<_>>() {
            let Some(mut point) = point_mm(&test.station, side) else { continue };
            for contribution in &problem.parameters.contributions[position] {
                let coordinate = contribution.slot.checked_sub(slots + first).filter(|coordinate| *coordinate < 3);
                if let Some(coordinate) = coordinate.filter(|_| list[contribution.parameter].prior == Prior::Free) {
                    point[coordinate] += found.beta[contribution.parameter];
                }
            }
            set_point(&mut test.station, side, point);
        }
    }
    Some(moved)
}

/// The stations of the tests, with start values for free poses and sockets from which the iterations converge.
pub fn stations(session: &Session, tests: &[Test]) -> Vec<Station<f64>> {
    let mut stations: Vec<Station<f64>> = tests.iter().map(|test| test.station.clone()).collect();
    for (station, test) in stations.iter_mut().zip(tests) {
        // Tests of one set-up count from one point: that of the first of them.
        let first = tests.iter().find(|first| first.station.kind() == test.station.kind() && first.setup == test.setup);
        if let Some(readings) = first.and_then(|first| first.readings.as_deref()) {
            let first = first.map_or(&test.station, |first| &first.station);
            if let Some(counted) = first.with_datum(&session.machine, readings) {
                *station = station.counted_as(&counted);
            }
        }
    }
    // The objects of a place that no session knows first, then those at the tool that refer to them.
    let place = |test: &Test| Some((test.station.kind(), test.free_place()?.to_string()));
    found_from_readings(session, tests, &mut stations, place, |station, group| station.placed(group));
    let mount = |test: &Test| Some((test.station.kind(), test.group(SharedBy::SpindleSetup).to_string()));
    found_from_readings(session, tests, &mut stations, mount, |station, group| station.mounted(group));
    stations
}

/// Replaces the stations of each group of tests by those that agree best with the readings of the group.
fn found_from_readings(
    session: &Session,
    tests: &[Test],
    stations: &mut [Station<f64>],
    group: impl Fn(&Test) -> Option<(InstrumentKind, String)>,
    found: impl Fn(&Station<f64>, &Group<'_>) -> Option<Station<f64>>,
) {
    let groups: Vec<_> = tests.iter().map(group).collect();
    for index in 0..tests.len() {
        if groups[index].is_none() || groups[..index].contains(&groups[index]) {
            continue;
        }
        let members: Vec<usize> = (0..tests.len()).filter(|other| groups[*other] == groups[index]).collect();
        let read = |member: &usize| Some((&stations[*member], tests[*member].readings.as_deref()?));
        let group = Group { machine: &session.machine, tests: members.iter().filter_map(read).collect() };
        let changed: Vec<_> = members.iter().map(|member| found(&stations[*member], &group)).collect();
        for (member, station) in members.into_iter().zip(changed) {
            if let Some(station) = station {
                stations[member] = station;
            }
        }
    }
}
