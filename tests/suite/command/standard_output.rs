//! Standard output: tables for users, or one document for a program and nothing else.

use std::fs;

use crate::suite::abbe;
use crate::suite::command::faults::TestFolder;
use crate::suite::text;

/// Commands that print a table and write JSON, for the files of [`test_folder`].
const COMMANDS: &[&str] = &[
    "fit session.toml",
    "compare session.toml again/session.toml --repeated",
    "fit hermle/session.toml --method cone",
    "fit probe/session.toml --method self-calibration",
    "trace session.toml --only backlash",
    "plan session.toml --no-effects",
    "plan session.toml --no-effects --range",
    "plan hermle/session.toml --planned --no-effects --improve 1 --bars-mm 100 --radii-mm 100 --heights-mm 0",
    "plan session.toml --patterns patterns.csv",
    "simulate session.toml --out run --force --error EC0Y=5arcsec",
    "volumetric machine.toml --map map.csv --functions functions.toml",
];

/// A folder with a small session, a repeat of it, a machine to map, and two ready sessions of other methods.
fn test_folder() -> TestFolder {
    let place = TestFolder::new();
    place.put("machine.toml", "chain = \"w X b Y Z t\"\n[axis.X]\ntravel_mm = [0, 9]\n[axis.Y]\ntravel_mm = [0, 9]\n[axis.Z]\ntravel_mm = [0, 9]\n");
    place.put("functions.toml", "[[function]]\nerror = \"EXX\"\ntable = { at_mm = [0, 9], um = [0, 1] }\n");
    for (folder, ready) in [("hermle", "hermle-c600u/measured"), ("probe", "self-calibration/measured")] {
        fs::create_dir(place.at(folder)).unwrap();
        for entry in fs::read_dir(crate::suite::ready(ready)).unwrap() {
            let path = entry.unwrap().path();
            fs::copy(&path, place.at(folder).join(path.file_name().unwrap())).unwrap();
        }
    }
    fs::create_dir(place.at("again")).unwrap();
    for name in ["session.toml", "circle.csv"] {
        fs::copy(place.at(name), place.at("again").join(name)).unwrap();
    }
    place
}

/// Standard output and standard error of a command that succeeds.
#[track_caller]
fn run(place: &TestFolder, line: &str) -> (String, String) {
    let output = place.shell(&format!("abbe {line}"));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{line}: {stderr}");
    (String::from_utf8(output.stdout).unwrap(), stderr)
}

/// The warnings and notes of a command, without its progress.
fn warnings(stderr: &str) -> Vec<&str> {
    stderr.lines().filter(|line| !line.starts_with("  + ")).collect()
}

#[test]
fn json_goes_to_standard_output_and_nothing_else_does() {
    let place = test_folder();
    let before = place.names();
    for command in COMMANDS {
        let (piped, piped_stderr) = run(&place, &format!("{command} --json -"));
        let document: serde_json::Value =
            serde_json::from_str(&piped).unwrap_or_else(|fault| panic!("{command}: {fault}\n{piped}"));
        assert!(document.is_object() || document.is_array(), "{command}");
        assert!(!place.at("-").exists(), "{command} makes a file named `-`");

        // With a file the JSON is the same, and the terminal shows the tables and the same warnings.
        let (tables, stderr) = run(&place, &format!("{command} --json out.json"));
        assert_eq!(fs::read_to_string(place.at("out.json")).unwrap(), piped, "{command}");
        assert!(tables.lines().count() > 1 || command.starts_with("simulate"), "{command}: {tables}");
        assert_eq!(warnings(&stderr), warnings(&piped_stderr), "{command}");
        fs::remove_file(place.at("out.json")).unwrap();
    }
    let made = ["map.csv", "patterns.csv", "run"];
    let after: Vec<String> = place.names().into_iter().filter(|name| !made.contains(&name.as_str())).collect();
    assert_eq!(after, before);
}

#[test]
fn quiet_suppresses_tables_and_not_warnings() {
    let place = test_folder();
    // The true noise is ten times the stated one.
    let wrong = fs::read_to_string(place.at("session.toml")).unwrap().replace("noise_um = 0.3", "noise_um = 0.03");
    place.put("wrong.toml", &wrong);
    for command in COMMANDS.iter().chain(&["fit wrong.toml", "fit wrong.toml --csv fit.csv"]) {
        let (_, loud) = run(&place, command);
        for quiet in [format!("{command} -q"), format!("--quiet {command}")] {
            let (printed, stderr) = run(&place, &quiet);
            assert_eq!(printed, "", "{quiet}");
            assert_eq!(warnings(&stderr), warnings(&loud), "{quiet}");
        }
        if command.contains("wrong") {
            assert!(loud.contains("warning"), "{command}: {loud}");
        }
    }
    for command in ["new --template ur10 mine", "new --from-code [wbXYZt] other"] {
        assert_eq!(run(&place, &format!("{command} -q")).0, "", "{command}");
    }
    // An equation, a schema and a list are the requested output, not tables.
    for command in ["equation session.toml --test XY", "schema fit", "new", "completions bash"] {
        let (loud, quiet) = (run(&place, command).0, run(&place, &format!("{command} -q")).0);
        assert!(!loud.is_empty() && loud == quiet, "{command}");
    }
}

#[test]
fn other_outputs_go_to_standard_output_too() {
    let place = test_folder();
    for (command, first) in [
        ("fit session.toml --csv -", "# Errors by their names"),
        ("fit session.toml --report -", "<!DOCTYPE html>"),
        ("trace session.toml --only backlash --csv -", "# Errors by their names"),
        ("trace session.toml --only backlash --write -", "[machine]"),
        ("plan session.toml --patterns -", "test,error,size,unit,run"),
        ("equation session.toml --test XY --out -", "Length read by a ball bar"),
        ("volumetric machine.toml --map - --functions functions.toml", "x_mm,y_mm,z_mm"),
    ] {
        let (printed, _) = run(&place, command);
        assert!(printed.starts_with(first), "{command}: {printed}");
        assert!(!place.at("-").exists(), "{command}");
    }
}

#[test]
fn standard_output_takes_one_output_and_no_folder() {
    let place = test_folder();
    let session = place.at("session.toml");
    for (arguments, words) in [
        (&["--json", "-", "--csv", "-"][..], "`-` is given for two outputs"),
        (&["--json", "-", "--report", "-"], "`-` is given for two outputs"),
        (&["--plots", "-"], "standard output, which cannot contain a folder"),
    ] {
        let output = abbe(&[&["fit", text(&session)], arguments].concat());
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(words) && output.stdout.is_empty(), "{arguments:?}: {stderr}");
    }
}

/// A page under a name that promises another format: refused before the work, and nothing is written.
#[test]
fn a_page_is_named_as_html() {
    let place = test_folder();
    let session = place.at("session.toml");
    for (command, option, name, words) in [
        ("fit", "--report", "report.pdf", "which a browser prints as PDF"),
        ("plan", "--report", "report.csv", "name a file that ends in `.html`"),
        ("sheet", "--out", "sheets.PDF", "which a browser prints as PDF"),
    ] {
        let page = place.at(name);
        let output = abbe(&[command, text(&session), option, text(&page)]);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{command}: {stderr}");
        assert!(stderr.contains(words) && stderr.contains(name) && !page.exists(), "{command}: {stderr}");
    }
}

#[test]
fn the_help_and_the_readme_state_the_exit_statuses() {
    let help = String::from_utf8(abbe(&["--help"]).stdout).unwrap();
    let readme = fs::read_to_string(crate::suite::workspace().join("README.md")).unwrap();
    for (status, words) in [("0", "done"), ("1", "cannot be used"), ("2", "command line"), ("130", "interrupted")] {
        let stated = |line: &str| line.contains(status) && line.to_lowercase().contains(words);
        assert!(help.lines().any(stated), "{status}: {help}");
        assert!(readme.lines().any(stated), "{status} is not in the README");
    }
}
