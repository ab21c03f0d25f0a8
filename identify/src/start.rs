//! Start values without user input: poses of trackers, positions of sockets.

use abbe_model::chain::{BodyErrors, Machine};
use abbe_model::frames::Point;
use abbe_model::instrument::Station;
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use nalgebra::Vector3;

use crate::numerics::rigid_motion::rigid_motion;

/// The stations of the tests, with start values for free poses and sockets from which the iterations converge.
pub fn stations(session: &Session, tests: &[Test]) -> Vec<Station<f64>> {
    let mut stations: Vec<Station<f64>> = tests.iter().map(|test| test.station.clone()).collect();
    let groups: Vec<&str> = tests
        .iter()
        .map(|test| match test.station {
            Station::Tracker(_) => test.setup.as_str(),
            Station::Socket(_) => test.socket.as_deref().unwrap_or(""),
            Station::BallBar(_) | Station::Probe(_) | Station::RTest(_) => "",
        })
        .collect();
    for index in 0..tests.len() {
        if groups[..index].contains(&groups[index]) && !stations[index].kind().is_two_sided() {
            continue;
        }
        let members: Vec<usize> = (0..tests.len()).filter(|other| groups[*other] == groups[index]).collect();
        match &stations[index] {
            Station::BallBar(_) | Station::Probe(_) | Station::RTest(_) => {}
            Station::Tracker(_) => {
                let (mut machine_points, mut observed) = (Vec::new(), Vec::new());
                for member in &members {
                    if let Some(readings) = &tests[*member].readings {
                        machine_points.extend(nominal_points(&session.machine, &stations[*member], readings));
                        observed.extend(readings.observed.chunks_exact(3).map(Vector3::from_row_slice));
                    }
                }
                let (rotation, origin) = rigid_motion(&machine_points, &observed);
                for member in members {
                    if let Station::Tracker(tracker) = &mut stations[member] {
                        tracker.rotation = std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)]));
                        tracker.origin = [origin.x, origin.y, origin.z];
                    }
                }
            }
            Station::Socket(_) => {
                let mut points = Vec::new();
                for member in &members {
                    if let Some(readings) = &tests[*member].readings {
                        points.extend(nominal_points(&session.machine, &stations[*member], readings));
                    }
                }
                if points.is_empty() {
                    continue;
                }
                let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
                for member in members {
                    if let Station::Socket(socket) = &mut stations[member] {
                        socket.socket = [mean.x, mean.y, mean.z];
                    }
                }
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
