//! The trace patterns of single errors (thesis, Figs. 3.7 and 3.8) against the first order of its Eqs. 3.20 and 3.21.

use abbe::files::{self, ReadOptions};
use abbe::identify::patterns::{patterns, usual_sizes};

use crate::suite::{abbe, ready, text};

const R: f64 = 100.0;
const BARS: [f64; 2] = [99.9881, 149.9946];

/// `ΔL·L₀` for one unit of the error for the ball at (0, R, 0), the spindle ball at (−D, 0, 0), C at 0 (first order of
/// Eqs. 3.20, 3.21).
fn numerator(error: &str, a: f64, d: f64) -> f64 {
    match error {
        "EY0A" => R * a.cos(),
        "EZ0A" => R * a.sin(),
        "EB0A" => R * a.sin() * d,
        "EC0A" => -R * a.cos() * d,
        "EX0C" => d,
        "EY0C" => R,
        "EA0C" | "EB0C" => 0.0,
        other => panic!("{other}"),
    }
}

#[test]
fn the_patterns_of_the_a_axis_are_those_of_the_thesis() {
    let path = ready("hermle-c600u/chapter5.toml");
    let session = files::session(&path, &ReadOptions::default()).unwrap();
    let found = patterns(&session, &usual_sizes(&session)).unwrap();
    let mut compared = 0;
    for pattern in found.patterns.iter().filter(|p| p.test.starts_with('A')) {
        let (_, states) = found.tests.iter().find(|(name, _)| *name == pattern.test).unwrap();
        let axis = session.machine.axis_index("A").unwrap();
        // The ball is at R although the calibrated bar is slightly shorter: the length without errors is that of the
        // geometry.
        let d = match pattern.test.as_str() {
            "A100" => 0.0,
            _ => (BARS[1].powi(2) - R * R).sqrt(),
        };
        let length = R.hypot(d);
        let size = match pattern.unit.as_str() {
            "um" => 10.0,
            _ => 0.01_f64.to_radians() * 1e3,
        };
        for (a, deviation) in states.positions[axis].iter().zip(&pattern.deviations_um) {
            let expected = numerator(&pattern.error, *a, d) / length * size;
            assert!(
                (deviation - expected).abs() < 0.02,
                "{} {} at {a}: {deviation} {expected}",
                pattern.test,
                pattern.error
            );
            compared += 1;
        }
        // Fig. 3.7 (c), (d): without the extension the orientation errors do not change the circle.
        if pattern.test == "A100" && matches!(pattern.error.as_str(), "EB0A" | "EC0A") {
            assert!(pattern.largest_um < 1e-9);
        }
    }
    assert!(compared > 5000, "{compared}");
}

#[test]
fn the_file_holds_every_reading_of_every_error() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("patterns.csv");
    let session = ready("hermle-c600u/chapter5.toml");
    let output =
        abbe(&["plan", text(&session), "--patterns", text(&file), "--error", "e_y0a=10um", "--error", "bar[A150]=1um"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let screen = String::from_utf8(output.stdout).unwrap();
    assert!(screen.contains("A150  bar[A150]"), "{screen}");
    let written = std::fs::read_to_string(&file).unwrap();
    let mut lines = written.lines();
    assert_eq!(lines.next(), Some("test,error,size,unit,run,c_deg,a_deg,y_mm,x_mm,z_mm,deviation_um"));
    let mut bars = 0;
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), 11, "{line}");
        if cells[1] == "bar[A150]" {
            // A bar that is longer than stated reduces the readings by the same amount, in its own test only.
            let expected = if cells[0] == "A150" { "-1.000000" } else { "0.000000" };
            assert_eq!(cells[10], expected, "{line}");
            bars += 1;
        }
    }
    assert!(bars > 1000);
}

#[test]
fn invalid_patterns_are_refused_with_the_reason() {
    let session = ready("hermle-c600u/chapter5.toml");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("patterns.csv");
    let refused = |arguments: &[&str], part: &str| {
        let mut all = vec!["plan", text(&session), "--patterns", text(&file)];
        all.extend(arguments);
        let output = abbe(&all);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.contains(part), "{stderr}");
        assert!(!file.exists());
    };
    refused(&["--error", "EY0A"], "has no value");
    refused(&["--error", "EY0A=10"], "has no unit");
    refused(&["--error", "EY0B=10um"], "has no axis `B`");
    refused(&["--error", "EY0A=10arcsec"], "a unit such as `um` is expected");
    let alone = abbe(&["plan", text(&session), "--error", "EY0A=10um"]);
    assert_eq!(alone.status.code(), Some(2));
}
