//! The ready sessions of laser, diagonals, angle, distance, pose and tracker: their data are those of the plant, and a fit finds the
//! errors from which they were made. `ABBE_UPDATE_PAGES=1` writes the data.

use std::path::{Path, PathBuf};

use super::diagonals::{Box3, HIGH, LOW, body};
use super::scatter::{OF_LEVEL, SQUARENESS, STATIONS, distance_data, level_data};
use super::stands::{polar_data, pose_data};
use super::*;
use crate::suite::abbe;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("sessions").join(name)
}

/// The data of a ready session, written if asked for.
fn assert_data(session: &str, name: &str, text: &str) {
    let file = folder(session).join(name);
    if std::env::var_os("ABBE_UPDATE_PAGES").is_some() {
        std::fs::write(&file, text).unwrap();
    }
    assert!(std::fs::read_to_string(&file).unwrap() == text, "{} is not that of the plant", file.display());
}

/// A fit of a ready session finds these values.
fn assert_found(session: &str, file: &str, truth: &[(&'static str, f64)]) {
    let session = files::session(&folder(session).join(file), &ReadOptions::default()).unwrap();
    assert!(session.warnings.is_empty(), "{:?}", session.warnings);
    for ((id, _), pull) in truth.iter().zip(pulls(&session, truth)) {
        println!("{file} {id}: {pull:.2}");
        assert!(pull.abs() < 3.0, "{id}: {pull}");
    }
}

#[test]
fn the_ready_session_of_a_laser_is_that_of_the_plant() {
    let carriage = Carriage { pitch_arcsec: [6.0, -4.0], position_um: [5.0, 3.0], straightness_um: 2.5 };
    let data = laser_data(&carriage, [0.0, 0.0, -120.0], &mut Pcg64::seed_from_u64(1));
    assert_data("laser", "LX.csv", &data);
    assert_found("laser", "session.toml", &carriage.truth());
}

#[test]
fn the_ready_session_of_angles_is_that_of_the_plant() {
    let mut random = Pcg64::seed_from_u64(2);
    let truth = [5.0, -3.0, 4.0, 2.0];
    assert_data("angle", "level.csv", &level_data(&truth, &mut random));
    // A positioning error of the table C with one wave a turn: 4″ with its cosine, −2″ with its sine. The tool turns back
    // against the table.
    let chain = Chain::from_code("wCbXYZt");
    let zero = uniform(&mut random, 20.0);
    let mut data = String::from("run,c_deg,angle_arcsec\n");
    for run in 1..=4 {
        for step in 0..=36 {
            let degrees = f64::from(10 * if run % 2 == 1 { step } else { 36 - step });
            let (sin, cos) = degrees.to_radians().sin_cos();
            let motion = [0.0, 0.0, 0.0, 0.0, 0.0, (4.0 * cos - 2.0 * sin) * ARCSECOND];
            let position = |letter| if letter == 'C' { degrees.to_radians() } else { 0.0 };
            let errors = |letter| if letter == 'C' { [[0.0; 6], motion] } else { [[0.0; 6]; 2] };
            let angle = State::of(&chain, &position, &errors).rotation(Body::Relative).z / ARCSECOND;
            data += &format!("{run},{degrees},{:.6}\n", angle + zero + 0.2 * normal(&mut random));
        }
    }
    assert_data("angle", "polygon.csv", &data);
    let mut all: Vec<(&'static str, f64)> = OF_LEVEL.iter().copied().zip(truth).collect();
    // 4 cos C − 2 sin C = √20 cos(C + φ) with tan φ = 1/2.
    all.extend([("ECC~C:h1.amplitude", 20.0_f64.sqrt()), ("ECC~C:h1.phase", 0.5_f64.atan().to_degrees())]);
    assert_found("angle", "session.toml", &all);
}

#[test]
fn the_ready_session_of_distances_is_that_of_the_plant() {
    let mut random = Pcg64::seed_from_u64(3);
    let truth = [8.0, -12.0, 5.0];
    for (number, stated) in STATIONS.into_iter().enumerate() {
        assert_data("distance", &format!("S{}.csv", number + 1), &distance_data(stated, &truth, &mut random));
    }
    let truth: Vec<(&'static str, f64)> = SQUARENESS.iter().copied().zip(truth).collect();
    assert_found("distance", "session.toml", &truth);
}

#[test]
fn the_ready_sessions_of_poses_are_those_of_the_plant() {
    let (data, truth) = pose_data(true, &mut Pcg64::seed_from_u64(4));
    assert_data("pose", "body.csv", &data);
    assert_found("pose", "session.toml", &truth);
    let (data, truth) = polar_data(&mut Pcg64::seed_from_u64(5));
    assert_data("pose", "target.csv", &data);
    assert_found("pose", "tracker.toml", &truth);
}

/// The ready session: laser along X, Y and Z, and along four body diagonals.
#[test]
fn the_ready_session_of_diagonals_is_that_of_the_plant() {
    let mut random = Pcg64::seed_from_u64(10);
    let arcsec = [6.0, -9.0, 4.0];
    let machine = Box3 {
        scale: [12e-6, -8e-6, 20e-6],
        squareness: arcsec.map(|arcsec: f64| arcsec * ARCSECOND),
        backlash: 1.2e-3,
    };
    let axis = |k: usize| {
        let [mut from, mut to] = [[0.0; 3]; 2];
        (from[k], to[k]) = (LOW[k], HIGH[k]);
        [from, to]
    };
    let lines = [("X", axis(0)), ("Y", axis(1)), ("Z", axis(2))].into_iter();
    for (name, ends) in lines.chain(["PPP", "NPP", "PNP", "PPN"].map(|name| (name, body(name)))) {
        assert_data("diagonals", &format!("{name}.csv"), &machine.data(ends, false, 5, 1e-4, &mut random));
    }
    let mut truth: Vec<(&'static str, f64)> = SQUARENESS.iter().copied().zip(arcsec).collect();
    truth.extend([("EXX~X:power1", 12.0), ("EYY~Y:power1", -8.0), ("EZZ~Z:power1", 20.0), ("EXX~X:backlash", -1.2)]);
    assert_found("diagonals", "session.toml", &truth);
}

/// The ready plans determine each error to less than the smallest of the ready sessions, and give readings of which a fit identifies all
/// parameters.
#[test]
fn the_ready_plans_determine_all_their_errors() {
    for (name, errors) in [("angle", 6), ("diagonals", 6), ("distance", 3), ("pose", 5)] {
        let place = tempfile::tempdir().unwrap();
        let at = |file: &str| place.path().join(file).to_str().unwrap().to_string();
        let plan = folder(name).join("plan.toml");
        let of_plan = abbe(&["plan", plan.to_str().unwrap(), "--json", "-"]);
        // The machines state no bodies.
        let printed = String::from_utf8_lossy(&of_plan.stderr);
        assert!(printed.lines().all(|line| line.contains("clearance is not checked")), "{name}: {printed}");
        let of_plan: serde_json::Value = serde_json::from_slice(&of_plan.stdout).unwrap();
        let rows = of_plan["errors"].as_array().unwrap();
        assert_eq!(rows.len(), errors, "{name}");
        assert!(rows.iter().all(|row| row["u"].as_f64().is_some_and(|u| u < 4.0)), "{name}: {rows:?}");
        let simulated = abbe(&["simulate", plan.to_str().unwrap(), "--out", &at("run")]);
        assert!(simulated.status.success(), "{name}: {}", String::from_utf8_lossy(&simulated.stderr));
        let fit = abbe(&["fit", &at("run/session.toml"), "--json", "-"]);
        let fit: serde_json::Value = serde_json::from_slice(&fit.stdout).unwrap();
        assert_eq!(fit["rank"], fit["parameters"].as_array().unwrap().len(), "{name}");
    }
}
