//! `abbe new`: every template is a readable session.

use abbe::apply::volumetric::functions;
use abbe::files::{self, ReadOptions};
use abbe::model::axis::AxisKind;

use crate::suite::{abbe, text};

/// Half the travel that a linear axis has where a plan needs less, mm.
const USUAL_HALF_TRAVEL_MM: f64 = 300.0;

#[test]
fn every_template_is_copied_and_reads() {
    let listed = abbe(&["new", "--list"]);
    assert!(listed.status.success());
    let listed = String::from_utf8(listed.stdout).unwrap();
    let names: Vec<&str> = listed.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(
        ["hermle-c600u", "hermle-c600u-measured", "kuka-iiwa14", "self-calibration", "ur10", "volumetric"]
            .iter()
            .all(|name| names.contains(name))
    );
    let folder = tempfile::tempdir().unwrap();
    for name in names {
        let made = folder.path().join("new").join(name);
        assert!(abbe(&["new", text(&made), "--template", name]).status.success());
        let mut sessions = 0;
        for entry in std::fs::read_dir(&made).unwrap() {
            let path = entry.unwrap().path();
            let file = path.file_name().unwrap().to_str().unwrap().to_string();
            if file == "errors.toml" {
                let machine = files::machine(&made.join("machine.toml")).unwrap();
                assert!(!functions::read(&path, &machine).unwrap().is_empty());
                sessions += 1;
            } else if file.ends_with(".toml") && file != "machine.toml" {
                let options = ReadOptions {
                    read_data: !["kuka-iiwa14", "telescope", "ur10"].contains(&name),
                    ..ReadOptions::default()
                };
                files::session(&path, &options).unwrap();
                sessions += 1;
            }
        }
        assert!(sessions > 0, "{name}");
        // Existing files are not overwritten without `--force`.
        let again = abbe(&["new", text(&made), "--template", name]);
        assert_eq!(again.status.code(), Some(1));
        assert!(String::from_utf8_lossy(&again.stderr).contains("exists and is not empty"));
        assert!(abbe(&["new", text(&made), "--template", name, "--force"]).status.success());
    }
    let nothing_else = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(nothing_else, 1, "temporary folders are left behind");
}

#[test]
fn an_unknown_template_is_refused_with_the_list_of_templates() {
    let folder = tempfile::tempdir().unwrap();
    let output = abbe(&["new", text(&folder.path().join("a")), "--template", "hermle"]);
    assert_eq!(output.status.code(), Some(1));
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(stderr.contains("no template `hermle`") && stderr.contains("kuka-iiwa14"), "{stderr}");
}

#[test]
fn any_structural_code_gives_a_plan_that_runs() {
    use crate::suite::plan::topologies::{FIGURE_1_1, TABLE_1_1};
    let folder = tempfile::tempdir().unwrap();
    let mut codes: Vec<String> = TABLE_1_1.iter().chain(&FIGURE_1_1).map(|code| code.to_string()).collect();
    codes.extend(
        [
            "[wXYbZt]",
            "[wbXYZt]",
            "[wXbYZt]",
            "[wYXZbt]",
            "[wCXbYZAt]",
            "[wCbXYZAt]",
            "[wbXYZABCt]",
            "[wCBAbXYZt]",
            "[wCbt]",
            "[wbXYt]",
            "w C A b Y X Z U t",
            "w b Z Y X W t",
        ]
        .map(str::to_string),
    );
    for (index, code) in codes.iter().enumerate() {
        let made = folder.path().join(index.to_string());
        let run = abbe(&["new", text(&made), "--from-code", code]);
        assert!(run.status.success(), "{code}: {}", String::from_utf8_lossy(&run.stderr));
        let machine = files::machine(&made.join("machine.toml")).unwrap();
        assert_eq!(machine.code().replace(' ', ""), code.replace(' ', "").trim_matches(['[', ']']));
        let plan = abbe(&["plan", text(&made.join("plan.toml")), "--no-effects"]);
        assert!(plan.status.success(), "{code}: {}", String::from_utf8_lossy(&plan.stderr));
        let stderr = String::from_utf8_lossy(&plan.stderr).into_owned();
        assert!(!stderr.contains("warning"), "{code}: {stderr}");
        // The stated travel is not far beyond what the plan commands, unless it is the usual one.
        let options = files::ReadOptions { read_data: false, ..Default::default() };
        let session = files::session(&made.join("plan.toml"), &options).unwrap();
        let (planned, _) = abbe::plan::prepared(&session, &abbe::plan::PlanOptions::default()).unwrap();
        for (place, axis) in session.machine.axes.iter().enumerate().filter(|(_, axis)| axis.kind == AxisKind::Linear) {
            let positions = planned.tests.iter().filter_map(|test| Some(&test.readings.as_ref()?.positions[place]));
            let reach = positions.flatten().fold(0.0_f64, |reach, position| reach.max(position.abs()));
            let [from, to] = axis.travel.unwrap();
            assert!(
                (to - from) / 2.0 <= (reach + 350.0).max(USUAL_HALF_TRAVEL_MM),
                "{code} {}: {from} to {to}, {reach}",
                axis.name
            );
        }
        // Every line with a value has a comment above it or beside it.
        for file in ["machine.toml", "plan.toml"] {
            let written = std::fs::read_to_string(made.join(file)).unwrap();
            let lines: Vec<&str> = written.lines().collect();
            let mut explained = false;
            for line in lines {
                if line.starts_with('#') {
                    explained = true;
                } else if line.is_empty() || line.starts_with('[') || line == "]" {
                    explained = explained && line.starts_with("[[");
                } else if line.starts_with("  \"") {
                    assert!(line.contains('#'), "{code}: {file}: {line}");
                } else {
                    let group = ["spindle_ball", "spindle_setup", "bar_setup", "bar_u_um", "direction"]
                        .iter()
                        .any(|key| line.starts_with(key));
                    assert!(explained || group, "{code}: {file}: {line}");
                    explained = false;
                }
            }
        }
    }
    for (code, message) in [
        ("[wCAYXZt]", "it contains 0 beds"),
        ("w b J1 J2 t", "axis `J1` is not an ISO 841 letter"),
        ("wbt", "it has no axis"),
        ("w b Z B t", "a bar cannot be set up for any test"),
    ] {
        let output = abbe(&["new", text(&folder.path().join("no")), "--from-code", code]);
        assert_eq!(output.status.code(), Some(1));
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(stderr.contains(message), "{code}: {stderr}");
    }
    assert!(!folder.path().join("no").exists());
}

/// Sizes are stated, or the files call them guesses.
#[test]
fn sizes_are_stated_or_guessed() {
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str, more: &[&str]| {
        let place = folder.path().join(name);
        let run = abbe(&[&["new", text(&place), "--from-code", "[wCXbYZAt]"][..], more].concat());
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        std::fs::read_to_string(place.join("machine.toml")).unwrap()
    };
    let guessed = made("guessed", &[]);
    assert_eq!(guessed.matches("A guess.").count(), 3, "{guessed}");
    assert!(guessed.contains("origin_mm = [0, 0, 250]"), "{guessed}");
    let stated = made("stated", &["--pivot-mm", "180", "--gauge-mm", "120", "--table-mm=-80"]);
    assert_eq!((stated.matches("A guess.").count(), stated.matches("As stated").count()), (0, 3), "{stated}");
    assert!(stated.contains("origin_mm = [0, 0, 300]"), "{stated}");
    assert!(stated.contains("[150.0, 150.0, -80.0]") && stated.contains("[-60.0, -60.0, 120.0]"), "{stated}");
    for (code, size, expected) in [
        ("[wCAbYXZt]", "--pivot-mm=100", "the head of this machine has no rotary axis"),
        ("[wCXbYZAt]", "--gauge-mm=5", "the gauge length is 5 mm"),
    ] {
        let run = abbe(&["new", text(&folder.path().join("no")), "--from-code", code, size]);
        let message = String::from_utf8_lossy(&run.stderr).into_owned();
        assert!(run.status.code() == Some(1) && message.contains(expected), "{message}");
    }
}

/// Files that `plan` would refuse are not written, and every size that is accepted has a plan.
#[test]
fn what_is_written_can_be_planned() {
    let folder = tempfile::tempdir().unwrap();
    let made = folder.path().join("made");
    for (code, sizes) in [
        ("wCXbYZAt", ["--pivot-mm", "-5"]),
        ("wCXbYZAt", ["--gauge-mm", "-5"]),
        ("wCXbYZAt", ["--table-mm", "nan"]),
        ("wCXbYZAt", ["--pivot-mm", "1e300"]),
    ] {
        let output = abbe(&[&["new", text(&made), "--from-code", code][..], &sizes].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{sizes:?}: {said}");
        assert!(said.contains("mm is expected"), "{sizes:?}: {said}");
        assert!(!made.exists(), "{sizes:?}");
    }
    // Z carries the workpiece, and the table is high or low.
    for (number, code) in ["wCZXbYt", "wCAZbYXt"].into_iter().enumerate() {
        for height in ["-400", "400"] {
            let made = folder.path().join(format!("m{number}{height}"));
            let output = abbe(&["new", text(&made), "--from-code", code, "--table-mm", height]);
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            if output.status.success() {
                let plan = made.join("plan.toml");
                let planned = abbe(&["plan", text(&plan), "--no-effects", "--quiet"]);
                let said = String::from_utf8_lossy(&planned.stderr).into_owned();
                assert!(planned.status.success(), "{code} {height}: {said}");
                assert!(!said.contains("travel"), "{code} {height}: {said}");
            } else {
                assert!(!made.exists(), "{code} {height}");
                panic!("{code} {height}: {said}");
            }
        }
    }
}

#[test]
fn without_arguments_the_templates_are_listed() {
    let listed = abbe(&["new"]);
    assert!(listed.status.success());
    assert_eq!(listed.stdout, abbe(&["new", "--list"]).stdout);
    let output = abbe(&["new", "somewhere"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--from-code"));
}
