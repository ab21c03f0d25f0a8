//! Descriptions of effects: every candidate of the library has one, unique in its session, without identifiers.

use std::collections::{BTreeSet, HashMap};
use std::fmt::Write;

use abbe::files::{ReadOptions, session as read};
use abbe::identify::problem::Problem;
use abbe::model::chain::Machine;
use abbe::model::component::{ErrorKind, Freedom};
use abbe::model::driver::Driver;
use abbe::model::effect::description::{component_meaning, explanations, meaning};
use abbe::model::effect::shape::{Harmonic, Periodic, Power, Steps, Warmup};
use abbe::model::effect::{Component, Effect, Shape};
use abbe::model::session::Session;
use abbe::trace::candidates::library;

use crate::suite::plan::help::{noise_um, ready};
use crate::suite::workspace;

/// A circle of X and Y in both directions on a machine with a table C and a head B, with time and temperature.
fn circle() -> Session {
    let folder = tempfile::tempdir().unwrap();
    let mut table = String::from("time_s,run,x_mm,y_mm,temperature_c,length_mm\n");
    for k in 0..180_u32 {
        let turn = if k < 90 { 4 * k } else { 4 * (179 - k) };
        let (sin, cos) = f64::from(turn).to_radians().sin_cos();
        let temperature = 20.0 + f64::from(k % 7) * 0.1;
        let run = 1 + k / 90;
        let (x, y) = (-100.0 * cos, 100.0 * sin);
        writeln!(table, "{k},{run},{x:.6},{y:.6},{temperature},100.0").unwrap();
    }
    std::fs::write(folder.path().join("circle.csv"), table).unwrap();
    let session = "[machine]\nchain = \"w C X b Y B t\"\n[machine.axis.C]\n[machine.axis.X]\n[machine.axis.Y]\n[machine.axis.B]\n\
        [instrument]\nkind = \"ballbar\"\nnoise_um = 0.3\n[unknowns]\nerrors = [\"EC0Y\"]\n\
        [[test]]\nname = \"XY\"\ndata = \"circle.csv\"\nbar_mm = 100.0\nworkpiece_ball_mm = [0, 0, 0]\nspindle_ball_mm = [0, 0, 0]\n\
        workpiece_ball_u_um = [2, 2, 0]\n";
    read_in(&folder, session)
}

/// A robot of three joints before a tracker, at random poses.
fn robot() -> Session {
    let folder = tempfile::tempdir().unwrap();
    let mut table = String::from("J1_deg,J2_deg,J3_deg,px_mm,py_mm,pz_mm\n");
    for k in 0..60_u32 {
        let angle = |factor: u32| f64::from(k * factor % 61) * 5.0 - 150.0;
        let (j1, j2, j3) = (angle(7), angle(13), angle(29));
        writeln!(table, "{j1},{j2},{j3},500,0,0").unwrap();
    }
    std::fs::write(folder.path().join("poses.csv"), table).unwrap();
    let joint = |name: &str, direction: &str, origin: &str| {
        format!("[machine.axis.{name}]\nkind = \"rotary\"\ndirection = {direction}\norigin_mm = {origin}\n")
    };
    let session = format!(
        "[machine]\nchain = \"w b J1 J2 J3 t\"\n{}{}{}[instrument]\nkind = \"tracker\"\n[unknowns]\nerrors = [\"EX0J2\"]\n\
         [[test]]\nname = \"A\"\ndata = \"poses.csv\"\npath = {{ kind = \"list\" }}\ntarget_mm = [0, 0, 100]\ntarget_u_um = [10, 10, 10]\n",
        joint("J1", "[0, 0, 1]", "[0, 0, 0]"),
        joint("J2", "[0, -1, 0]", "[0, 0, 100]"),
        joint("J3", "[0, -1, 0]", "[400, 0, 100]"),
    );
    read_in(&folder, &session)
}

fn read_in(folder: &tempfile::TempDir, text: &str) -> Session {
    let file = folder.path().join("session.toml");
    std::fs::write(&file, text).unwrap();
    read(&file, &ReadOptions::default()).unwrap_or_else(|fault| panic!("{fault}\n{text}"))
}

#[test]
fn every_candidate_of_the_library_has_its_own_description() {
    let mut families = BTreeSet::new();
    for session in [
        ready("hermle-c600u/measured/session.toml"),
        ready("table-and-head/measured/session.toml"),
        ready("r-test/measured/session.toml"),
        circle(),
        robot(),
        read(&workspace().join("tests/precession/mount.toml"), &ReadOptions::default()).unwrap(),
    ] {
        let problem = Problem::new(&session, noise_um(0.3), 1).unwrap();
        let mut described: HashMap<String, Effect> = HashMap::new();
        for candidate in library::candidates(&problem).unwrap() {
            families.insert(candidate.family);
            let effect = candidate.effect;
            let words = meaning(&session.machine, &effect);
            let text = words.to_string();
            assert!(!words.part.trim().is_empty() && !words.what.trim().is_empty(), "{}", effect.id());
            let is_identifier = match &effect.component {
                Component::Axis(name) => text.contains(&name.to_string()),
                _ => false,
            };
            assert!(!is_identifier && !text.contains(['~', '_']), "{}: {text}", effect.id());
            if let Some(other) = described.insert(text.clone(), effect.clone()) {
                panic!("{text}: {effect:?} and {other:?}");
            }
        }
        assert!(described.len() > 100, "{}", described.len());
    }
    let missing: Vec<String> = library::families()
        .unwrap()
        .into_iter()
        .enumerate()
        .filter(|(number, _)| !families.contains(number))
        .map(|(_, family)| family.name)
        .collect();
    assert!(missing.is_empty(), "no session has {missing:?}");
}

/// The expected description of one effect of each kind.
#[test]
fn descriptions_name_the_part_and_its_motion() {
    let machine = circle().machine;
    let words = |machine: &Machine, component: &str, driver: &str, shape: Shape| {
        let effect = Effect::new(Component::parse(component).unwrap(), Driver::parse(driver), shape);
        meaning(machine, &effect).to_string()
    };
    let power = Shape::Power(Power { degree: 1, scale: 1.0 });
    let harmonic = |order: f64| Shape::Harmonic(Harmonic { order });
    let steps = Shape::Steps(Steps { at: vec![-84.72, 40.0] });
    for (component, driver, shape, expected) in [
        ("EZC", "C", harmonic(2.0), "C table: axial motion twice per turn"),
        ("EAC", "C", harmonic(1.0), "C table: tilt about X once per turn"),
        ("EXC", "C", harmonic(17.0), "C table: radial motion in X 17 times per turn"),
        ("EBB", "B", harmonic(3.0), "B head: angular positioning error 3 times per turn"),
        ("EX0B", "C", harmonic(1.0), "B head: position of the axis in X once per turn of the C table"),
        ("EXX", "X", power.clone(), "X slide: positioning error in proportion to its position"),
        ("EXX", "X", Shape::Backlash, "X slide: lost motion (backlash) at reversal"),
        (
            "EYX",
            "X",
            Shape::Periodic(Periodic { period: 13.777 }),
            "X slide: straightness error in Y, repeating every 13.78 mm",
        ),
        ("EXX", "X", steps, "X slide: positioning error, steps at −84.72 mm, 40.00 mm"),
        ("EXX", "X", Shape::Lag, "X slide: lag behind the command in proportion to the speed"),
        ("EC0Y", "time", Shape::Drift, "Y slide: squareness error about Z, drifting with time"),
        ("EX0C", "temperature", power.clone(), "C table: position of the axis in X, following the temperature"),
        (
            "workpiece_ball.x",
            "time",
            Shape::Warmup(Warmup { tau_s: 200.0 }),
            "workpiece ball: shift in X, warming up with a time constant of 200.0 s",
        ),
        ("bar", "none", Shape::Constant, "bar: length, constant"),
        ("trigger", "none", Shape::Constant, "readings: delay behind the positions, constant"),
    ] {
        assert_eq!(words(&machine, component, driver, shape), expected);
    }
    let robot = robot().machine;
    assert_eq!(
        words(&robot, "EBJ2", "gravity", power),
        "joint J2: angular positioning error under gravity (compliance)"
    );
    assert_eq!(words(&robot, "EBJ2", "J2", harmonic(1.0)), "joint J2: angular positioning error once per turn");
}

/// Each part of the machine is named once, in the order of first occurrence.
#[test]
fn explanations_are_grouped_by_part() {
    let machine = circle().machine;
    let of = |freedom: Freedom, axis: &str, order: f64| {
        let name = abbe::model::component::ErrorName { kind: ErrorKind::Motion, freedom, axis: axis.to_string() };
        let effect =
            Effect::new(Component::Axis(name), Driver::Axis(axis.to_string()), Shape::Harmonic(Harmonic { order }));
        meaning(&machine, &effect)
    };
    let all = [of(Freedom::Z, "C", 2.0), of(Freedom::Y, "B", 1.0), of(Freedom::A, "C", 1.0)];
    assert_eq!(
        explanations(&all),
        "C table: axial motion twice per turn, or tilt about X once per turn; or B head: axial motion once per turn"
    );
}

/// The zero of a channel is named by the channel, and angles of a sensor by their letters.
#[test]
fn coordinates_of_an_instrument_are_named() {
    let machine = circle().machine;
    for (thing, coordinate, part, what) in [
        ("zero", "displacement", "zero", "displacement"),
        ("zero", "pitch", "zero", "pitch"),
        ("sensor", "omega", "sensor", "angle omega"),
        ("station", "b", "station", "tilt about Y"),
        ("workpiece_ball", "x", "workpiece ball", "shift in X"),
    ] {
        let component = Component::Instrument { thing: thing.to_string(), coordinate: coordinate.to_string() };
        let described = component_meaning(&machine, &component);
        assert_eq!((described.part.as_str(), described.what.as_str()), (part, what));
    }
}
