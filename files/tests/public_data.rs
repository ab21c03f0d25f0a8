//! Tests on sessions with data that others measured or simulated.

use std::path::{Path, PathBuf};

use abbe_files::ReadOptions;
use abbe_model::chain::{BodyErrors, Frame};
use abbe_model::frames::Point;
use abbe_model::instrument::Station;
use abbe_model::session::{Prior, Session};
use nalgebra::{DMatrix, DVector};
use test_needs::{data, data_folder};

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn ready(name: &str) -> Session {
    let options = ReadOptions { data_directory: Some(data_folder()), ..ReadOptions::default() };
    abbe_files::session(&workspace().join("sessions").join(name), &options).unwrap()
}

#[test]
fn the_samples_of_an_independent_simulator_read() {
    let Some(samples) = data("the_samples_of_an_independent_simulator_read", "../sample") else {
        return;
    };
    let rows = |name: &str| -> (Session, Vec<usize>) {
        let session = abbe_files::session(&samples.join(name).join("session.toml"), &ReadOptions::default()).unwrap();
        let rows = session.tests.iter().map(|test| test.readings.as_ref().unwrap().rows()).collect();
        (session, rows)
    };
    let (clean, counts) = rows("rotary-clean");
    assert_eq!(counts, [722, 722, 1442, 1442]);
    let unknowns: Vec<String> = clean.unknowns.iter().map(ToString::to_string).collect();
    assert_eq!(unknowns, ["EY0A", "EZ0A", "EB0A", "EC0A", "EX0C", "EY0C", "EA0C", "EB0C"]);
    assert_eq!(clean.noise_mm, Some(0.3e-3));
    assert!(clean.warnings.is_empty(), "{:?}", clean.warnings);
    let a100 = &clean.tests[0];
    assert_eq!(a100.setup, "P1");
    assert_eq!(a100.bar_setup, "A100");
    assert_eq!(a100.priors[0], Prior::Gaussian(2e-3));
    assert_eq!(a100.priors[7], Prior::Known);
    let readings = a100.readings.as_ref().unwrap();
    assert_eq!(readings.runs().len(), 2);
    let a = clean.machine.axis_index("A").unwrap();
    assert!((readings.positions[a][0] + 20.0_f64.to_radians()).abs() < 1e-15);
    assert_eq!(readings.observed[0], 99.9610);
    assert_eq!(readings.line(0), Some(2));

    rows("rotary-axial-h3");
    let (circle, _) = rows("circle-backlash-y");
    assert!(circle.unknowns.is_empty());
    assert_eq!(circle.tests.len(), 2);
}

#[test]
fn the_ur10_session_reads() {
    if data("the_ur10_session_reads", "landgraf_ur10").is_none() {
        return;
    }
    let session = ready("ur10/session.toml");
    assert_eq!(session.unknowns.len(), 36);
    let readings = session.tests[0].readings.as_ref().unwrap();
    assert_eq!(readings.rows(), 11911);
    assert_eq!(readings.channels, 3);
    assert_eq!(readings.observed[..3], [2361.9831, -1368.5474, 119.39713]);
    assert_eq!(readings.positions[1][1], -2.08493);
    assert!(session.tests[0].priors.iter().all(|prior| *prior == Prior::Free));
}

#[test]
fn the_kuka_session_reads_and_its_sockets_nearly_close() {
    if data("the_kuka_session_reads_and_its_sockets_nearly_close", "mukca").is_none() {
        return;
    }
    let session = ready("kuka-iiwa14/session.toml");
    assert_eq!(session.unknowns.len(), 42);
    assert_eq!(session.socket_distances.len(), 3);
    let poses: usize = session.tests.iter().map(|test| test.readings.as_ref().unwrap().rows()).sum();
    assert_eq!(poses, 180);
    let (ball, rms_mm) = fitted_ball(&session);
    assert!((rms_mm - 0.55).abs() < 0.01, "with ball and sockets fitted the closure is {rms_mm:.3} mm");
    let Station::Socket(station) = &session.tests[0].station else {
        panic!("the KUKA session is one of sockets");
    };
    let off = (0..3).map(|i| (station.ball.mm[i] - ball[i]).powi(2)).sum::<f64>().sqrt();
    assert!(off < 1.0, "the session's ball {:?} lies {off:.3} mm from {ball:?}", station.ball);
}

/// The ball in the tool frame and the root mean square closure, after a fit of ball and sockets with nominal joints.
fn fitted_ball(session: &Session) -> ([f64; 3], f64) {
    let none = vec![BodyErrors::<f64>::NONE; session.machine.axes.len()];
    let unknowns = 3 + 3 * session.tests.len();
    let (mut rows, mut right) = (Vec::new(), Vec::new());
    for (place, test) in session.tests.iter().enumerate() {
        let readings = test.readings.as_ref().unwrap();
        let mut state = Vec::new();
        for row in 0..readings.rows() {
            readings.state(&session.machine, row, &mut state);
            let ball = |point| session.machine.in_r::<f64>(Frame::Tool, &state, &none, Point(point)).0;
            let origin = ball([0.0; 3]);
            let along = [ball([1.0, 0.0, 0.0]), ball([0.0, 1.0, 0.0]), ball([0.0, 0.0, 1.0])];
            for i in 0..3 {
                let mut equation = vec![0.0; unknowns];
                for j in 0..3 {
                    equation[j] = along[j][i] - origin[i];
                }
                equation[3 + 3 * place + i] = -1.0;
                rows.extend(equation);
                right.push(-origin[i]);
            }
        }
    }
    let matrix = DMatrix::from_row_slice(right.len(), unknowns, &rows);
    let right = DVector::from_vec(right);
    let solution = matrix.clone().svd(true, true).solve(&right, 1e-9).unwrap();
    let poses = right.len() as f64 / 3.0;
    let rms_mm = ((matrix * &solution - right).norm_squared() / poses).sqrt();
    ([0, 1, 2].map(|i| solution[i]), rms_mm)
}
