//! Another build of the same sources gives the same output: every printed line, and the numbers of the JSON within
//! rounding.
//!
//! `ABBE_OTHER` names the other binary, such as `target/release/abbe`. The tests run only when they are asked for
//! (`-- --ignored`).

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::suite::ready;

/// Permitted relative difference of two builds: a ten-thousandth of the precision of any table.
const RELATIVE: f64 = 1e-7;
/// Permitted absolute difference, in the unit of the number: zeros may differ by rounding.
const ABSOLUTE: f64 = 1e-8;

fn other() -> PathBuf {
    let named = std::env::var_os("ABBE_OTHER").expect("ABBE_OTHER names the other binary");
    fs::canonicalize(&named).unwrap_or_else(|cause| panic!("ABBE_OTHER={}: {cause}", named.display()))
}

/// Collects the differences of two documents beyond rounding in `found`, and the largest difference within rounding in
/// `gap`.
fn differences(path: &str, a: &Value, b: &Value, found: &mut Vec<String>, gap: &mut f64) {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            let apart = (a - b).abs();
            let relative = apart / a.abs().max(b.abs()).max(f64::MIN_POSITIVE);
            if apart > ABSOLUTE && relative > RELATIVE {
                found.push(format!("{path}: {a} and {b}"));
            } else if apart > ABSOLUTE {
                *gap = gap.max(relative);
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (k, (a, b)) in a.iter().zip(b).enumerate() {
                differences(&format!("{path}[{k}]"), a, b, found, gap);
            }
        }
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => {
            for (key, a) in a {
                differences(&format!("{path}.{key}"), a, &b[key], found, gap);
            }
        }
        _ if a == b => {}
        _ => found.push(format!("{path}: {a} and {b}")),
    }
}

/// Runs commands with a build in a folder. Returns what each prints and the JSON that it writes to `out.json`.
fn outputs(binary: &Path, folder: &Path, commands: &[Vec<&str>]) -> Vec<(String, Value)> {
    commands
        .iter()
        .map(|arguments| {
            let json = folder.join("out.json");
            let output = Command::new(binary)
                .args(arguments)
                .args(["--json", "out.json"])
                .current_dir(folder)
                .output()
                .expect("the command starts");
            let message = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{arguments:?}: {message}");
            let document = serde_json::from_str(&fs::read_to_string(&json).unwrap()).unwrap();
            (String::from_utf8(output.stdout).unwrap(), document)
        })
        .collect()
}

/// Compares the outputs of both builds for a ready session with few readings; `more` is appended to its plan.
#[track_caller]
fn the_same(session: &str, more: &str, commands: &[Vec<&str>]) {
    let other = other();
    let copied = |binary: &Path| {
        let folder = tempfile::tempdir().unwrap();
        for entry in fs::read_dir(ready(session)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
            }
        }
        let plan = folder.path().join("chapter5.toml");
        if !more.is_empty() {
            // Coarse steps, so that a search takes seconds.
            let text = fs::read_to_string(&plan).unwrap();
            let text = text.replace("step_deg = 0.25", "step_deg = 3").replace("step_deg = 0.5", "step_deg = 6");
            fs::write(&plan, text + more).unwrap();
        }
        outputs(binary, folder.path(), commands)
    };
    let this = copied(Path::new(env!("CARGO_BIN_EXE_abbe")));
    for ((command, this), other) in commands.iter().zip(this).zip(copied(&other)) {
        let lines: Vec<_> = this.0.lines().zip(other.0.lines()).filter(|(a, b)| a != b).collect();
        assert!(lines.is_empty(), "{command:?}: {lines:#?}");
        assert_eq!(this.0.lines().count(), other.0.lines().count(), "{command:?}");
        let (mut found, mut gap) = (Vec::new(), 0.0);
        differences("", &this.1, &other.1, &mut found, &mut gap);
        assert!(found.is_empty(), "{command:?}: {found:#?}");
        println!(
            "{command:?}: {} lines alike, numbers of the JSON within {gap:.0e} of themselves",
            this.0.lines().count()
        );
    }
}

#[test]
#[ignore = "ABBE_OTHER names another build"]
fn measured_sessions() {
    for session in ["hermle-c600u", "table-and-head", "tilting-head"] {
        the_same(&format!("{session}/measured"), "", &[vec!["fit", "session.toml"], vec!["trace", "session.toml"]]);
    }
    the_same("r-test/measured", "", &[vec!["fit", "session.toml"]]);
    the_same("self-calibration/measured", "", &[vec!["fit", "session.toml", "--method", "self-calibration"]]);
}

#[test]
#[ignore = "ABBE_OTHER names another build"]
fn the_plan_of_chapter_5() {
    the_same("hermle-c600u", "", &[vec!["plan", "chapter5.toml"]]);
}

#[test]
#[ignore = "ABBE_OTHER names another build"]
fn a_simulated_axial_motion() {
    let effect = "EZC~C:h2.amplitude=1.5um";
    let plan = "chapter5.toml";
    the_same(
        "hermle-c600u",
        "\n[[effect]]\ncomponent = \"EZC\"\nshape = \"harmonic\"\norder = 2\n",
        &[
            vec![
                "simulate",
                plan,
                "--out",
                "run",
                "--draw-setups",
                "--seed",
                "7",
                "--error",
                "EY0A=35.3um",
                "--effect",
                effect,
                "--hide-effects",
            ],
            vec!["fit", "run/session.toml"],
            vec!["trace", "run/session.toml", "--seed", "7"],
        ],
    );
}
