//! Sessions on data that others measured or simulated; skipped by name where the data are not at hand.

use std::path::{Path, PathBuf};

use abbe_model::chain::BodyErrors;
use abbe_model::session::read::{self, ReadOptions};
use abbe_model::session::{Prior, Session};

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The folder of public data: `ABBE_DATA`, else the one that may lie beside the workspace.
fn data() -> PathBuf {
    match std::env::var_os("ABBE_DATA") {
        Some(folder) => PathBuf::from(folder),
        None => workspace().join("../shared/data"),
    }
}

/// A folder or file that has to be there for a test, else the test says that it is skipped.
fn at_hand(test: &str, path: PathBuf) -> Option<PathBuf> {
    if path.exists() {
        return Some(path);
    }
    assert!(
        std::env::var_os("ABBE_DATA").is_none(),
        "ABBE_DATA is set and {} is not there",
        path.display()
    );
    eprintln!("skipped: {test} ({} is not there)", path.display());
    None
}

fn ready(name: &str) -> Session {
    let options = ReadOptions {
        data_directory: Some(data()),
        ..ReadOptions::default()
    };
    read::session(&workspace().join("sessions").join(name), &options).unwrap()
}

#[test]
fn the_samples_of_an_independent_simulator_read() {
    let Some(samples) = at_hand("samples", data().join("../sample")) else {
        return;
    };
    let rows = |name: &str| -> (Session, Vec<usize>) {
        let session =
            read::session(&samples.join(name).join("session.toml"), &ReadOptions::default()).unwrap();
        let rows = session
            .tests
            .iter()
            .map(|test| test.readings.as_ref().unwrap().rows())
            .collect();
        (session, rows)
    };
    let (clean, counts) = rows("rotary-clean");
    assert_eq!(counts, [722, 722, 1442, 1442]);
    let unknowns: Vec<String> = clean.unknowns.iter().map(ToString::to_string).collect();
    assert_eq!(
        unknowns,
        ["EY0A", "EZ0A", "EB0A", "EC0A", "EX0C", "EY0C", "EA0C", "EB0C"]
    );
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
    assert_eq!(readings.line[0], 2);

    rows("rotary-axial-h3");
    let (circle, _) = rows("circle-backlash-y");
    assert!(circle.unknowns.is_empty());
    assert_eq!(circle.tests.len(), 2);
}

#[test]
fn the_ur10_session_reads() {
    if at_hand("UR10", data().join("landgraf_ur10")).is_none() {
        return;
    }
    let session = ready("ur10/session.toml");
    assert_eq!(session.unknowns.len(), 36);
    let readings = session.tests[0].readings.as_ref().unwrap();
    assert_eq!(readings.rows(), 11911);
    assert_eq!(readings.coordinates, 3);
    assert_eq!(readings.observed[..3], [2361.9831, -1368.5474, 119.39713]);
    assert_eq!(readings.positions[1][1], -2.08493);
    assert!(session.tests[0].priors.iter().all(|prior| *prior == Prior::Free));
}

#[test]
fn the_kuka_session_reads_and_its_sockets_nearly_close() {
    if at_hand("KUKA", data().join("mukca")).is_none() {
        return;
    }
    let session = ready("kuka-iiwa14/session.toml");
    assert_eq!(session.unknowns.len(), 42);
    assert_eq!(session.socket_distances.len(), 3);
    let poses: usize = session
        .tests
        .iter()
        .map(|test| test.readings.as_ref().unwrap().rows())
        .sum();
    assert_eq!(poses, 180);
    let none = vec![BodyErrors::<f64>::NONE; session.machine.axes.len()];
    let mut squares = 0.0;
    for test in &session.tests {
        let readings = test.readings.as_ref().unwrap();
        let mut state = Vec::new();
        let points: Vec<[f64; 3]> = (0..readings.rows())
            .map(|row| {
                readings.state(&session.machine, row, &mut state);
                let reading = test
                    .station
                    .read::<f64>(&session.machine, &state, &none, |_| None);
                [0, 1, 2].map(|i| reading.coordinates()[i])
            })
            .collect();
        for i in 0..3 {
            let mean = points.iter().map(|point| point[i]).sum::<f64>() / points.len() as f64;
            squares += points.iter().map(|point| (point[i] - mean).powi(2)).sum::<f64>();
        }
    }
    let rms_mm = (squares / 180.0).sqrt();
    assert!(
        rms_mm < 0.6,
        "the ball strays by {rms_mm:.3} mm about its sockets"
    );
}
