//! Trace on sessions of an independent simulator and on real robots. The program reads the readings only; the true
//! effects are in other files or in the literature.

use abbe::files::{self, ReadOptions};
use abbe::identify::fit::prepare;
use abbe::identify::model_file::{IdentifiedModel, Provenance};
use abbe::identify::results::TraceVerdict;
use abbe::model::session::Session;
use abbe::trace::result::{EffectName, TraceResult};
use abbe::trace::validate::validate;
use abbe::trace::{TraceOptions, trace};
use test_needs::data;

use crate::suite::identify::robots::session_on_public_data;
use crate::suite::identify::validate_command::ur10_series_b;
use crate::suite::{abbe, ready, text};

fn traced(session: &Session, options: &TraceOptions) -> TraceResult {
    trace(session, options, &|_| true).unwrap().result
}

/// A session of the samples beside the public data.
fn sample(test: &str, name: &str) -> Option<Session> {
    let folder = data(test, ".")?.join("../sample").join(name);
    Some(files::session(&folder.join("session.toml"), &ReadOptions::default()).unwrap())
}

fn is(effect: &EffectName, component: &str, shape: &str, order: Option<f64>) -> bool {
    effect.component == component && effect.shape == shape && effect.order == order
}

/// Whether an effect is named or is among the aliases of a named effect.
fn named_or_alias(result: &TraceResult, wanted: &dyn Fn(&EffectName) -> bool) -> bool {
    result.effects.iter().any(|effect| wanted(&effect.name) || effect.aliases.iter().any(|alias| wanted(&alias.name)))
}

#[test]
fn a_clean_session_has_the_verdict_clean() {
    let Some(session) = sample("a_clean_session_has_the_verdict_clean", "rotary-clean") else {
        return;
    };
    let result = traced(&session, &TraceOptions::default());
    assert_eq!(result.verdict, TraceVerdict::Clean);
    assert!(result.effects.is_empty() && !result.remainder.structured);
    assert_eq!(result.before.parameters, result.after.parameters);
}

/// Without an effect, additions lower the residual of the fitted readings but not that of the held-out readings:
/// nothing is claimed.
#[test]
fn without_an_effect_no_addition_lowers_the_held_out_error() {
    let Some(session) = sample("without_an_effect_no_addition_lowers_the_held_out_error", "rotary-clean") else {
        return;
    };
    let options = TraceOptions { significance: 0.99, max_effects: Some(6), ..TraceOptions::default() };
    let result = traced(&session, &options);
    assert!(result.effects.is_empty(), "{:?}", result.effects[0].name);
    assert!(!result.rejected_candidates.is_empty());
    for rejected in &result.rejected_candidates {
        assert!(rejected.heldout_decrease_um <= rejected.u_heldout_decrease_um, "{rejected:?}");
    }
    assert_eq!(result.verdict, TraceVerdict::Clean);
    let (before, after) = (result.before.fit.heldout_rms_um, result.after.fit.heldout_rms_um);
    assert!((after / before - 1.0).abs() < 1e-9, "{before} {after}");
}

#[test]
fn an_axial_motion_is_found_or_is_among_the_aliases() {
    let name = "an_axial_motion_is_found_or_is_among_the_aliases";
    let Some(session) = sample(name, "rotary-axial-h3") else {
        return;
    };
    let result = traced(&session, &TraceOptions::default());
    assert_eq!(result.verdict, TraceVerdict::Explained);
    assert_eq!(result.effects.len(), 1);
    assert!(named_or_alias(&result, &|effect| is(effect, "EZC", "harmonic", Some(3.0))));
    // At one ball radius it is confounded with a tilt of one order less (docs/reference/effects.md).
    assert!(named_or_alias(&result, &|effect| is(effect, "EAC", "harmonic", Some(2.0))));
    assert!(result.after.fit.heldout_rms_um < 0.32 && result.before.fit.heldout_rms_um > 0.6);
}

#[test]
fn lost_motion_is_found_with_its_amplitude() {
    let Some(session) = sample("lost_motion_is_found_with_its_amplitude", "circle-backlash-y") else {
        return;
    };
    let result = traced(&session, &TraceOptions::default());
    assert_eq!(result.verdict, TraceVerdict::Explained);
    assert_eq!(result.effects.len(), 1);
    assert!(is(&result.effects[0].name, "EYY", "backlash", None));
    let lost = &result.effects[0].parameters[0];
    // The simulated lost motion is 4 µm.
    assert!((lost.value - 4.0).abs() < 4.0 * lost.u, "{lost:?}");
}

/// At one radius EZC of order n is confounded with a tilt of order n − 1. A second radius separates them: to first
/// order the response to EZC does not depend on the radius, and that to the tilt is proportional to it.
#[test]
fn another_radius_is_proposed_to_separate_an_axial_motion_from_a_tilt() {
    let name = "another_radius_is_proposed_to_separate_an_axial_motion_from_a_tilt";
    let Some(folder) = data(name, ".") else {
        return;
    };
    let session = folder.join("../sample/rotary-axial-h3/session.toml");
    let out = tempfile::tempdir().unwrap();
    let json = out.path().join("trace.json");
    let outcome = abbe(&["trace", text(&session), "-q", "--json", text(&json)]);
    assert!(outcome.status.success());
    let result: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    let effect = &result["effects"][0];
    assert_eq!(effect["component"], "EZC");
    let separation = &effect["separation"];
    // Both tilts are equivalent: the first by name is proposed.
    assert_eq!(separation["from"]["component"], "EAC");
    assert_eq!(separation["from"]["order"], 2);
    // The ball of the session is at 100 mm.
    let test = effect["separated_by"].as_str().unwrap();
    let radius = test.split("radius ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    let radius_mm: f64 = radius.parse().unwrap();
    assert!((radius_mm - 100.0).abs() > 10.0, "{test}");
    assert!(separation["before_sigma"].as_f64().unwrap() < 1.0, "{separation}");
    assert!(separation["after_sigma"].as_f64().unwrap() > 10.0, "{separation}");
}

/// A tilt of A under the moment of a ball at y = R cos C on the table raises the ball by a · y² = a R² (1 + cos 2C) /
/// 2, as EZC of second order does at that phase. Gravity needs one coefficient, the harmonic two, and the two are
/// confounded.
#[test]
fn a_harmonic_is_listed_as_alias_of_a_compliance() {
    let folder = tempfile::tempdir().unwrap();
    let plan = folder.path().join("chapter5.toml");
    let machine = ready("hermle-c600u/machine.toml");
    std::fs::copy(machine, folder.path().join("machine.toml")).unwrap();
    let effect = "\n[[effect]]\ncomponent = \"EZC\"\nshape = \"harmonic\"\norder = 2\n";
    let declared = std::fs::read_to_string(ready("hermle-c600u/chapter5.toml")).unwrap() + effect;
    std::fs::write(&plan, declared).unwrap();
    let run = folder.path().join("run");
    let simulated = ["--effect", "EZC~C:h2.cos=1.5um", "--hide-effects", "--seed", "7"];
    let outcome = abbe(&[&["simulate", text(&plan), "--out", text(&run)], &simulated[..]].concat());
    assert!(outcome.status.success(), "{}", String::from_utf8_lossy(&outcome.stderr));
    let session = files::session(&run.join("session.toml"), &ReadOptions::default()).unwrap();
    let result = traced(&session, &TraceOptions::default());
    assert_eq!(result.effects.len(), 1);
    let gravity = |effect: &EffectName| effect.driver == "gravity";
    assert!(gravity(&result.effects[0].name), "{:?}", result.effects[0].name);
    assert!(named_or_alias(&result, &|effect| is(effect, "EZC", "harmonic", Some(2.0))));
}

#[test]
fn the_bundled_session_is_explained_at_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let (json, next) = (folder.path().join("trace.json"), folder.path().join("next.toml"));
    let session = ready("hermle-c600u/measured/session.toml");
    let outcome = abbe(&["trace", text(&session), "--json", text(&json), "--write", text(&next)]);
    assert!(outcome.status.success(), "{}", String::from_utf8_lossy(&outcome.stderr));
    assert!(String::from_utf8_lossy(&outcome.stdout).starts_with("Verdict: explained"));
    let result: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    for field in ["verdict", "noise_um", "before", "after", "effects", "remainder"] {
        assert!(!result[field].is_null(), "no field {field}");
    }
    for field in ["component", "driver", "shape", "order", "parameters", "p_value", "rms_gain_um", "aliases"] {
        assert!(!result["effects"][0][field].is_null(), "no field {field} in an effect");
    }
    let written = std::fs::read_to_string(&next).unwrap();
    assert!(written.contains("[[effect]]") && written.contains("EZC"), "{written}");
    // The written session is in another folder than machine and data; `--allow-outside` permits it to read them.
    let again = folder.path().join("fit.json");
    let refused = abbe(&["fit", text(&next), "-q"]);
    assert!(!refused.status.success());
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--allow-outside"));
    let outcome = abbe(&["fit", text(&next), "-q", "--allow-outside", "--json", text(&again)]);
    let stderr = String::from_utf8_lossy(&outcome.stderr);
    assert!(outcome.status.success(), "{stderr}");
    let fit: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&again).unwrap()).unwrap();
    let [traced, fitted] = [&result["after"], &fit].map(|model| model["rms_um"].as_f64().unwrap());
    assert!((traced - fitted).abs() < 1e-6, "{traced} {fitted}");
}

/// Rms length of the vector with the effects over held-out blocks of joint space and over random poses, mm.
fn held_out(result: &TraceResult) -> [f64; 2] {
    let model = &result.after.cross_validation;
    [model.extrapolation_rms_3d_um, model.interpolation_rms_3d_um].map(|um| um.unwrap() * 1e-3)
}

#[test]
fn ur10_has_a_curve_of_each_joint_and_compliances() {
    let name = "ur10_has_a_curve_of_each_joint_and_compliances";
    let Some(session) = session_on_public_data(name, "ur10/session.toml", "landgraf_ur10") else {
        return;
    };
    let options = TraceOptions { draws: 99, ..TraceOptions::default() };
    let outcome = trace(&session, &options, &|_| true).unwrap();
    let result = &outcome.result;
    let has = |component: &str, driver: &str, shape: &str| {
        let found = |name: &EffectName| name.component == component && name.driver == driver && name.shape == shape;
        result.effects.iter().any(|effect| found(&effect.name))
    };
    for (component, joint) in [("ECJ1", "J1"), ("EBJ2", "J2"), ("EBJ3", "J3"), ("EBJ4", "J4"), ("ECJ5", "J5")] {
        assert!(has(component, joint, "spectrum"), "{component}");
    }
    assert!(has("EBJ2", "gravity", "polynomial") && has("EBJ3", "gravity", "polynomial"));
    let [extrapolation, interpolation] = held_out(result);
    println!("UR10 with {} effects: {extrapolation:.4} mm, {interpolation:.4} mm", result.effects.len());
    assert!(extrapolation <= 0.18 && interpolation <= 0.10, "{extrapolation} {interpolation}");

    // A session that declares the effects has the same outliers, scales and estimates, whatever the search did before.
    let mut declared = session.clone();
    declared.effects.extend(outcome.effects.iter().cloned());
    let (problem, fit) = prepare(&declared, options.seed).unwrap();
    assert_eq!(problem.rejected, outcome.after.rejected);
    assert!((problem.noise.inflation / outcome.after.noise.inflation - 1.0).abs() < 1e-9);
    for ((a, b), size) in fit.beta.iter().zip(&outcome.after_fit.beta).zip(problem.parameters.sizes()) {
        assert!((a - b).abs() <= 1e-9 * size, "{a} {b}");
    }
    assert_eq!(fit.beta.len(), outcome.after_fit.beta.len());

    // Series B was not used for fitting, choosing or tuning.
    let model = IdentifiedModel::of_fit(&outcome.after, &outcome.after_fit, Provenance::default()).unwrap();
    let second = validate(&model, &ur10_series_b(name)).unwrap().result.model;
    let length_mm = second.residual.rms.rms_3d_um.unwrap() * 1e-3;
    let inside = second.in_range.as_ref().map_or(second.residual.coverage_95, |inside| inside.coverage_95);
    println!("UR10, Series B: {length_mm:.4} mm, {:.1} % inside the 95 % intervals in range", 100.0 * inside);
    assert!(length_mm <= 0.30 && (0.90..=0.98).contains(&inside), "{length_mm} {inside}");
}

#[test]
fn kuka_has_a_compliance_under_gravity_and_no_harmonics() {
    let name = "kuka_has_a_compliance_under_gravity_and_no_harmonics";
    let Some(session) = session_on_public_data(name, "kuka-iiwa14/session.toml", "mukca") else {
        return;
    };
    let result = traced(&session, &TraceOptions::default());
    assert!(result.effects.iter().any(|effect| effect.name.driver.starts_with("gravity")));
    assert!(result.effects.iter().all(|effect| effect.name.shape != "harmonic"));
    let [extrapolation, interpolation] = held_out(&result);
    println!("KUKA with {} effects: {extrapolation:.4} mm, {interpolation:.4} mm", result.effects.len());
    assert!(extrapolation <= 0.24 && interpolation <= 0.185, "{extrapolation} {interpolation}");
}
