//! The measured session of the README. The plant simulates it, not `abbe simulate`, so trace and simulator share no
//! code.
//!
//! `ABBE_WRITE_SESSIONS=1 cargo test --profile checked measured` writes it again.

use abbe::files::{self, ReadOptions};

use crate::plant::{AxisName, Component, Driver, Freedom, Injected, Kind, Recipe, Shape, SimulatedSession};

const FOLDER: &str = "hermle-c600u/measured";

const ABOUT: &str = "\
# A simulated measured session: the method of Jiang (2014), Chapter 5, with bars of 100 and 150 mm, two runs in both directions, noise of
# 0.3 um. The machine has an effect that this file does not declare; `abbe trace` finds it.

";

/// An axial error motion of C of second order: 1.5 µm · cos(2 C + 60°).
fn axial_motion() -> Injected {
    let shape = Shape::Harmonic { order: 2, phase_deg: 60.0 };
    Injected::new(Component::Motion(Freedom::Z, AxisName::C), Driver::Axis(AxisName::C), shape, 1.5)
}

/// The session with its true values.
fn draw() -> SimulatedSession {
    let mut draw = Recipe::new(Kind::Rotary, 5).with(axial_motion()).readings(2400).draw();
    for (name, text) in &mut draw.files {
        if name == "session.toml" {
            text.insert_str(0, ABOUT);
        }
    }
    draw
}

#[test]
fn the_bundled_session_is_that_of_the_plant() {
    let folder = crate::suite::ready(FOLDER);
    let draw = draw();
    if std::env::var_os("ABBE_WRITE_SESSIONS").is_some() {
        draw.write(&folder).unwrap();
    }
    let mut names: Vec<String> =
        std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let mut expected: Vec<&String> = draw.files.iter().map(|(name, _)| name).collect();
    expected.sort();
    assert_eq!(names.iter().collect::<Vec<_>>(), expected);
    for (name, text) in &draw.files {
        let found = std::fs::read_to_string(folder.join(name)).unwrap();
        // Not `assert_eq!`, which would print two thousand lines.
        assert!(found == *text, "{name} is not what the plant measures");
    }
}

#[test]
fn the_bundled_session_is_valid_and_declares_no_effect() {
    let session = files::session(&crate::suite::ready(FOLDER).join("session.toml"), &ReadOptions::default()).unwrap();
    assert!(session.effects.is_empty() && session.warnings.is_empty());
    let rows: usize = session.tests.iter().map(|test| test.readings.as_ref().unwrap().rows()).sum();
    assert!((1500..3000).contains(&rows), "{rows}");
    assert!(session.tests.iter().all(|test| test.readings.as_ref().unwrap().runs().len() == 4));
}
