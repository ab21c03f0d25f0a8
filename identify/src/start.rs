//! Start values without user input: poses of trackers, positions of sockets.

use abbe_model::chain::{BodyErrors, Machine};
use abbe_model::frames::Point;
use abbe_model::instrument::Station;
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use nalgebra::Vector3;

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
    let places: Vec<Option<&str>> = tests.iter().map(|test| test.free_place()).collect();
    for index in 0..tests.len() {
        if places[index].is_none() || places[..index].contains(&places[index]) {
            continue;
        }
        let members: Vec<usize> = (0..tests.len()).filter(|other| places[*other] == places[index]).collect();
        let (mut points, mut observed) = (Vec::new(), Vec::new());
        for member in &members {
            if let Some(readings) = &tests[*member].readings {
                points.extend(nominal_points(&session.machine, &stations[*member], readings));
                observed.extend(readings.observed.chunks_exact(3).map(Vector3::from_row_slice));
            }
        }
        for member in members {
            if let Some(placed) = stations[member].placed(&points, &observed) {
                stations[member] = placed;
            }
        }
    }
    stations
}

/// The nominal position of the instrument's tool-frame point in R, at every row.
pub(crate) fn nominal_points(machine: &Machine, station: &Station<f64>, readings: &Readings) -> Vec<Vector3<f64>> {
    let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
    let mut state = Vec::new();
    (0..readings.rows())
        .map(|row| {
            readings.state(machine, row, &mut state);
            let point = machine.tool_point(&state, &none, Point(station.tool_point_mm()));
            Vector3::from(point.0)
        })
        .collect()
}
