//! `abbe equation` of sessions that declare effects: the output, and the printed code against geometry by hand.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::suite::codegen::equation_command::{printed, refused};
use crate::suite::{ready, text};

const EFFECTS: &str = r#"
[[effect]]
component = "EZC"
driver = "C"
shape = "harmonic"
order = 2

[[effect]]
component = "bar"
shape = "warmup"
tau_s = 900

[[effect]]
component = "EBA"
driver = "A"
shape = "backlash"
tests = ["A150"]
"#;

/// The plan of chapter 5 with effects of its own.
fn session(folder: &Path, effects: &str) -> PathBuf {
    fs::copy(ready("hermle-c600u/machine.toml"), folder.join("machine.toml")).unwrap();
    let plan = fs::read_to_string(ready("hermle-c600u/chapter5.toml")).unwrap();
    let file = folder.join("session.toml");
    fs::write(&file, plan + effects).unwrap();
    file
}

#[test]
fn declared_effects_appear_where_they_act() {
    let folder = tempfile::tempdir().unwrap();
    let file = session(folder.path(), EFFECTS);
    let asked = |test: &'static str, more: &[&'static str]| {
        let start = ["equation", text(&file), "--test", test];
        printed(&[&start[..], more].concat())
    };
    let c100 = asked("C100", &[]);
    for part in ["e_zc  = k_1·cos(2·θ_c) + k_2·sin(2·θ_c)", "δ_bar = k_3·(1 − exp(−t/900))", "e_x0c", "EZC~C:h2.cos"]
    {
        assert!(c100.contains(part), "`{part}` is not in\n{c100}");
    }
    assert!(!c100.contains("EBA~A"), "{c100}");
    assert!(asked("A150", &[]).contains("(EBA~A:backlash[A150])"));
    // Effects that are not named are zero.
    let one = asked("C100", &["--errors", "EX0C,bar~time:warmup", "--order", "first"]);
    assert!(one.contains("exp(−t/900)"), "{one}");
    assert!(!one.contains("EZC") && !one.contains("θ_x0c"), "{one}");
    assert!(!asked("C100", &["--errors", "EZC"]).contains("EZC~C"));
    let refuse = |names: &'static str, parts: &[&str]| {
        let arguments = ["equation", text(&file), "--test", "C100", "--errors", names];
        refused(&arguments, parts);
    };
    refuse("EZC~C:h3", &["no effect is called `EZC~C:h3`", "EZC~C:h2, bar~time:warmup"]);
    refuse("EBA~A:backlash", &["no effect is called `EBA~A:backlash`"]);
    let long = session(folder.path(), "[[effect]]\ncomponent = \"EZC\"\nshape = \"curve\"\nintervals = 90\n");
    refused(&["equation", text(&long), "--test", "C100"], &["`EZC~C:curve` has 90 coefficients", "fewer intervals"]);
}

/// Python runs the printed code. The ball of the C test moves in Z by e = k₁ cos 2C + k₂ sin 2C on a radius of 100 mm,
/// and the bar expands by k₃ (1 − exp(−t/900)), so the reading is √(R² + e²) minus the expansion.
#[test]
fn printed_effects_run_unchanged() {
    let Some(python) = test_needs::python("printed_effects_run_unchanged", "numpy") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let file = session(folder.path(), EFFECTS);
    let module = folder.path().join("c100.py");
    let names = "EZC~C:h2,bar~time:warmup";
    let start = ["equation", text(&file), "--test", "C100", "--as", "python", "--gradient", "--layout", "flat"];
    printed(&[&start[..], &["--errors", names, "--out", text(&module)]].concat());
    let script = "
import math, c100
for c, t in [(0.0, 0.0), (0.7, 300.0), (2.0, 900.0), (-2.5, 5000.0)]:
    k = [0.3, -0.2, 0.05]
    value, gradient = c100.bar_length_gradient([100.0, 75.0, 75.0], [math.sin(c), math.cos(c), c, t], k)
    e = k[0] * math.cos(2 * c) + k[1] * math.sin(2 * c)
    warm = 1 - math.exp(-t / 900)
    length = math.hypot(100.0, e)
    assert abs(float(value) - (length - k[2] * warm)) < 1e-12 * length, value
    slopes = [e / length * math.cos(2 * c), e / length * math.sin(2 * c), -warm]
    for found, expected in zip(gradient, slopes):
        assert abs(float(found) - expected) < 1e-12, (gradient, slopes)
";
    let ran = Command::new(python).current_dir(folder.path()).args(["-c", script]).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
}
