//! Numbers at their limits: each agrees with a closed form or is refused with its location and the reason.
//!
//! The session is the simplest one: a bar between the rotating table and a stationary spindle ball. With the axis of C
//! displaced by `(x, y)` a ball at radius R reads `L = √((x − R·sin C)² + (y + R·cos C)²)`.

mod arguments;
mod map;
mod noise_and_priors;
mod numbers;
mod uninformative_readings;

use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use crate::suite::{abbe, text};

const MACHINE: &str = "chain = \"w C A b Y X Z t\"\n\n[axis.C]\n[axis.A]\n[axis.X]\n[axis.Y]\n[axis.Z]\n";

/// Displacement of the C axis, mm.
const X: f64 = 0.010;
const Y: f64 = -0.020;

/// A session whose parts a test changes one at a time.
struct Case {
    bar_mm: f64,
    /// The line of the noise in the file, or empty.
    noise: &'static str,
    errors: &'static str,
    /// Further keys of the test.
    more: &'static str,
    /// Positions of C in degrees, once per run.
    angles: Vec<f64>,
    runs: usize,
    /// Added to every reading, mm.
    longer_mm: f64,
}

impl Default for Case {
    fn default() -> Case {
        Case {
            bar_mm: 100.0,
            noise: "noise_um = 0.3",
            errors: "[\"EX0C\", \"EY0C\"]",
            more: "",
            angles: (0..36).map(|k| 10.0 * f64::from(k)).collect(),
            runs: 2,
            longer_mm: 0.0,
        }
    }
}

impl Case {
    fn length_mm(&self, angle_deg: f64) -> f64 {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        (X - self.bar_mm * sin).hypot(Y + self.bar_mm * cos) + self.longer_mm
    }

    fn data(&self) -> String {
        let mut data = String::from("run,c_deg,length_mm\n");
        for run in 1..=self.runs {
            for angle in &self.angles {
                data += &format!("{run},{angle:?},{:?}\n", self.length_mm(*angle));
            }
        }
        data
    }

    fn session(&self) -> String {
        format!(
            "[machine]\nfile = \"machine.toml\"\n\n[instrument]\nkind = \"ballbar\"\n{}\n\n[unknowns]\nerrors = {}\n\n\
             [[test]]\nname = \"C\"\ndata = \"C.csv\"\nbar_mm = {:?}\nworkpiece_ball_mm = [0, {:?}, 0]\n\
             spindle_ball_mm = [0, 0, 0]\n{}\n",
            self.noise, self.errors, self.bar_mm, self.bar_mm, self.more
        )
    }
}

fn folder(session: &str, data: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("machine.toml", MACHINE), ("session.toml", session), ("C.csv", data)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// Asserts that `abbe` refuses with these parts in its message.
#[track_caller]
fn refused(folder: &Path, command: &str, more: &[&str], parts: &[&str]) {
    let session = folder.join("session.toml");
    let output = abbe(&[&[command, text(&session)], more].concat());
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(output.stdout.is_empty(), "a result beside an error");
    for part in parts {
        assert!(stderr.contains(part), "`{part}` is not in\n{stderr}");
    }
}

/// The result of a successful fit.
#[track_caller]
fn fitted(session: &str, data: &str) -> Value {
    let folder = folder(session, data);
    let (session, json) = (folder.path().join("session.toml"), folder.path().join("fit.json"));
    let output = abbe(&["fit", text(&session), "--json", text(&json)]);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{stderr}");
    let mut result: Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    result["stderr"] = stderr.into();
    result
}

/// Value and uncertainty of a parameter.
#[track_caller]
fn found(result: &Value, id: &str) -> (f64, f64) {
    let parameters = result["parameters"].as_array().unwrap();
    let parameter = parameters.iter().find(|parameter| parameter["id"] == id);
    let parameter = parameter.unwrap_or_else(|| panic!("no {id} in {result:#}"));
    (parameter["value"].as_f64().unwrap(), parameter["u"].as_f64().unwrap())
}

/// Asserts that the fit finds the displacement of the axis, within µm.
#[track_caller]
fn displaced(result: &Value, within_um: f64) {
    for (id, wanted_mm) in [("EX0C", X), ("EY0C", Y)] {
        let (value, u) = found(result, id);
        assert!((value - 1e3 * wanted_mm).abs() <= within_um, "{id}: {value}");
        assert!(u > 0.0 && u.is_finite(), "{id}: u {u}");
    }
}

#[track_caller]
fn works(case: &Case) -> Value {
    let result = fitted(&case.session(), &case.data());
    displaced(&result, 1e-3);
    result
}

#[track_caller]
fn session_refused(case: &Case, parts: &[&str]) {
    refused(folder(&case.session(), &case.data()).path(), "fit", &[], parts);
}
