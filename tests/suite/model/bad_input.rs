//! Unusable input at the command line: exit status 1, and a message that states the location, the finding and the
//! remedy.

use std::fs;

use crate::suite::{abbe, text};

const MACHINE: &str = "chain = \"w C A b Y X Z t\"\n\n[axis.C]\n\n[axis.A]\n\n[axis.X]\n[axis.Y]\n[axis.Z]\n";

const SESSION: &str = r#"[machine]
file = "machine.toml"

[instrument]
kind = "ballbar"
noise_um = 0.3

[[test]]
name = "C100"
data = "C100.csv"
bar_mm = 100.0
workpiece_ball_mm = [0, 100, 0]
spindle_ball_mm = [0, 0, 0]
"#;

const DATA: &str = "time_s,run,c_deg,length_mm\n0,1,0,99.9990\n1,1,90,100.0010\n2,1,180,100.0000\n3,1,270,99.9995\n";

/// The message of `abbe fit` for an unusable session of three files.
#[track_caller]
fn message_of(machine: &str, session: &str, data: Option<&str>) -> String {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("machine.toml", machine);
    write("session.toml", session);
    if let Some(data) = data {
        write("C100.csv", data);
    }
    let output = abbe(&["fit", text(&folder.path().join("session.toml"))]);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(output.stdout.is_empty(), "a result beside an error");
    stderr
}

#[track_caller]
fn holds(stderr: &str, parts: &[&str]) {
    for part in parts {
        assert!(stderr.contains(part), "`{part}` is not in\n{stderr}");
    }
}

#[track_caller]
fn with_session(from: &str, to: &str, parts: &[&str]) {
    assert!(SESSION.contains(from), "{from}");
    holds(&message_of(MACHINE, &SESSION.replacen(from, to, 1), Some(DATA)), parts);
}

#[track_caller]
fn with_machine(from: &str, to: &str, parts: &[&str]) {
    assert!(MACHINE.contains(from), "{from}");
    holds(&message_of(&MACHINE.replacen(from, to, 1), SESSION, Some(DATA)), parts);
}

#[track_caller]
fn with_data(from: &str, to: &str, parts: &[&str]) {
    assert!(DATA.contains(from), "{from}");
    holds(&message_of(MACHINE, SESSION, Some(&DATA.replace(from, to))), parts);
}

#[test]
fn the_unchanged_session_is_valid() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("machine.toml", MACHINE), ("session.toml", SESSION), ("C100.csv", DATA)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let output = abbe(&["fit", text(&folder.path().join("session.toml"))]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn an_unknown_key() {
    with_session(
        "noise_um",
        "nois_um",
        &["session.toml:6", "has the unknown key `nois_um`", "did you mean `noise_um`?"],
    );
}

#[test]
fn an_unknown_column() {
    with_data("c_deg", "c_degree", &["C100.csv:1", "`c_degree`", "did you mean `c_deg`?"]);
}

#[test]
fn a_missing_data_file() {
    holds(&message_of(MACHINE, SESSION, None), &["session.toml:10", "C100.csv", "--data"]);
}

#[test]
fn text_in_a_numeric_cell() {
    with_data("100.0010", "abc", &["C100.csv:3", "abc", "length_mm"]);
}

#[test]
fn a_decimal_comma_undeclared() {
    let comma = "time_s;run;c_deg;length_mm\n0;1;0;99,9990\n1;1;90;100,0010\n";
    let session = SESSION.replace("data = \"C100.csv\"", "data = \"C100.csv\"\nformat = { separator = \";\" }");
    holds(&message_of(MACHINE, &session, Some(comma)), &["C100.csv:2", "99,9990", "decimal = \",\""]);
}

#[test]
fn a_time_that_runs_backwards() {
    with_data("2,1,180", "0.5,1,180", &["C100.csv:4", "time_s", "time decreases"]);
}

#[test]
fn not_a_number() {
    with_data("100.0000", "NaN", &["C100.csv:4", "NaN"]);
}

#[test]
fn an_empty_data_file() {
    holds(&message_of(MACHINE, SESSION, Some("")), &["C100.csv", "empty"]);
    let header = DATA.lines().next().unwrap();
    holds(&message_of(MACHINE, SESSION, Some(header)), &["C100.csv", "a header without readings"]);
}

#[test]
fn one_reading() {
    let one: Vec<&str> = DATA.lines().take(2).collect();
    holds(&message_of(MACHINE, SESSION, Some(&one.join("\n"))), &["C100.csv", "one reading"]);
}

#[test]
fn duplicate_test_names() {
    let test = &SESSION[SESSION.find("[[test]]").unwrap()..];
    holds(&message_of(MACHINE, &format!("{SESSION}\n{test}"), Some(DATA)), &["session.toml:16", "C100"]);
}

#[test]
fn a_chain_without_its_bed() {
    with_machine("w C A b Y X Z t", "w C A Y X Z t", &["machine.toml:1", "0 beds `b`", "w C A b Y X Z t"]);
}

#[test]
fn an_axis_without_a_table_and_a_table_without_an_axis() {
    with_machine("[axis.A]\n", "", &["machine.toml", "[axis.A]"]);
    with_machine("[axis.A]\n", "[axis.A]\n[axis.B]\n", &["machine.toml:6", "`B`"]);
}

#[test]
fn an_effect_on_an_axis_that_the_machine_lacks() {
    let effect = "[[effect]]\ncomponent = \"EZB\"\ndriver = \"C\"\nshape = \"harmonic\"\norder = 2\n\n[[test]]";
    with_session("[[test]]", effect, &["session.toml:9", "has no axis `B`", "its axes are C, A, Y, X, Z"]);
}

#[test]
fn a_bar_that_cannot_reach() {
    with_session(
        "[0, 100, 0]",
        "[0, 100, 60]",
        &[
            "session.toml:8",
            "test \"C100\": a bar of 100.0000 mm cannot reach",
            "116.619 mm apart",
            "farthest from it at c_deg = 0",
            "degrees read as radians",
        ],
    );
    // Degrees in a column of radians: the balls keep their distance at 0 only.
    let session = SESSION.replace("spindle_ball_mm = [0, 0, 0]", "spindle_ball_mm = [0, 100, 100]");
    let data = "a_rad,length_mm\n0,100.0\n30,100.0\n60,100.0\n";
    holds(&message_of(MACHINE, &session, Some(data)), &["cannot reach", "degrees read as radians"]);
}

#[test]
fn a_wrong_command_line_is_status_2() {
    for arguments in [
        &["fit"][..],
        &["fit", "a.toml", "--sed", "1"],
        &["fot", "a.toml"],
        &["simulate", "a.toml"],
        &["simulate", "a.toml", "--out", "b", "--seed", "one"],
        &["new", "a"],
        &["new", "a", "--template", "ur10", "--from-code", "[wbXt]"],
        &[],
    ] {
        let output = abbe(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(!output.stderr.is_empty());
    }
}

/// Options without effect are refused.
#[test]
fn options_that_exclude_one_another() {
    for line in [
        "trace s.toml --list --json l.json",
        "trace s.toml --list --csv l.csv",
        "trace s.toml --list --write n.toml",
        "trace s.toml --list --report r.html",
        "trace s.toml --list --plots p",
        "compare s.toml t.toml --repeated --shared bar",
        "compare s.toml t.toml --repeated --significance 0.1",
        "compare s.toml t.toml --repeated --places 3",
        "plan s.toml --patterns p.csv --improve 1",
        "plan s.toml --patterns p.csv --separate A,B",
        "plan s.toml --patterns p.csv --range",
        "plan s.toml --patterns p.csv --device-mm 1,1,1,1,1,1",
        "plan s.toml --patterns p.csv --noise-um 1",
        "plan s.toml --improve 1 --device-mm 1,1,1,1,1,1",
        "plan s.toml --improve 1 --separate A,B",
        "volumetric m.toml --map m.csv --functions f.toml --out x",
        "volumetric m.toml --map m.csv --functions f.toml --as c",
        "volumetric m.toml --map m.csv --functions f.toml --errors EXX",
    ] {
        let output = abbe(&line.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(2), "{line}");
        holds(&String::from_utf8(output.stderr).unwrap(), &["cannot be used with"]);
    }
    for line in [
        "trace s.toml --control linuxcnc",
        "fit s.toml --coverage 0.9",
        "plan s.toml --bars-mm 100",
        "plan s.toml --radii-mm 100 --range",
        "plan s.toml --heights-mm 0",
        "plan s.toml --feeds 2",
        "plan s.toml --sweep-shares 0.5",
        "plan s.toml --directions one",
        "plan s.toml --no-follow",
        "plan s.toml --remount-spindle-ball",
        "plan s.toml --setup-min 5",
        "plan s.toml --test-min 5",
        "plan s.toml --error EY0A=1um",
        "volumetric m.toml --map m.csv",
        "volumetric m.toml --places 3",
    ] {
        let output = abbe(&line.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(2), "{line}");
        holds(&String::from_utf8(output.stderr).unwrap(), &["were not provided"]);
    }
}

#[test]
fn help_has_examples_and_status_0() {
    for arguments in [&["--help"][..], &["fit", "--help"], &["simulate", "--help"], &["new", "--help"]] {
        let output = abbe(arguments);
        assert!(output.status.success());
        assert!(String::from_utf8(output.stdout).unwrap().contains("Example"), "{arguments:?}");
    }
}

/// A text of `--only` or `--exclude` that no identifier contains is an error; otherwise the result would suggest that
/// the effect is absent.
#[test]
fn an_effect_that_the_library_does_not_have() {
    let session = crate::suite::ready("hermle-c600u/measured/session.toml");
    let asked = |words: &[&str]| abbe(&[&["trace", crate::suite::text(&session)], words].concat());
    for words in [&["--only", "EZB"][..], &["--only", "EZC", "--only", "harmonics"], &["--list", "--only", "ezc"]] {
        let output = asked(words);
        assert_eq!(output.status.code(), Some(1), "{words:?}");
        let stderr = String::from_utf8(output.stderr).unwrap();
        let misspelt = words[words.len() - 1];
        holds(&stderr, &[&format!("contains `{misspelt}` in its identifier"), "abbe trace --list"]);
    }
    for words in [&["--exclude", ""][..], &["--only", "EZC", "--exclude", "ZC"]] {
        let output = asked(words);
        assert_eq!(output.status.code(), Some(1), "{words:?}");
        holds(&String::from_utf8(output.stderr).unwrap(), &["no candidate effects remain"]);
    }
    let output = asked(&["--only", "gain", "--exclude", "gravitation"]);
    assert!(output.status.success());
    let printed = String::from_utf8(output.stdout).unwrap() + &String::from_utf8(output.stderr).unwrap();
    holds(&printed, &["`gravitation` excludes nothing"]);
}

#[test]
fn more_tests_than_the_limit() {
    for tests in ["0", "25", "100000"] {
        let plan = crate::suite::ready("hermle-c600u/chapter5.toml");
        let output = abbe(&["plan", crate::suite::text(&plan), "--no-effects", "--improve", tests]);
        assert_eq!(output.status.code(), Some(1));
        let stderr = String::from_utf8(output.stderr).unwrap();
        holds(&stderr, &[&format!("`--improve {tests}`: a number of tests from 1 to 24 is expected")]);
    }
}

#[test]
fn invalid_files() {
    for path in ["nowhere/session.toml", "."] {
        let output = abbe(&["fit", path]);
        assert_eq!(output.status.code(), Some(1));
        assert!(String::from_utf8(output.stderr).unwrap().contains("the session file"));
    }
}
