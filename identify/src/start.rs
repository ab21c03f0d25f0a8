//! Start values without user input: poses of instruments that stand beside the machine, orientations of bodies at the
//! tool, positions of sockets, targets and balls.

mod target;

use abbe_model::instrument::{Group, InstrumentKind, SharedBy, Station};
use abbe_model::session::{Session, Test};

pub use target::with_targets;

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
