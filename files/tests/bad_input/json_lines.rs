//! Tests of JSON Lines: the readings of the same table as CSV, and the place of every fault.

use std::fs;

use abbe_files::ReadOptions;
use abbe_model::Diagnostic;
use abbe_model::session::Session;

use super::{DATA, MACHINE, SESSION, assert_contains, error_text, session};

/// Reads the session with these lines before its test, and a data file of JSON Lines.
fn with_lines(lines: &str, data: &str) -> Result<Session, Diagnostic> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("machine.toml"), MACHINE).unwrap();
    fs::write(folder.path().join("C100.jsonl"), data).unwrap();
    let text = SESSION.replace("C100.csv", "C100.jsonl");
    let text = text.replace("[[test]]", &format!("{lines}\n[[test]]"));
    fs::write(folder.path().join("session.toml"), text).unwrap();
    abbe_files::session(&folder.path().join("session.toml"), &ReadOptions::default())
}

/// A table as JSON Lines, with the keys of every other line in the opposite order.
fn objects(csv: &str) -> String {
    let mut lines = csv.lines();
    let keys: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut text = String::new();
    for (number, line) in lines.enumerate() {
        let mut pairs: Vec<String> =
            keys.iter().zip(line.split(',')).map(|(key, cell)| format!("\"{key}\": {cell}")).collect();
        if number % 2 == 1 {
            pairs.reverse();
        }
        text.push_str(&format!("{{{}}}\n", pairs.join(", ")));
    }
    text
}

/// A header of a spreadsheet often has several lines.
#[test]
fn names_of_columns_may_have_several_lines() {
    let columns = "[columns]\nrun = \"run\"\nc_deg = \"c_deg\"\nlength_mm = \"Length\\n(mm)\"\n";
    let read = with_lines(columns, &objects(DATA).replace("length_mm", "Length\\n(mm)")).unwrap();
    assert_eq!(read.tests[0].readings.as_ref().unwrap().observed, [99.9990, 100.0010, 100.0, 99.9995]);
}

#[test]
fn the_readings_are_those_of_the_same_table_as_csv() {
    let csv = session(MACHINE, SESSION, Some(DATA)).unwrap();
    // A decimal comma of the session concerns its other files; JSON has points.
    for layout in ["", "[format]\nseparator = \";\"\ndecimal = \",\"\n"] {
        let json = with_lines(layout, &format!("\u{feff}\n{}", objects(DATA))).unwrap();
        let [own, other] = [&csv, &json].map(|session| session.tests[0].readings.as_ref().unwrap());
        assert_eq!(own.observed, other.observed);
        assert_eq!(own.positions, other.positions);
        assert_eq!((&own.run, &own.time_s), (&other.run, &other.time_s));
        // An empty line takes the place of the header.
        assert_eq!(own.line(0), other.line(0));
    }
    let foreign = objects(DATA).replace("c_deg", "angle").replace("}", ", \"remark\": [\"x\", null]}");
    let columns = "[columns]\ntime_s = \"time_s\"\nrun = \"run\"\nc_deg = \"angle\"\nlength_mm = \"length_mm\"\n";
    let mapped = with_lines(columns, &foreign).unwrap();
    assert_eq!(mapped.tests[0].readings.as_ref().unwrap().observed, csv.tests[0].readings.as_ref().unwrap().observed);
}

#[test]
fn every_fault_has_its_line_and_key() {
    let good = objects(DATA);
    let with = |from: &str, to: &str| {
        assert!(good.contains(from), "{from} is not in\n{good}");
        error_text(with_lines("", &good.replacen(from, to, 1)))
    };
    let third = good.lines().nth(2).unwrap();
    let changed = |to: &str| with(third, to);
    let key = |value: &str| {
        let (before, _) = third.split_once("\"length_mm\": ").unwrap();
        changed(&format!("{before}\"length_mm\": {value}}}"))
    };
    for value in ["null", "true", "\"100.0\"", "\"100,0\""] {
        assert_contains(&key(value), &["C100.jsonl:3", &format!("key `length_mm`: `{value}` is not a number")]);
    }
    assert_contains(&key("[100.0]"), &["C100.jsonl:3", "`a list` is not a number"]);
    assert_contains(&key("{}"), &["C100.jsonl:3", "`an object` is not a number"]);
    assert_contains(&key("1e400"), &["C100.jsonl:3", "infinite or too large"]);
    assert_contains(&key("NaN"), &["C100.jsonl:3", "not a JSON object", "at byte"]);
    assert_contains(&key("1.0, \"length_mm\": 1.0"), &["C100.jsonl:3", "key `length_mm` occurs twice"]);
    assert_contains(&key("1.0, \"a\": 1"), &["C100.jsonl:3", "key `a`, which the first object does not have"]);
    assert_contains(&changed("[1, 2]"), &["C100.jsonl:3", "not a JSON object", "expected an object"]);
    assert_contains(&changed("{\"run\": 1}"), &["C100.jsonl:3", "no key `time_s`", "write `null`"]);
    assert_contains(&changed("{}{}"), &["C100.jsonl:3", "not a JSON object: trailing characters"]);
    assert_contains(
        &error_text(with_lines("", &good.replace("c_deg", "c_degree"))),
        &["C100.jsonl:1", "unknown key `c_degree`", "did you mean `c_deg`?"],
    );
    assert_contains(&error_text(with_lines("", "{}\n")), &["C100.jsonl:1", "an object without keys"]);
    assert_contains(&error_text(with_lines("", "\n\n")), &["an empty data file"]);
}

#[test]
fn a_socket_is_named_by_a_text_or_a_number() {
    let text = "[machine]\nchain = \"w b C t\"\n[machine.axis.C]\n[instrument]\nkind = \"socket\"\n[[test]]\nname = \"T\"\n\
                data = \"T.ndjson\"\nball_mm = [0, 0, 100]\n";
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("session.toml"), text).unwrap();
    let data = "{\"c_deg\": 0, \"socket\": \"a\"}\n{\"c_deg\": 1, \"socket\": 7}\n\
                {\"c_deg\": 2, \"socket\": \"a\"}\n{\"c_deg\": 3, \"socket\": 7}\n";
    fs::write(folder.path().join("T.ndjson"), data).unwrap();
    let read = abbe_files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap();
    let names: Vec<&str> = read.tests.iter().map(|test| test.name.as_str()).collect();
    assert_eq!(names, ["T/a", "T/7"]);
}
