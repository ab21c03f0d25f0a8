//! Tests of user errors in a session, one test each. The message names the file, the line and what to do.

mod document;
mod driver_columns;
mod foreign;
mod hostile;
mod instrument;
mod json_lines;
mod machine;
mod session;
mod table;
mod telescope;

use std::fs;

use abbe_files::ReadOptions;
use abbe_model::Diagnostic;
use abbe_model::session::Session;

const MACHINE: &str = r#"name = "Small"
chain = "w C A b Y X Z t"

[axis.C]
direction = [0, 0, 1]

[axis.A]
direction = [1, 0, 0]

[axis.X]
[axis.Y]
[axis.Z]
"#;

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

/// Reads a session from three files.
fn session(machine: &str, session: &str, data: Option<&str>) -> Result<Session, Diagnostic> {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("machine.toml", machine);
    write("session.toml", session);
    if let Some(data) = data {
        write("C100.csv", data);
    }
    abbe_files::session(&folder.path().join("session.toml"), &ReadOptions::default())
}

/// The session before its tests.
fn without_tests() -> &'static str {
    &SESSION[..SESSION.find("[[test]]").unwrap()]
}

/// The error as `file:line: message | help`, the file without its folder.
fn error_text(result: Result<Session, Diagnostic>) -> String {
    let fault = result.expect_err("this input is bad");
    let location = fault.location().expect("a location in a file").clone();
    let name = location.file.file_name().unwrap().to_string_lossy().into_owned();
    let message = fault.to_string().replace(&location.to_string(), &name);
    format!("{name}:{} {message} | {}", location.line, fault.help().unwrap_or(""))
}

#[track_caller]
fn assert_contains(error_text: &str, parts: &[&str]) {
    for part in parts {
        assert!(error_text.contains(part), "`{part}` is not in\n{error_text}");
    }
}

fn with_session(from: &str, to: &str) -> String {
    assert!(SESSION.contains(from), "{from}");
    error_text(session(MACHINE, &SESSION.replacen(from, to, 1), Some(DATA)))
}

fn with_data(data: &str) -> String {
    error_text(session(MACHINE, SESSION, Some(data)))
}

fn with_machine(from: &str, to: &str) -> String {
    assert!(MACHINE.contains(from), "{from}");
    error_text(session(&MACHINE.replacen(from, to, 1), SESSION, Some(DATA)))
}

#[test]
fn the_valid_session_reads() {
    let read = session(MACHINE, SESSION, Some(DATA)).unwrap();
    assert_eq!(read.tests[0].readings.as_ref().unwrap().rows(), 4);
}
