//! What a comparison may claim: a session that hides an effect is not judged, and a change is no error that remains.

use std::path::Path;

use serde_json::Value;

use crate::plant::recipe::TrueValue;
use crate::plant::{AxisName, Component, Driver, Freedom, Injected, Kind, Recipe, Shape};
use crate::suite::{abbe, text};

/// A measured session of the independent simulator, with given values of some parameters; the others follow from the seed.
fn written(folder: &Path, name: &str, recipe: &Recipe, given: &[(&str, f64)]) -> std::path::PathBuf {
    let value = |id: &str| given.iter().find(|(own, _)| *own == id).map(|(_, value)| *value);
    recipe.draw_of(&recipe.plan(), value).write(&folder.join(name)).unwrap();
    folder.join(name).join("session.toml")
}

fn compared(inputs: [&Path; 2]) -> (Value, String) {
    let json = inputs[0].with_file_name("compared.json");
    let run = abbe(&["compare", text(inputs[0]), text(inputs[1]), "--json", text(&json)]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    (serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap(), String::from_utf8(run.stdout).unwrap())
}

/// The same machine, while the position of A in Z drifts by 40 µm.
fn drifting(clean: &Recipe) -> Recipe {
    let position = Component::Location(Freedom::Z, AxisName::A);
    clean.clone().with(Injected::new(position, Driver::Time, Shape::Drift, 40.0))
}

fn succeeds(arguments: &[&str]) {
    let run = abbe(arguments);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
}

/// The machine is the same in both sessions; the second one drifts while it is measured.
#[test]
fn a_session_that_hides_a_drift_judges_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let clean = Recipe::new(Kind::Rotary, 11).readings(600);
    let before = written(folder.path(), "before", &clean, &[]);
    let after = written(folder.path(), "after", &drifting(&clean), &[]);
    let (found, screen) = compared([&before, &after]);
    assert_eq!(found["pairs"][0]["judged"], false);
    assert_eq!(found["statements"]["good"]["not_judged"], serde_json::json!([text(&after)]));
    assert_eq!(found["statements"]["measure"]["step"], "trace");
    for difference in found["differences"].as_array().unwrap() {
        assert_eq!(difference["significant"], false, "{difference}");
    }
    assert!(screen.contains("the differences are not judged.") && !screen.contains("significant"), "{screen}");
    // Nor does the volumetric error rise or fall by less than its uncertainty.
    let volume = |k: usize, key: &str| found["workspace"][k][key].as_f64().unwrap();
    let within = 2.0 * volume(0, "u_um").hypot(volume(1, "u_um"));
    assert!((volume(0, "rms_um") - volume(1, "rms_um")).abs() < within, "{screen}");
    assert!(screen.contains("µm rms, the same within its uncertainty;"), "{screen}");
    let command = format!("abbe trace {} --write", text(&after));
    assert!(screen.contains(&command), "{screen}");
    // A model of the session says so too.
    let model = folder.path().join("model.json");
    succeeds(&["fit", text(&after), "--save", text(&model), "--quiet"]);
    let (found, _) = compared([&before, &model]);
    assert_eq!(found["pairs"][0]["judged"], false);
}

/// The printed command traces the session that hides a drift. Errors and bars are the same in both sessions, and the balls are
/// mounted again: the drift alone differs.
#[test]
fn a_session_whose_drift_is_traced_differs_by_the_drift_alone() {
    let folder = tempfile::tempdir().unwrap();
    let clean = Recipe::new(Kind::Rotary, 15).readings(600);
    let truth = clean.draw().truth;
    let stays = |own: &&TrueValue| !own.is_setup || own.id.starts_with("bar");
    let kept: Vec<(&str, f64)> = truth.unknowns.iter().filter(stays).map(|own| (&*own.id, own.value)).collect();
    let before = written(folder.path(), "before", &clean, &[]);
    let after = written(folder.path(), "after", &Recipe { seed: 16, ..drifting(&clean) }, &kept);
    let traced = after.with_file_name("traced.toml");
    let (_, screen) = compared([&before, &after]);
    let command = ["trace", text(&after), "--write", text(&traced)];
    assert!(screen.contains(&format!("abbe {} ", command.join(" "))), "{screen}");
    succeeds(&command);
    let (found, screen) = compared([&before, &traced]);
    let differences = found["differences"].as_array().unwrap();
    let significant: Vec<&Value> = differences.iter().filter(|own| own["significant"] == true).collect();
    let [drift] = significant[..] else { panic!("{screen}") };
    assert_eq!(drift["id"], "EZ0A~time:drift", "{screen}");
    let um_per_h = 40.0 * 3600.0 / clean.plan().instants.last().unwrap().time_s;
    let [value, u] = ["value", "u"].map(|key| drift[key].as_f64().unwrap());
    assert!((value - um_per_h).abs() < 3.0 * u, "{um_per_h}: {drift}");
    // Of saved models too.
    let models = [&before, &after].map(|session| {
        let model = session.with_file_name("model.json");
        succeeds(&["trace", text(session), "--save", text(&model), "--quiet"]);
        model
    });
    let (found, screen) = compared([&models[0], &models[1]]);
    let pair = &found["pairs"][0];
    assert_eq!((&pair["judged"], &pair["significant"]), (&true.into(), &0.into()), "{screen}");
}

/// A model of a session that hides a drift validates nothing: what it lacks is in every difference. That of the printed command
/// does.
#[test]
fn a_model_that_lacks_an_effect_says_nothing_of_what_moved() {
    let folder = tempfile::tempdir().unwrap();
    let clean = Recipe::new(Kind::Rotary, 11).readings(600);
    let before = written(folder.path(), "before", &clean, &[]);
    let after = written(folder.path(), "after", &drifting(&clean), &[]);
    let [model, traced, json] = ["model.json", "traced-model.json", "v.json"].map(|name| after.with_file_name(name));
    succeeds(&["fit", text(&after), "--save", text(&model), "--quiet"]);
    let validated = |model: &Path| -> (Value, String) {
        let run = abbe(&["validate", text(model), text(&before), "--json", text(&json)]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        (serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap(), String::from_utf8(run.stdout).unwrap())
    };
    let (found, screen) = validated(&model);
    assert_eq!((&found["moved"], &found["statements"]["measure"]["step"]), (&serde_json::json!([]), &"trace".into()));
    assert_eq!(found["not_judged"]["session"], text(&after));
    assert!(found["not_judged"]["birge_ratio"].as_f64().unwrap() > 1.0 && found["statements"]["changed"].is_null());
    assert!(
        screen.contains("What has changed: not judged, because of the model (") && !screen.contains("moved by"),
        "{screen}"
    );
    let command = ["trace", text(&after), "--save", text(&traced)];
    assert!(screen.contains(&format!("abbe {}", command.join(" "))), "{screen}");
    succeeds(&command);
    let (found, screen) = validated(&traced);
    assert!(found["not_judged"].is_null() && !screen.contains("not judged"), "{screen}");
}

/// A machine before and after its correction: what changed is not what to correct, and the volumetric error falls.
#[test]
fn a_correction_is_a_change_by_which_the_error_falls() {
    let folder = tempfile::tempdir().unwrap();
    let recipe = Recipe::new(Kind::Rotary, 12).readings(600);
    let errors = ["EX0C", "EY0C", "EY0A", "EZ0A"];
    let large = errors.map(|id| (id, 40.0));
    let small = errors.map(|id| (id, 1.0));
    let before = written(folder.path(), "before", &recipe, &large);
    let after = written(folder.path(), "after", &Recipe { seed: 13, ..recipe }, &small);
    let (found, screen) = compared([&before, &after]);
    let rms = found["statements"]["good"]["volumetric_rms_um"].as_array().unwrap();
    let [before_um, after_um] = [&rms[0], &rms[1]].map(|rms| rms.as_f64().unwrap());
    assert!(after_um < 0.7 * before_um, "{rms:?}");
    assert_eq!(found["statements"]["correct"], serde_json::json!([]));
    assert!(!found["statements"]["changed"].as_array().unwrap().is_empty());
    let first = screen.lines().next().unwrap();
    let volume = format!("the volumetric error falls from {before_um:.2} to {after_um:.2} \u{b5}m rms");
    assert!(first.contains(&volume), "{first}");
    let place = |words: &str| screen.find(words).unwrap_or_else(|| panic!("{words} in {screen}"));
    assert!(place("What has changed: ") < place("What to correct: nothing from a change alone"));
}
