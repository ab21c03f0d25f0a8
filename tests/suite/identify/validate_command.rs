//! `abbe fit --save`, `--base` and `abbe validate`: on simulated sessions, on a UR10, and on input that cannot be used.

use std::path::{Path, PathBuf};

use abbe::files::{self, ReadOptions};
use abbe::identify::fit::base::{Gauge, base_parameters, report};
use abbe::identify::fit::prepare;
use abbe::identify::model_file::{IdentifiedModel, Provenance};
use abbe::model::session::Session;
use abbe::trace::validate::validate;
use serde_json::{Value, json};

use crate::suite::identify::robots::session_on_public_data;
use crate::suite::{abbe, ready, text};

/// Series B of the UR10: other poses on another day.
pub(super) fn ur10_series_b(test: &str) -> Session {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(ready("ur10/session.toml")).unwrap();
    let series_b = text.replace("Series_A/measurements_grid.csv", "Series_B/measurements_joint_configurations.csv");
    let file = folder.path().join("session.toml");
    std::fs::write(&file, series_b).unwrap();
    std::fs::copy(ready("ur10/machine.toml"), folder.path().join("machine.toml")).unwrap();
    let data = test_needs::data(test, "landgraf_ur10").unwrap().parent().unwrap().to_path_buf();
    files::session(&file, &ReadOptions { data_directory: Some(data), ..ReadOptions::default() }).unwrap()
}

/// A folder with two simulated sessions of one machine, each with its own set-up, and the model of the first.
fn simulated() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let plan = ready("hermle-c600u/chapter5.toml");
    let run = |name: &str, seed: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let arguments = ["simulate", text(&plan), "--out", text(&out), "--draw-setups", "--seed", seed];
        let errors = ["--error", "EY0A=35.3um", "--error", "EB0A=-1.29arcsec", "--quiet"];
        let run = abbe(&[&arguments[..], &errors[..], more].concat());
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        out.join("session.toml")
    };
    let first = run("first", "1", &["--error", "EX0C=12um"]);
    let second = run("second", "2", &["--error", "EX0C=12um"]);
    run("changed", "3", &["--error", "EX0C=42um"]);
    let model = folder.path().join("model.json");
    let saved = abbe(&["fit", text(&first), "--save", text(&model), "--quiet"]);
    assert!(saved.status.success(), "{}", String::from_utf8_lossy(&saved.stderr));
    (folder, model, second)
}

fn validated(model: &Path, session: &Path) -> Value {
    let run = abbe(&["validate", text(model), text(session), "--json", "-"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    serde_json::from_slice(&run.stdout).unwrap()
}

fn schema(subject: &str) -> jsonschema::Validator {
    let schema: Value = serde_json::from_slice(&abbe(&["schema", subject]).stdout).unwrap();
    jsonschema::validator_for(&schema).unwrap()
}

#[test]
fn a_model_holds_on_another_set_up_and_a_change_is_named() {
    let (folder, model, second) = simulated();
    let saved: Value = serde_json::from_slice(&std::fs::read(&model).unwrap()).unwrap();
    assert!(schema("model").is_valid(&saved));
    let result = validated(&model, &second);
    assert!(schema("validate").is_valid(&result), "{result:#}");
    assert_eq!(result["verdict"], "holds", "{result:#}");
    assert_eq!(result["moved"], json!([]));
    assert_eq!(result["readings"], result["readings_in_range"]);
    // The set-up absorbs part of the location errors, at the cost of its priors.
    let ratio = |key: &str| result[key]["noise_ratio"].as_f64().unwrap();
    assert!(ratio("nominal") > 1.2 && ratio("model") < 1.05, "{result:#}");
    let coverage = result["model"]["coverage_95"].as_f64().unwrap();
    assert!((0.90..=0.98).contains(&coverage), "{coverage}");
    let files: Vec<&str> = result["inputs"].as_array().unwrap().iter().filter_map(|i| i["file"].as_str()).collect();
    assert_eq!(files, [text(&model)]);

    let changed = validated(&model, &folder.path().join("changed/session.toml"));
    assert_ne!(changed["verdict"], "holds");
    assert_eq!(changed["moved"][0]["id"], "EX0C", "{changed:#}");
    let [value, u] = ["value", "u"].map(|key| changed["moved"][0][key].as_f64().unwrap());
    assert!((value - 30.0).abs() < 4.0 * u, "{value} {u}");
    assert!(changed["moved"][0]["p_value"].as_f64().unwrap() < 0.01);

    let report = folder.path().join("validate.html");
    let csv = folder.path().join("validate.csv");
    let plots = folder.path().join("plots");
    let run = abbe(&[
        "validate",
        text(&model),
        text(&second),
        "--report",
        text(&report),
        "--csv",
        text(&csv),
        "--plots",
        text(&plots),
    ]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let screen = String::from_utf8(run.stdout).unwrap();
    assert!(screen.starts_with("Verdict: holds. "), "{screen}");
    assert!(std::fs::read_to_string(&report).unwrap().contains("Residual of each machine"));
    assert!(std::fs::read_to_string(&csv).unwrap().contains("residual,model"));
    assert!(std::fs::read_dir(&plots).unwrap().count() >= 3);
}

#[test]
fn the_base_is_printed_with_what_is_held() {
    let session = ready("hermle-c600u/measured/session.toml");
    let run = abbe(&["fit", text(&session), "--base"]);
    let screen = String::from_utf8(run.stdout).unwrap();
    assert!(screen.contains("Base parameters with standard uncertainty u"), "{screen}");
    assert!(screen.contains("No parameter is held at nominal"), "{screen}");
    let run = abbe(&["fit", text(&session), "--base", "--method", "cone"]);
    assert_eq!(run.status.code(), Some(2));
}

#[test]
fn what_cannot_be_validated_is_refused_and_nothing_is_written() {
    let (folder, model, second) = simulated();
    let edited = folder.path().join("edited.json");
    let original = std::fs::read_to_string(&model).unwrap();
    let place = original.find("\"internal\": ").unwrap() + 12;
    let end = place + original[place..].find(',').unwrap();
    std::fs::write(&edited, format!("{}0.5{}", &original[..place], &original[end..])).unwrap();
    let newer = folder.path().join("newer.json");
    std::fs::write(&newer, original.replace("\"schema_version\": 1", "\"schema_version\": 9")).unwrap();
    let wrong = folder.path().join("wrong.json");
    let held = original.find("\"held\": false").unwrap();
    std::fs::write(&wrong, format!("{}\"held\": 0{}", &original[..held], &original[held + 13..])).unwrap();
    let other = ready("table-and-head/measured/session.toml");
    let plan = ready("hermle-c600u/chapter5.toml");
    let missing = folder.path().join("none.json");
    for (model, session, expected) in [
        (&second, &model, "this is a session or machine file, not a model"),
        (&edited, &second, "changed after it was saved"),
        (&newer, &second, "`schema_version` is 9"),
        (&wrong, &second, "`parameters[0].held` is a number; true or false is expected"),
        (&model, &other, "the model is of another machine than the session: the chain is"),
        (&model, &plan, "no readings"),
        (&missing, &second, "cannot be read"),
    ] {
        let result = folder.path().join("result.json");
        let run = abbe(&["validate", text(model), text(session), "--json", text(&result)]);
        let message = String::from_utf8_lossy(&run.stderr).to_string();
        assert_eq!(run.status.code(), Some(1), "{message}");
        assert!(message.contains(expected), "{message}\nexpected {expected}");
        assert!(!result.exists());
    }
    // No output replaces an input.
    for output in [&model, &second] {
        let before = std::fs::read(output).unwrap();
        let run = abbe(&["validate", text(&model), text(&second), "--json", text(output)]);
        assert_eq!(run.status.code(), Some(1));
        assert_eq!(std::fs::read(output).unwrap(), before);
    }
    let run = abbe(&["fit", text(&second), "--save", text(&second)]);
    assert_eq!(run.status.code(), Some(1));
}

/// Tables of at most 30 numbers for the errors of the machine, the same predictions under three gauges, and the length
/// of the residual vector of location errors on Series B, as an independent program gives it.
#[test]
fn ur10_base_parameters_and_series_b() {
    let name = "ur10_base_parameters_and_series_b";
    let Some(session) = session_on_public_data(name, "ur10/session.toml", "landgraf_ur10") else {
        return;
    };
    let (problem, fit) = prepare(&session, 1).unwrap();
    for gauge in [Gauge::OwnDirection, Gauge::Identifier, Gauge::SetUp] {
        let base = base_parameters(&problem, &fit, gauge).unwrap();
        assert!(base.prediction_change_mm < 1e-9, "{gauge:?}: {:e}", base.prediction_change_mm);
    }
    let base = report(&problem, &fit).unwrap();
    let is_error = |id: &str| problem.parameters.list.iter().any(|p| p.id.is_error() && p.id.to_string() == id);
    let errors = base.parameters.iter().filter(|parameter| is_error(&parameter.id));
    let errors: Vec<_> = errors.collect();
    assert!(errors.len() <= 30 && errors.iter().all(|parameter| parameter.u > 0.0), "{}", errors.len());

    let model = IdentifiedModel::of_fit(&problem, &fit, Provenance::default()).unwrap();
    let second = ur10_series_b(name);
    let result = validate(&model, &second).unwrap().result;
    let length_mm = result.model.residual.rms.rms_3d_um.unwrap() * 1e-3;
    println!("UR10, location errors of Series A on Series B: {length_mm:.4} mm, {}", result.verdict);
    assert!((length_mm - 0.499).abs() < 0.008, "{length_mm}");
    assert!(result.readings_in_range < result.readings && !result.outside.is_empty());
}

#[test]
fn kuka_base_parameters() {
    let name = "kuka_base_parameters";
    let Some(session) = session_on_public_data(name, "kuka-iiwa14/session.toml", "mukca") else {
        return;
    };
    let (problem, fit) = prepare(&session, 1).unwrap();
    for gauge in [Gauge::OwnDirection, Gauge::Identifier, Gauge::SetUp] {
        let base = base_parameters(&problem, &fit, gauge).unwrap();
        assert!(base.prediction_change_mm < 1e-9, "{gauge:?}: {:e}", base.prediction_change_mm);
    }
    let base = report(&problem, &fit).unwrap();
    let is_error = |id: &str| problem.parameters.list.iter().any(|p| p.id.is_error() && p.id.to_string() == id);
    assert!(base.parameters.iter().filter(|parameter| is_error(&parameter.id)).count() <= 30);
}
