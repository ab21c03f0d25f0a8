//! Generates sessions of any size: ball-bar tests of a five-axis machine, simulated with some errors.

use std::fmt::Write;
use std::path::Path;

use abbe_files::{ReadOptions, session as read};
use abbe_identify::quantity::Given;
use abbe_identify::simulate::{Simulation, simulate};
use abbe_model::session::Session;

/// The session of chapter 5 with about 3,616 readings and no undeclared effect.
pub fn chapter_5() -> Session {
    let plan = read(&sessions().join("chapter5.toml"), &ReadOptions::default()).expect("the ready session");
    drawn(plan, &["EY0A=35.3um", "EX0C=12um", "EB0A=-5arcsec"])
}

fn sessions() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u")
}

/// A session with readings simulated at given values.
fn drawn(plan: Session, given: &[&str]) -> Session {
    let simulation = Simulation {
        given: given.iter().map(|text| Given::parse(text).expect("NAME=VALUEUNIT")).collect(),
        draw_setups: true,
        seed: 1,
        ..Simulation::default()
    };
    let readings = simulate(&plan, &simulation).expect("a simulation").readings;
    plan.with_readings(readings)
}

/// The tests of chapter 5, each with its own set-up, with about this many readings in total: eight errors, and seven
/// set-up parameters per test.
pub fn ball_bar(count: usize, readings: usize) -> Session {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let machine = sessions().join("machine.toml");
    let machine = machine.canonicalize().expect("the ready machine");
    std::fs::copy(machine, folder.path().join("machine.toml")).expect("a copy");
    let mut text = "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"ballbar\"\nnoise_um = 0.3\n".to_string();
    let square = "sqrt(149.9946^2 - 100^2)";
    let tests = [
        ("A100", "A", -20.0, 70.0, 99.9881, String::new()),
        ("A150", "A", -20.0, 70.0, 149.9946, format!("at = {{ x_mm = \"-{square}\" }}\n")),
        ("C100", "C", 0.0, 360.0, 99.9881, String::new()),
        ("C150", "C", 0.0, 360.0, 149.9946, format!("at = {{ z_mm = \"{square}\" }}\n")),
    ];
    for (number, (kind, axis, from, to, bar, at)) in tests.iter().cycle().take(count).enumerate() {
        let name = format!("{kind}-{number}");
        let step = (to - from) / (readings as f64 / (4 * count) as f64 - 1.0);
        let _ = write!(
            text,
            "[[test]]\nname = \"{name}\"\nbar_mm = {bar}\nworkpiece_ball_mm = [0, 100, 0]\nspindle_ball_mm = [0, 0, 0]\n\
             setup = \"{name}\"\nworkpiece_ball_u_um = [2, 2, 2]\nspindle_ball_u_um = [1, 1, 1]\nbar_u_um = 0.5\n{at}\
             sweep = {{ axis = \"{axis}\", from_deg = {from}, to_deg = {to}, step_deg = {step}, runs = 2, both_directions = true }}\n",
        );
    }
    let file = folder.path().join("session.toml");
    std::fs::write(&file, text).expect("a file in a temporary folder");
    let plan = read(&file, &ReadOptions::default()).expect("a valid session");
    drawn(plan, &["EY0A=35.3um", "EZ0A=-10um", "EX0C=12um", "EY0C=-20um", "EB0A=-5arcsec", "EC0A=8arcsec"])
}
