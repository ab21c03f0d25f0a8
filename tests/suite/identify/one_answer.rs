//! A trace and the fit of the session that it writes have the same model and state the same noise, rank and figures.

use std::fs;
use std::path::Path;

use serde_json::Value;
use test_needs::data;

use crate::suite::{abbe, ready, text};

/// Runs a command and asserts its success. Returns its standard output and its JSON.
fn run(arguments: &[&str], json: &Path) -> (String, Value) {
    let output = abbe(&[arguments, &["--json", text(json)]].concat());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    let document = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    (String::from_utf8(output.stdout).unwrap(), document)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// Asserts equal figures of the model. The written session holds the aliases, so that its uncertainties cover them too.
#[track_caller]
fn of_one_model(trace: &Value, fit: &Value) {
    for field in ["noise_source", "readings", "unobservable"] {
        assert_eq!(trace["after"][field], fit[field], "{field}");
    }
    let near = |a: f64, b: f64, within: f64| (a - b).abs() <= within * b.abs().max(1e-3);
    assert!(near(number(&trace["after"]["noise_um"]), number(&fit["noise_um"]), 1e-9));
    assert!(near(number(&trace["after"]["rms_um"]), number(&fit["rms_um"]), 1e-9));
    let [of_trace, of_fit] = [&trace["after"]["parameters"], &fit["parameters"]].map(|p| p.as_array().unwrap());
    assert_eq!(of_trace.len(), of_fit.len());
    assert!(!of_fit.is_empty());
    for (a, b) in of_trace.iter().zip(of_fit) {
        assert_eq!(a["id"], b["id"]);
        assert!(near(number(&a["value"]), number(&b["value"]), 1e-6), "{a} {b}");
        let (u, of_fit) = (number(&a["u"]), number(&b["u"]));
        assert!(near(u, of_fit, 1e-6), "{a} {b}");
    }
}

#[test]
fn trace_and_fit_agree_for_poses() {
    let Some(folder) =
        data("one_answer::trace_and_fit_agree_for_poses", "mukca").map(|found| found.parent().unwrap().to_owned())
    else {
        return;
    };
    let out = tempfile::tempdir().unwrap();
    for file in ["machine.toml", "session.toml"] {
        fs::copy(ready("kuka-iiwa14").join(file), out.path().join(file)).unwrap();
    }
    let at = |name: &str| out.path().join(name);
    let (session, next) = (at("session.toml"), at("next.toml"));
    let (printed, trace) = run(
        &["trace", text(&session), "--data", text(&folder), "--max-effects", "2", "--write", text(&next)],
        &at("trace.json"),
    );
    assert!(!trace["effects"].as_array().unwrap().is_empty());
    let (of_fit, fit) = run(&["fit", text(&next), "--data", text(&folder), "--allow-outside"], &at("fit.json"));
    of_one_model(&trace, &fit);
    // Neither calls the residual noise, and both state the residual of the model with the effects.
    assert_eq!(trace["after"]["noise_source"], "residual");
    let [before, after] = ["before", "after"].map(|model| number(&trace[model]["noise_um"]));
    assert!(after < before, "{before} {after}");
    for printed in [printed, of_fit] {
        let line = printed.lines().find(|line| line.contains(" readings, ")).unwrap();
        assert!(line.contains("residual of the declared model") && !line.contains(", noise"), "{line}");
    }
}

/// One run in each direction has no repeats. An effect of 5 µm remains in the residual of the declared model. The
/// residual of the found model is the simulated noise of 0.3 µm.
#[test]
fn trace_and_fit_agree_for_runs_without_repeats() {
    let out = tempfile::tempdir().unwrap();
    let at = |name: &str| out.path().join(name);
    let plan = fs::read_to_string(ready("hermle-c600u/chapter5.toml")).unwrap();
    let plan = plan
        .replace("step_deg = 0.25", "step_deg = 3")
        .replace("step_deg = 0.5", "step_deg = 6")
        .replace("runs = 2", "runs = 1");
    assert!(plan.contains("runs = 1"));
    fs::write(at("plan.toml"), plan + "\n[[effect]]\ncomponent = \"EZC\"\nshape = \"harmonic\"\norder = 2\n").unwrap();
    fs::copy(ready("hermle-c600u/machine.toml"), at("machine.toml")).unwrap();
    let simulated = abbe(&[
        "simulate",
        text(&at("plan.toml")),
        "--out",
        text(&at("run")),
        "--seed",
        "7",
        "--noise-um",
        "0.3",
        "--effect",
        "EZC~C:h2.amplitude=5um",
        "--hide-effects",
    ]);
    assert!(simulated.status.success(), "{}", String::from_utf8_lossy(&simulated.stderr));
    let session = at("run").join("session.toml");
    let written = fs::read_to_string(&session).unwrap();
    assert!(written.contains("noise_um = 0.3\n"));
    fs::write(&session, written.replace("noise_um = 0.3\n", "")).unwrap();
    let next = at("run").join("next.toml");
    let (_, trace) = run(&["trace", text(&session), "--max-effects", "1", "--write", text(&next)], &at("trace.json"));
    let (_, fit) = run(&["fit", text(&next)], &at("fit.json"));
    of_one_model(&trace, &fit);
    assert_eq!(trace["after"]["noise_source"], "residual");
    let before = number(&trace["before"]["noise_um"]);
    let after = number(&trace["after"]["noise_um"]);
    // Rounding to 0.1 µm adds 0.03 µm; the relative standard deviation of χ² is √(2/n).
    let sigma = 0.3_f64.hypot(0.1 / 12.0_f64.sqrt());
    let scatter = sigma / (2.0 * number(&trace["after"]["readings"])).sqrt();
    assert!((after - sigma).abs() < 5.0 * scatter, "{after} instead of {sigma} ± {scatter}");
    assert!(before > 2.0 * after, "{before} {after}");
}
