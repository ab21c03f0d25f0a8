//! `abbe import`: foreign files of readings, read as their truth says or refused with the reason.
//!
//! The files and their truth are written by `tests/foreign/generate.py`, which computes the readings from published
//! kinematics and uses nothing of this project.

use std::path::{Path, PathBuf};
use std::process::Output;

use abbe::files::{self, ReadOptions};
use abbe::model::instrument::Station;
use abbe::model::session::Session;
use abbe::model::session::readings::Readings;
use serde_json::Value;

mod joints;
mod names;
mod stated;
mod units;

use crate::suite::{abbe, ready, text, workspace};

fn foreign(name: &str) -> PathBuf {
    workspace().join("tests/foreign").join(name)
}

fn stem(name: &str) -> &str {
    name.split_once('.').unwrap().0
}

/// Imports a file into a new folder: with a plan of `tests/foreign`, or with the UR10.
fn import(folder: &Path, file: &Path, plan: Option<&str>, more: &[&str]) -> (Output, PathBuf) {
    match plan {
        Some(plan) => {
            std::fs::create_dir_all(folder).unwrap();
            let session = folder.join("plan.toml");
            std::fs::copy(foreign(plan), &session).unwrap();
            let asked = ["import", text(file), "--session", text(&session)];
            (abbe(&[&asked[..], more].concat()), session)
        }
        None => {
            let out = folder.join("session");
            let machine = ready("ur10/machine.toml");
            let asked = ["import", text(file), "--machine", text(&machine), "--out", text(&out)];
            (abbe(&[&asked[..], more].concat()), out.join("session.toml"))
        }
    }
}

fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The columns of the truth of a file.
fn truth(name: &str) -> Vec<(String, Vec<f64>)> {
    let text = std::fs::read_to_string(foreign(&format!("{}.truth.csv", stem(name)))).unwrap();
    let mut lines = text.lines();
    let mut columns: Vec<(String, Vec<f64>)> =
        lines.next().unwrap().split(',').map(|name| (name.to_string(), Vec::new())).collect();
    for line in lines {
        for ((_, values), cell) in columns.iter_mut().zip(line.split(',')) {
            values.push(cell.parse().unwrap());
        }
    }
    columns
}

/// A column of readings in the unit of its name.
fn column(session: &Session, (station, readings): (&Station<f64>, &Readings), name: &str) -> Vec<f64> {
    let channel = |k: usize, scale: f64| -> Vec<f64> {
        readings.observed.iter().skip(k).step_by(readings.channels).map(|value| value * scale).collect()
    };
    match name {
        "run" => readings.run.iter().map(|run| *run as f64).collect(),
        "time_s" => readings.time_s.iter().map(|time| time - readings.time_s[0]).collect(),
        "temperature_c" => readings.drivers[name].clone(),
        "length_mm" => channel(0, 1.0),
        // Coordinates, or range and angles.
        "px_mm" | "py_mm" | "pz_mm" => {
            let place = ["px_mm", "py_mm", "pz_mm"].iter().position(|own| *own == name).unwrap();
            let rows = readings.observed.chunks_exact(readings.channels);
            rows.map(|values| station.measured_mm(values).unwrap()[place]).collect()
        }
        "dx_um" => channel(0, 1e3),
        "dy_um" => channel(1, 1e3),
        "dz_um" => channel(2, 1e3),
        // A laser's deviation from the nominal displacement.
        "deviation_um" => {
            let mut reading = readings.nominal(&session.machine, station);
            let mut nominal = |row: usize| reading(row).channels()[0];
            (0..readings.rows()).map(|row| (readings.observed[row] - nominal(row)) * 1e3).collect()
        }
        _ => {
            let axis = session.machine.axes.iter().position(|axis| axis.column("") == name).unwrap();
            let kind = session.machine.axes[axis].kind;
            readings.positions[axis].iter().map(|position| kind.to_display(*position)).collect()
        }
    }
}

/// What differs between the readings of a session and the truth of a file.
fn difference(session: &Session, name: &str) -> Option<String> {
    let is_of = |test: &str| test == stem(name) || test.starts_with(&format!("{}/", stem(name)));
    let Some(test) = session.tests.iter().find(|test| is_of(&test.name) && test.readings.is_some()) else {
        return Some("no readings".into());
    };
    let readings = test.readings.as_ref().unwrap();
    for (own, expected) in truth(name) {
        let found = column(session, (&test.station, readings), &own);
        // The poses of three sockets follow one another: the first test has every third.
        let every = if test.socket.is_some() { 3 } else { 1 };
        let expected: Vec<f64> = expected.into_iter().step_by(every).collect();
        if found.len() != expected.len() {
            return Some(format!("{own}: {} rows, {} expected", found.len(), expected.len()));
        }
        let off = found
            .iter()
            .zip(&expected)
            .position(|(found, expected)| (found - expected).abs() >= 2e-6 || found.is_nan());
        if let Some(row) = off {
            return Some(format!("{own}, row {row}: {}, {} expected", found[row], expected[row]));
        }
    }
    None
}

/// The files that are read without a hint: with the plan that has their test, and whether a normalised copy is needed.
const READ: [(&str, Option<&str>, bool); 18] = [
    ("ros.csv", None, false),
    ("deutsch.csv", None, false),
    ("units-line.txt", None, false),
    ("metres.csv", None, false),
    ("polar-tracker.csv", None, true),
    ("unicode.txt", None, false),
    ("inch.csv", None, false),
    ("spaces.dat", None, true),
    ("clock.csv", None, true),
    ("command-actual.csv", None, false),
    ("grouped.csv", None, true),
    ("sockets.csv", None, false),
    ("kugelstab.csv", Some("plan-hermle.toml"), false),
    ("two-directions.csv", Some("plan-hermle.toml"), true),
    ("polar.txt", Some("plan-hermle.toml"), true),
    ("gaps.csv", Some("plan-hermle.toml"), true),
    ("r-test.csv", Some("plan-r-test.toml"), false),
    ("laser.txt", Some("plan-laser.toml"), true),
];

#[test]
fn eighteen_of_twenty_foreign_files_are_read_without_a_hint() {
    let place = tempfile::tempdir().unwrap();
    let mut faults = Vec::new();
    for (name, plan, normalised) in READ {
        let folder = place.path().join(stem(name));
        // Poses drawn at random lie in no socket: the readings of that file are right, the session is not.
        let more: &[&str] = if name == "sockets.csv" { &["--allow-implausible"] } else { &[] };
        let json = place.path().join(format!("{}.json", stem(name)));
        let (output, session) = import(&folder, &foreign(name), plan, &[more, &["--json", text(&json)]].concat());
        if !output.status.success() {
            faults.push(format!("{name}: {}", message(&output)));
            continue;
        }
        let read = files::session(&session, &ReadOptions::default()).unwrap();
        faults.extend(difference(&read, name).map(|difference| format!("{name}: {difference}")));
        let result: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
        let because = result["tests"][0]["normalised"].as_array().unwrap();
        if because.is_empty() == normalised {
            faults.push(format!("{name}: normalised because of {because:?}"));
        }
    }
    assert!(faults.is_empty(), "{} of {}:\n{}", faults.len(), READ.len(), faults.join("\n"));
}

#[test]
fn what_cannot_be_told_is_refused_with_the_reason() {
    let place = tempfile::tempdir().unwrap();
    let refused = |name: &str, plan| {
        let (output, session) = import(&place.path().join(stem(name)), &foreign(name), plan, &[]);
        assert!(!output.status.success(), "{name}");
        assert!(!session.exists() || plan.is_some(), "{name}: nothing is written");
        message(&output).split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let found = refused("comma-twice.csv", Some("plan-hermle.toml"));
    assert!(found.contains("the comma is the decimal sign and the separator"), "{found}");
    let found = refused("no-names.csv", None);
    assert!(found.contains("no column holds the position of an axis"), "{found}");
    assert!(found.contains("no names of columns") && found.contains("j1_deg=1"), "{found}");
    // With hints it is read.
    let hints =
        ["j1_rad=1", "j2_rad=2", "j3_rad=3", "j4_rad=4", "j5_rad=5", "j6_rad=6", "px_mm=7", "py_mm=8", "pz_mm=9"];
    let hints: Vec<&str> = hints.iter().flat_map(|hint| ["--column", hint]).collect();
    let (output, session) = import(&place.path().join("hinted"), &foreign("no-names.csv"), None, &hints);
    assert!(output.status.success(), "{}", message(&output));
    let read = files::session(&session, &ReadOptions::default()).unwrap();
    assert_eq!(read.tests[0].readings.as_ref().unwrap().rows(), 60);
}

/// The readings of the UR10 with a mistake: the cells of each row are changed.
fn mistaken(folder: &Path, name: &str, header: &str, change: impl Fn(&mut Vec<f64>)) -> PathBuf {
    let truth = truth("ros.csv");
    let mut lines = format!("{header}\n");
    for row in 0..truth[0].1.len() {
        let mut cells: Vec<f64> = truth.iter().map(|(_, values)| values[row]).collect();
        change(&mut cells);
        lines += &cells.iter().map(|cell| format!("{cell:.6}")).collect::<Vec<_>>().join(",");
        lines.push('\n');
    }
    let file = folder.join(name);
    std::fs::write(&file, lines).unwrap();
    file
}

const HEADER: &str = "J1 [deg],J2 [deg],J3 [deg],J4 [deg],J5 [deg],J6 [deg],X [mm],Y [mm],Z [mm]";

#[test]
fn mistakes_are_named_and_refused() {
    let place = tempfile::tempdir().unwrap();
    let right = mistaken(place.path(), "right.csv", HEADER, |_| {});
    let (output, _) = import(&place.path().join("right"), &right, None, &[]);
    assert!(output.status.success(), "{}", message(&output));

    let check = |name: &str, header: &str, change: &dyn Fn(&mut Vec<f64>), expected: &str| {
        let file = mistaken(place.path(), &format!("{name}.csv"), header, change);
        let (output, session) = import(&place.path().join(name), &file, None, &[]);
        let found = message(&output).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(!output.status.success() && !session.exists(), "{name}: {found}");
        assert!(found.contains(expected), "{name}: {found}");
    };
    let metres = |cells: &mut Vec<f64>| cells[6..].iter_mut().for_each(|cell| *cell /= 1000.0);
    check("metres", HEADER, &metres, "in m, not in mm");
    let radians = |cells: &mut Vec<f64>| cells[..6].iter_mut().for_each(|cell| *cell = cell.to_radians());
    check("radians", HEADER, &radians, "in radians, not in degrees");
    check("degrees", &HEADER.replace("deg", "rad"), &|_: &mut Vec<f64>| {}, "in degrees, not in radians");
    check("reversed", HEADER, &|cells: &mut Vec<f64>| cells[2] = -cells[2], "J3 have the opposite sign");
    check("exchanged", HEADER, &|cells: &mut Vec<f64>| cells.swap(1, 3), "J2 and J4 are exchanged");
    check("left-handed", HEADER, &|cells: &mut Vec<f64>| cells.swap(6, 7), "left-handed");
}

/// The third axis 60 mm beside its place, where its links are 612 and 572.3 mm long: no other reading of the file explains
/// it, so that it is a warning.
#[test]
fn an_axis_far_beside_its_place_is_a_warning_without_a_cause() {
    let place = tempfile::tempdir().unwrap();
    let machine = place.path().join("machine.toml");
    let own = std::fs::read_to_string(ready("ur10/machine.toml")).unwrap();
    let moved = own.replacen("[-612, 0, 127.3]", "[-552, 0, 127.3]", 1);
    assert_ne!(moved, own);
    std::fs::write(&machine, moved).unwrap();
    let out = place.path().join("out");
    let file = foreign("units-line.txt");
    let output = abbe(&["import", text(&file), "--machine", text(&machine), "--out", text(&out)]);
    let found = message(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(output.status.success() && out.join("session.toml").exists(), "{found}");
    assert!(found.contains("beside its place") && found.contains("% of the link"), "{found}");
}

/// A joint that turns in the other sense does not pass a fit or a trace, which name it.
#[test]
fn a_fit_refuses_location_errors_that_have_a_cause() {
    let place = tempfile::tempdir().unwrap();
    let (output, session) = import(place.path(), &foreign("units-line.txt"), None, &[]);
    assert!(output.status.success(), "{}", message(&output));
    let machine = session.with_file_name("machine.toml");
    let own = std::fs::read_to_string(&machine).unwrap();
    let (before, of_j4) = own.split_at(own.find("[axis.J4]").unwrap());
    let reversed = format!("{before}{}", of_j4.replacen("[0, -1, 0]", "[0, 1, 0]", 1));
    assert_ne!(reversed, own);
    std::fs::write(&machine, reversed).unwrap();
    let text_of = std::fs::read_to_string(&session).unwrap();
    std::fs::write(&session, text_of.replacen("kind = \"tracker\"", "kind = \"tracker\"\nnoise_um = 50", 1)).unwrap();
    let output = abbe(&["fit", text(&session), "--quiet"]);
    let found = message(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(!output.status.success() && found.contains("J4") && found.contains("opposite sign"), "{found}");
    assert!(found.contains("--allow-implausible"), "{found}");
    assert!(abbe(&["fit", text(&session), "--quiet", "--allow-implausible"]).status.success());
    // That the session may read files elsewhere says nothing of its estimates.
    assert!(!abbe(&["fit", text(&session), "--quiet", "--allow-outside"]).status.success());
    // A search for effects of such a machine is refused as well, before it begins.
    let output = abbe(&["trace", text(&session), "--quiet"]);
    let found = message(&output);
    assert!(!output.status.success() && output.stdout.is_empty(), "{found}");
    assert!(found.contains("--allow-implausible"), "{found}");
}

#[test]
fn a_session_states_the_layout_and_keeps_its_text() {
    let place = tempfile::tempdir().unwrap();
    let (output, session) = import(place.path(), &foreign("deutsch.csv"), None, &[]);
    assert!(output.status.success(), "{}", message(&output));
    let written = std::fs::read_to_string(&session).unwrap();
    for line in [
        "separator = \";\"",
        "decimal = \",\"",
        "encoding = \"latin1\"",
        "skip_lines = 3",
        "j1_deg = \"Achse 1 [°]\"",
        "px_mm = \"X [mm]\"",
    ] {
        assert!(written.contains(line), "{line}:\n{written}");
    }
    assert!(written.contains("[format]") && written.contains("[columns]"), "{written}");
    let shown = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(shown.contains("Achse 1 [°]") && shown.contains("j1_deg"), "{shown}");
    // The same bytes lie beside it.
    assert_eq!(
        std::fs::read(session.with_file_name("deutsch.csv")).unwrap(),
        std::fs::read(foreign("deutsch.csv")).unwrap()
    );

    // Two files of one plan, one after the other: comments and the other tests stay.
    let folder = place.path().join("plan");
    let (output, plan) = import(&folder, &foreign("kugelstab.csv"), Some("plan-hermle.toml"), &[]);
    assert!(output.status.success(), "{}", message(&output));
    let output = abbe(&["import", text(&foreign("gaps.csv")), "--session", text(&plan)]);
    assert!(output.status.success(), "{}", message(&output));
    let written = std::fs::read_to_string(&plan).unwrap();
    assert!(written.starts_with("# The planned tests whose readings are"), "{written}");
    assert!(
        written.contains("data = \"kugelstab.csv\"") && written.contains("data = \"gaps-normalised.csv\""),
        "{written}"
    );
    assert_eq!(written.matches("data = ").count(), 2, "{written}");
    // A file whose test has readings is refused.
    let output = abbe(&["import", text(&foreign("gaps.csv")), "--session", text(&plan)]);
    assert!(message(&output).contains("has data already"), "{}", message(&output));
}

#[test]
fn a_new_test_takes_the_set_up_of_another() {
    let place = tempfile::tempdir().unwrap();
    let (output, session) = import(place.path(), &foreign("ros.csv"), None, &[]);
    assert!(output.status.success(), "{}", message(&output));
    let output = abbe(&["import", text(&foreign("inch.csv")), "--session", text(&session)]);
    assert!(output.status.success(), "{}", message(&output));
    let read = files::session(&session, &ReadOptions::default()).unwrap();
    assert_eq!(read.tests.len(), 2);
    for name in ["ros.csv", "inch.csv"] {
        assert_eq!(difference(&read, name), None, "{name}");
    }
    // The target in the tool frame, which lies in the frame of the base at zero: the flange at [-1184.3, -256.141, 11.6] mm, whose
    // axes are X, -Z and Y there.
    let expected = [-1184.3 + 30.0, -256.141 - 80.0, 11.6 - 20.0];
    for test in &read.tests {
        let found = test.station.tool_point().mm;
        assert!((0..3).all(|i| (found[i] - expected[i]).abs() < 0.2), "{found:?}");
    }
}
