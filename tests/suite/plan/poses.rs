//! `abbe poses`: poses of the UR10 against random sets, the predicted uncertainty against simulation, limits.

use abbe::files::{self, ReadOptions};
use abbe::identify::fit;
use abbe::model::component::ErrorName;
use abbe::model::session::Session;
use abbe::model::session::readings::Readings;
use abbe::plan::design::Goal;
use abbe::plan::poses::candidates::{LineOfSight, PoseLimits};
use abbe::plan::poses::{PoseOptions, PoseSelection, select};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use serde_json::Value;

use crate::suite::{abbe, ready, text};

const NOISE_MM: f64 = 0.05;

fn ur10() -> Session {
    let reading = ReadOptions { read_data: false, ..ReadOptions::default() };
    files::session(&ready("ur10/session.toml"), &reading).unwrap()
}

fn options(goal: Goal) -> PoseOptions {
    PoseOptions {
        poses: 30,
        goal,
        candidates: 1000,
        seed: 1,
        limits: PoseLimits {
            box_mm: Some([[-900.0, 900.0], [-900.0, 900.0], [100.0, 1300.0]]),
            ..PoseLimits::default()
        },
        noise_mm: Some(NOISE_MM),
    }
}

fn poses(session: &Session, options: &PoseOptions) -> PoseSelection {
    select(session, &[&session.tests[0]], options).unwrap()
}

#[test]
fn chosen_poses_beat_random_ones_in_every_criterion() {
    let session = ur10();
    for (criterion, share) in [(Goal::WorstUncertainty, 0.6), (Goal::A, 0.8), (Goal::D, 0.9)] {
        let found = poses(&session, &options(criterion));
        println!("{}: {:.3}, random {:.3}", found.criterion, found.value, found.random_median);
        assert!(
            found.value < share * found.random_median,
            "{}: {} of {}",
            found.criterion,
            found.value,
            found.random_median
        );
        assert_eq!(found.poses.len(), 30);
        let mut distinct = found.poses.clone();
        distinct.sort_by(|a, b| a.partial_cmp(b).unwrap());
        distinct.dedup();
        assert_eq!(distinct.len(), 30);
    }
}

/// The scatter of fits of simulated readings at the chosen poses is the predicted uncertainty, within its sampling
/// error of `u/√(2·(draws − 1))`.
#[test]
fn predicted_uncertainties_are_those_of_simulated_readings() {
    const DRAWS: usize = 200;
    let mut session = ur10();
    let found = poses(&session, &options(Goal::WorstUncertainty));
    // What no pose separates is not estimated, as the prediction assumes.
    session.unknowns.retain(|name: &ErrorName| found.uncertainties.iter().any(|error| error.id == name.to_string()));
    session.noise_mm = Some(NOISE_MM);
    let positions: Vec<Vec<f64>> = (0..session.machine.axes.len())
        .map(|axis| found.poses.iter().map(|pose| pose[axis].to_radians()).collect())
        .collect();
    let nominal: Vec<f64> = {
        use abbe::model::chain::{AxisPosition, BodyErrors, Frame};
        use abbe::model::frames::Point;
        let machine = &session.machine;
        let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
        let of = |row: usize| {
            let state: Vec<_> =
                machine.axes.iter().zip(&positions).map(|(axis, q)| AxisPosition::new(axis.kind, q[row])).collect();
            machine.in_r::<f64>(Frame::Tool, &state, &none, Point(session.tests[0].station.tool_point().mm)).0
        };
        (0..found.poses.len()).flat_map(of).collect()
    };
    let mut random = Pcg64::seed_from_u64(7);
    let mut squares = vec![0.0; found.uncertainties.len()];
    for _ in 0..DRAWS {
        let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
        let observed = nominal.iter().map(|mm| mm + NOISE_MM * noise()).collect();
        let readings = Readings { positions: positions.clone(), channels: 3, observed, ..Readings::default() };
        let (problem, fitted) = fit::prepare(&session.clone().with_readings([readings]), 1).unwrap();
        let parameters = fit::parameters(&problem, &fitted);
        for (square, error) in squares.iter_mut().zip(&found.uncertainties) {
            let value = parameters.iter().find(|parameter| parameter.id == error.id).unwrap().value;
            *square += value * value;
        }
    }
    let sampling = 1.0 / (2.0 * DRAWS as f64).sqrt();
    let ratios: Vec<f64> = squares
        .iter()
        .zip(&found.uncertainties)
        .map(|(square, error)| (square / DRAWS as f64).sqrt() / error.u)
        .collect();
    println!("scatter over predicted u: {ratios:.3?}, sampling error {sampling:.3}");
    for (ratio, error) in ratios.iter().zip(&found.uncertainties) {
        assert!((ratio - 1.0).abs() < 4.0 * sampling, "{}: {ratio}", error.id);
    }
}

/// Limits hold: joints within their travel, the target in the box, the sight clear.
#[test]
fn poses_are_within_their_limits() {
    let session = ur10();
    let sight = LineOfSight { from_mm: [3000.0, 0.0, 800.0], clearance_mm: 150.0 };
    let limits = PoseLimits { sight: Some(sight), ..options(Goal::A).limits };
    let seen = poses(&session, &PoseOptions { limits, candidates: 200, ..options(Goal::A) });
    let unseen = poses(&session, &PoseOptions { candidates: 200, ..options(Goal::A) });
    assert!(seen.excluded > unseen.excluded, "{} and {}", seen.excluded, unseen.excluded);
    assert!(seen.poses.iter().flatten().all(|q| q.abs() <= 360.0));
}

#[test]
fn the_command_writes_poses_and_refuses_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let [csv, json] = ["poses.csv", "poses.json"].map(|name| folder.path().join(name));
    let ur10 = ready("ur10/session.toml");
    let few = ["--poses", "12", "--candidates", "100", "--criterion", "d", "--noise-um", "50"];
    let asked = ["poses", text(&ur10), "--out", text(&csv), "--json", text(&json)];
    let run = abbe(&[&asked[..], &few].concat());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let written = std::fs::read_to_string(&csv).unwrap();
    assert_eq!(written.lines().next(), Some("j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg"));
    assert_eq!(written.lines().count(), 13);
    let found: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert_eq!(found["poses"].as_array().unwrap().len(), 12);
    for (session, options, expected) in [
        ("ur10/session.toml", &["--poses", "0"][..], "a number from 1 to 1000 is expected"),
        ("ur10/session.toml", &["--poses", "5", "--box-mm=1,0,0,1,0,1"], "six numbers are expected"),
        ("ur10/session.toml", &["--poses", "5", "--box-mm=9000,9001,0,1,0,1", "--candidates", "5"], "widen the limits"),
        ("ur10/session.toml", &["--poses", "5", "--test", "Q"], "the session has no such test; its tests are A"),
        ("kuka-iiwa14/session.toml", &["--poses", "5", "--candidates", "100"], "the readings of 5 poses have rank"),
        ("kuka-iiwa14/session.toml", &["--poses", "5", "--height-mm", "0,1"], "this session's instrument is a socket"),
        ("self-calibration/session.toml", &["--poses", "5", "--height-mm", "1,0"], "two numbers are expected"),
    ] {
        let run = abbe(&[&["poses", text(&ready(session))][..], options].concat());
        let message = String::from_utf8_lossy(&run.stderr).replace('\n', " ");
        assert_eq!(run.status.code(), Some(1), "{message}");
        assert!(message.contains(expected), "{expected}: {message}");
    }
}

/// One pose gives three readings: no rank beyond three. Thirty poses give full rank. The noise and its source are stated,
/// and an assumed one causes a warning.
#[test]
fn rank_and_noise_are_stated() {
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("poses.json");
    let ur10 = ready("ur10/session.toml");
    let run = |more: &[&str]| {
        let output = abbe(&[&["poses", text(&ur10), "--candidates", "300", "--json", text(&json)][..], more].concat());
        let message = String::from_utf8_lossy(&output.stderr).replace('\n', " ");
        (output.status.code(), message, String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let (code, message, _) = run(&["--poses", "1"]);
    assert_eq!(code, Some(1), "{message}");
    assert!(message.contains("the readings of 1 pose have rank 3 in"), "{message}");
    let (code, message, shown) = run(&["--poses", "30"]);
    assert_eq!(code, Some(0), "{message}");
    assert!(message.contains("the session states no `noise_um`: 1.00 µm is assumed"), "{message}");
    assert!(shown.contains("noise 1.000 µm (assumed)"), "{shown}");
    let found: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert_eq!((&found["noise_um"], &found["noise_source"]), (&1.0.into(), &"assumed".into()));
    assert_eq!(found["warnings"].as_array().unwrap().len(), 1, "{found}");
    assert!(found["value"].as_f64().is_some_and(|value| value > 0.0 && value < 100.0), "{found}");
    let (code, message, shown) = run(&["--poses", "30", "--noise-um", "50"]);
    assert_eq!(code, Some(0), "{message}");
    assert!(!message.contains("noise_um"), "{message}");
    assert!(shown.contains("noise 50.000 µm (stated)"), "{shown}");
}
