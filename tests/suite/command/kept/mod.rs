//! Kept answers: everything that the commands print and write for small sessions, compared with `snapshots/kept__*`.
//!
//! Other tests show that an answer is right. These tests detect every change of an answer. Answers are the same on
//! every processor; `ABBE_RUNNER` checks that by running the command under an emulator. Numbers may differ by rounding,
//! or by one in the last printed digit. `cargo insta accept` accepts an intended change.

use std::ffi::OsStr;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

use insta::{Comparator, Snapshot};
use serde_json::Value;
use test_needs::data;

use crate::suite::ready;

/// Largest relative difference from a kept number.
const RELATIVE: f64 = 1e-6;
/// Largest absolute difference from a kept number: zeros are rounding.
const ABSOLUTE: f64 = 1e-7;

/// Number of entries that are kept of a longer list in a JSON document, evenly chosen.
const KEPT_OF_A_LIST: usize = 12;

/// Number of rows of a covariance matrix that are kept.
const KEPT_OF_A_MATRIX: usize = 3;

#[derive(Clone)]
struct ToRounding;

impl Comparator for ToRounding {
    fn matches(&self, kept: &Snapshot, now: &Snapshot) -> bool {
        match (kept.as_text(), now.as_text()) {
            (Some(kept), Some(now)) => alike(&kept.to_string(), &now.to_string()),
            _ => false,
        }
    }

    fn dyn_clone(&self) -> Box<dyn Comparator> {
        Box::new(self.clone())
    }
}

/// Whether two texts are the same but for the rounding of their numbers.
fn alike(kept: &str, now: &str) -> bool {
    let (kept, now) = (pieces(kept), pieces(now));
    kept.len() == now.len() && kept.iter().zip(&now).all(|(a, b)| a == b || numbers_alike(a, b))
}

/// A text in pieces: numbers, and what stands between them. Spaces that line columns up do not count.
fn pieces(text: &str) -> Vec<&str> {
    let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'e' | 'E');
    text.split_whitespace()
        .flat_map(|word| {
            let mut rest = word;
            std::iter::from_fn(move || {
                let first = rest.chars().next()?;
                let end = rest.find(|c| is_number(c) != is_number(first)).unwrap_or(rest.len());
                let (piece, after) = rest.split_at(end);
                rest = after;
                Some(piece)
            })
        })
        .collect()
}

/// Whether two pieces are numbers as near as rounding brings them.
fn numbers_alike(a: &str, b: &str) -> bool {
    let (Ok(x), Ok(y)) = (a.parse::<f64>(), b.parse::<f64>()) else {
        return false;
    };
    let last_place = |text: &str| {
        let mantissa = text.split(['e', 'E']).next().unwrap_or(text);
        let places = mantissa.split_once('.').map_or(0, |(_, places)| places.len());
        let exponent = text[mantissa.len()..].trim_start_matches(['e', 'E']);
        10f64.powi(exponent.parse::<i32>().unwrap_or(0) - places as i32)
    };
    // Whole numbers are counts.
    let printed = if a.contains('.') && b.contains('.') { last_place(a).max(last_place(b)) * 1.001 } else { 0.0 };
    let allowed = printed.max(ABSOLUTE).max(RELATIVE * x.abs().max(y.abs()));
    (x - y).abs() <= allowed && (a.contains('.') || b.contains('.') || x == y)
}

/// A JSON document as lines `path: value`, of long lists only some entries.
fn lines_of(path: &str, value: &Value, lines: &mut String) {
    match value {
        Value::Object(fields) => {
            fields.iter().for_each(|(key, value)| lines_of(&format!("{path}.{key}"), value, lines))
        }
        // The basis of a null space depends on the processor. The diagonal of the projector on it does not.
        Value::Array(directions) if path.ends_with(".null_directions") => {
            writeln!(lines, "{path}: {} directions", directions.len()).unwrap();
            let entry = |direction: &Value, k: usize| direction[k].as_f64().unwrap();
            let square = |k: usize| directions.iter().map(|direction| entry(direction, k).powi(2)).sum::<f64>();
            let parameters = directions.first().map_or(0, |direction| direction.as_array().unwrap().len());
            let diagonal = (0..parameters).map(|k| Value::from(square(k))).collect();
            lines_of(&format!("{path}.projector"), &Value::Array(diagonal), lines);
        }
        Value::Array(entries) => {
            let kept = if path.ends_with(".covariance.matrix") { KEPT_OF_A_MATRIX } else { KEPT_OF_A_LIST };
            let step = entries.len().div_ceil(kept).max(1);
            if step > 1 {
                writeln!(lines, "{path}: {} entries", entries.len()).unwrap();
            }
            for (k, entry) in entries.iter().enumerate().step_by(step) {
                lines_of(&format!("{path}[{k}]"), entry, lines);
            }
        }
        Value::Number(number) if number.is_f64() => {
            writeln!(lines, "{path}: {:.9e}", number.as_f64().unwrap()).unwrap();
        }
        // A checksum changes with the last digit of a simulated reading.
        Value::String(_) if path.ends_with(".sha256") => writeln!(lines, "{path}: SHA-256").unwrap(),
        other => writeln!(lines, "{path}: {other}").unwrap(),
    }
}

/// Contents of a file in readable form: JSON by paths, tables with as many rows as a list.
fn told(file: &Path) -> String {
    let text = fs::read_to_string(file).unwrap();
    let mut lines = String::new();
    match file.extension().and_then(|extension| extension.to_str()) {
        Some("json") => lines_of("", &serde_json::from_str(&text).unwrap(), &mut lines),
        Some("csv") => {
            let rows: Vec<&str> = text.lines().collect();
            let step = rows.len().div_ceil(KEPT_OF_A_LIST).max(1);
            writeln!(lines, "{} rows", rows.len()).unwrap();
            for (k, row) in rows.iter().enumerate() {
                if k % step == 0 || row.starts_with('#') {
                    writeln!(lines, "{row}").unwrap();
                }
            }
        }
        _ => lines = text,
    }
    lines
}

/// The command `abbe`, run by the program that `ABBE_RUNNER` names: `ABBE_RUNNER="qemu-x86_64 -cpu Nehalem"` answers as
/// a processor without AVX does, and `-cpu Haswell,-pcid,-x2apic,-tsc-deadline,-hle,-invpcid,-rtm` as one with AVX2 and
/// without AVX-512 (of what it lacks the emulator warns in the answer).
fn command_of_abbe() -> Command {
    let runner = std::env::var("ABBE_RUNNER").unwrap_or_default();
    let mut words = runner.split_whitespace();
    let Some(program) = words.next() else {
        return Command::new(env!("CARGO_BIN_EXE_abbe"));
    };
    let mut command = Command::new(program);
    command.args(words).arg(env!("CARGO_BIN_EXE_abbe"));
    command
}

/// Runs commands one after another in a folder with copies of a folder's files, and holds what they print and write to
/// what is kept. `DATA` among their words stands for the folder of public data.
#[track_caller]
fn kept(name: &str, folder_of_input: &Path, changed: &[(&str, String)], commands: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(folder_of_input).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
        }
    }
    for (file, text) in changed {
        fs::write(folder.path().join(file), text).unwrap();
    }
    let files = || {
        let mut found: Vec<_> = walk(folder.path());
        found.sort();
        found
    };
    let mut answer = String::new();
    let mut before = files();
    let wants_data = commands.iter().any(|command| command.contains("DATA"));
    let public = wants_data.then(|| data(name, "").expect("the caller looked for it"));
    for command in commands {
        let output = command_of_abbe()
            .args(command.split_whitespace().map(|word| match word {
                "DATA" => public.as_deref().map_or(OsStr::new(word), Path::as_os_str),
                other => OsStr::new(other),
            }))
            .current_dir(folder.path())
            .output()
            .expect("the command starts");
        let (printed, said) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{command}: {said}");
        writeln!(answer, "$ abbe {command}\n{printed}{said}").unwrap();
        let after = files();
        for file in after.iter().filter(|file| !before.contains(file)) {
            let path = file.strip_prefix(folder.path()).unwrap();
            writeln!(answer, "{}:\n{}", path.display(), told(file)).unwrap();
        }
        before = after;
    }
    // No path of this machine belongs into what is kept.
    if let Some(public) = &public {
        answer = answer.replace(&*public.to_string_lossy(), "DATA/");
    }
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path(crate::suite::workspace().join("snapshots"));
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.set_comparator(Box::new(ToRounding));
    settings.bind(|| insta::assert_snapshot!(format!("kept__{name}"), answer));
}

/// All files below a folder.
fn walk(folder: &Path) -> Vec<std::path::PathBuf> {
    fs::read_dir(folder)
        .unwrap()
        .flat_map(|entry| {
            let path = entry.unwrap().path();
            if path.is_dir() { walk(&path) } else { vec![path] }
        })
        .collect()
}

/// A plan of the Hermle in coarse steps.
fn coarse(plan: &str) -> String {
    fs::read_to_string(ready(&format!("hermle-c600u/{plan}")))
        .unwrap()
        .replace("step_deg = 0.25", "step_deg = 5")
        .replace("step_deg = 0.5", "step_deg = 10")
}

#[test]
fn rounding_is_alike_and_nothing_else_is() {
    assert!(alike("u 35.31  µm, 12", "u 35.32 µm, 12"));
    assert!(!alike("u 35.31 µm", "u 35.33 µm"));
    assert!(!alike("12 readings", "13 readings"));
    assert!(alike("a: 1.000000000e0", "a: 1.000000400e0"));
    assert!(!alike("a: 1.000000000e0", "a: 1.000002000e0"));
    assert!(alike("a: 1.000000000e-12", "a: -3.000000000e-9"));
    assert!(!alike("a: 1.000000000e0", "b: 1.000000000e0"));
    assert!(!alike("a: 1 b", "a: 1"));
}

#[test]
fn a_fit_by_each_method() {
    kept(
        "fit",
        &ready("hermle-c600u/measured"),
        &[],
        &[
            "fit session.toml --json fit.json --csv fit.csv",
            "fit session.toml --method cone --json cone.json",
            "fit session.toml --monte-carlo 10000 --coverage 0.9 --json drawn.json",
        ],
    );
    kept(
        "fit_chapter4",
        &ready("hermle-c600u"),
        // The noise follows from the repeated runs.
        &[("plan.toml", coarse("chapter4.toml").replace("noise_um = 0.3\n", ""))],
        &[
            "simulate plan.toml --out run --seed 4 --noise-um 0.4 --error EY0A=35.3um --error EB0A=-1.29arcsec --error EX0C=-4um --json run.json",
            "fit run/session.toml --method circle --json circle.json",
        ],
    );
    kept(
        "fit_chapter6",
        &ready("hermle-c600u"),
        &[("plan.toml", coarse("chapter6.toml"))],
        &[
            "simulate plan.toml --out run --draw-setups --seed 6 --error EY0A=35.3um --error EB0A=-1.29arcsec --error EA0C=3arcsec",
            "simulate plan.toml --out again --draw-setups --seed 7 --error EY0A=35.3um --error EB0A=-1.29arcsec --error EA0C=3arcsec",
            "fit run/session.toml --method two-plane --json two-plane.json",
            "compare run/session.toml again/session.toml --repeated --json repeated.json",
        ],
    );
}

#[test]
fn every_shape_of_an_effect() {
    kept(
        "effects",
        &crate::suite::workspace().join("tests/suite/command/kept"),
        &[],
        &[
            "plan plan.toml --no-effects --json plan.json",
            "simulate plan.toml --out run --seed 3 --noise-um 0.2 --values errors.toml --json run.json",
            "fit run/session.toml --json fit.json --csv fit.csv",
            "fit run/session.toml --save model.json",
            "export model.json --as linuxcnc-tables --out linuxcnc --places 9",
            "export model.json --as heidenhain-tables --out heidenhain --places 9",
            "export model.json --as beckhoff-tables --out beckhoff --places 9",
            "trace run/session.toml --max-effects 2 --only C --json trace.json",
            "trace run/session.toml --list --only :h2 --only backlash --only time",
            "equation plan.toml --test C --as python --layout flat --order bilinear --gradient",
        ],
    );
}

#[test]
fn a_trace() {
    for session in ["hermle-c600u", "table-and-head"] {
        kept(
            &format!("trace_{}", session.replace('-', "_")),
            &ready(&format!("{session}/measured")),
            &[],
            &[
                "trace session.toml --json trace.json --csv trace.csv --write next.toml",
                "fit next.toml --json fit.json",
            ],
        );
    }
}

#[test]
fn an_r_test() {
    kept(
        "rtest",
        &ready("r-test/measured"),
        &[],
        &[
            "fit session.toml --json fit.json --views views.csv",
            "trace session.toml --only ~C:h --only time --max-effects 2 --json trace.json",
        ],
    );
}

#[test]
fn a_self_calibration() {
    kept(
        "self_calibration",
        &ready("self-calibration/measured"),
        &[],
        &["fit session.toml --method self-calibration --monte-carlo 20000 --json fit.json"],
    );
}

#[test]
fn a_robot() {
    if data("a_robot", "mukca").is_some() {
        kept(
            "robot",
            &ready("kuka-iiwa14"),
            &[],
            &[
                "fit session.toml --data DATA --json fit.json",
                "trace session.toml --data DATA --max-effects 3 --json trace.json",
            ],
        );
    }
}

#[test]
fn a_plan() {
    kept(
        "plan",
        &ready("hermle-c600u"),
        &[("plan.toml", coarse("chapter5.toml"))],
        &[
            "plan plan.toml --json plan.json --range",
            "plan plan.toml --no-effects --setup-um 1 --noise-um 0.5 --one-spindle-ball --device-mm 60,300,120,80,60,20 --json known.json",
            "plan plan.toml --no-effects --improve 2 --bars-mm 50,100,150 --json improve.json",
            "plan plan.toml --no-effects --improve 1 --setup-min 5 --test-min 2 --remount-spindle-ball --no-follow --json minutes.json",
            "plan plan.toml --no-effects --separate EZC~C:h2,EAC~C:h1 --bars-mm 100,150 --json separate.json",
            "plan plan.toml --no-effects --patterns patterns.csv --error EY0A=10um --error EB0A=0.01deg",
        ],
    );
    kept("plan_rtest", &ready("r-test"), &[], &["plan plan.toml --no-effects --json plan.json"]);
}

#[test]
fn a_map() {
    kept(
        "map",
        &ready("volumetric"),
        &[],
        &[
            "volumetric machine.toml --map map.csv --functions errors.toml --places 3 --correction --json map.json",
            "volumetric machine.toml --order first --errors EX0C,EXX,EAX",
        ],
    );
}
