//! The loop, closed: on sessions of an independent simulator and on real robots. The program gets the readings; what is in them stands in
//! other files, or was found by others.

use abbe::identify::results::{EffectName, TraceResult};
use abbe::identify::trace::{TraceOptions, trace};
use abbe::model::session::Session;
use abbe::model::session::read::{self, ReadOptions};

use super::data::data;
use super::robots::session_on_public_data;
use super::{abbe, ready, text};

fn traced(session: &Session, options: &TraceOptions) -> TraceResult {
    trace(session, options, &|_| true).unwrap().result
}

/// A session of the samples that lie beside the public data.
fn sample(test: &str, name: &str) -> Option<Session> {
    let folder = data(test, ".")?.join("../sample").join(name);
    Some(read::session(&folder.join("session.toml"), &ReadOptions::default()).unwrap())
}

fn is(effect: &EffectName, component: &str, shape: &str, order: Option<usize>) -> bool {
    effect.component == component && effect.shape == shape && effect.order == order
}

/// Whether an effect is named, or stands among the aliases of a named one.
fn named_or_alias(result: &TraceResult, wanted: &dyn Fn(&EffectName) -> bool) -> bool {
    result
        .effects
        .iter()
        .any(|effect| wanted(&effect.name) || effect.aliases.iter().any(wanted))
}

#[test]
fn a_clean_session_is_called_clean() {
    let Some(session) = sample("a_clean_session_is_called_clean", "rotary-clean") else {
        return;
    };
    let result = traced(&session, &TraceOptions::default());
    assert_eq!(result.verdict, "clean");
    assert!(result.effects.is_empty() && !result.remainder.structured);
    assert_eq!(result.before.parameters, result.after.parameters);
}

/// Made to add effects where there are none, a search gains on the readings that it sees and not on those that it does not: nothing is claimed.
#[test]
fn what_is_no_effect_does_not_lower_the_error_held_out() {
    let Some(session) = sample(
        "what_is_no_effect_does_not_lower_the_error_held_out",
        "rotary-clean",
    ) else {
        return;
    };
    let options = TraceOptions {
        significance: 0.99,
        max_effects: Some(6),
        ..TraceOptions::default()
    };
    let result = traced(&session, &options);
    assert!(result.effects.is_empty(), "{:?}", result.effects[0].name);
    assert!(!result.rejected_candidates.is_empty());
    for rejected in &result.rejected_candidates {
        assert!(
            rejected.heldout_decrease_um <= rejected.u_heldout_decrease_um,
            "{rejected:?}"
        );
    }
    assert_eq!(result.verdict, "clean");
    let (before, after) = (result.before.heldout_rms_um, result.after.heldout_rms_um);
    assert!((after / before - 1.0).abs() < 1e-9, "{before} {after}");
}

#[test]
fn an_axial_wobble_is_found_or_stands_among_what_looks_the_same() {
    let name = "an_axial_wobble_is_found_or_stands_among_what_looks_the_same";
    let Some(session) = sample(name, "rotary-axial-h3") else {
        return;
    };
    let result = traced(&session, &TraceOptions::default());
    assert_eq!(result.verdict, "explained");
    assert_eq!(result.effects.len(), 1);
    assert!(named_or_alias(&result, &|effect| is(
        effect,
        "EZC",
        "harmonic",
        Some(3)
    )));
    // One ball radius cannot tell it from a tilt of one order less (EFFECTS, METHOD).
    assert!(named_or_alias(&result, &|effect| is(
        effect,
        "EAC",
        "harmonic",
        Some(2)
    )));
    assert!(result.after.heldout_rms_um < 0.32 && result.before.heldout_rms_um > 0.6);
}

#[test]
fn lost_motion_is_found_with_its_size() {
    let Some(session) = sample("lost_motion_is_found_with_its_size", "circle-backlash-y") else {
        return;
    };
    let result = traced(&session, &TraceOptions::default());
    assert_eq!(result.verdict, "explained");
    assert_eq!(result.effects.len(), 1);
    assert!(is(&result.effects[0].name, "EYY", "backlash", None));
    let lost = &result.effects[0].parameters[0];
    // 4 µm were put in.
    assert!((lost.value - 4.0).abs() < 4.0 * lost.u, "{lost:?}");
}

/// EZC of order n looks like a tilt of order n − 1 at one radius; a second radius tells them apart (first order: the one is the same at all radii, the
/// other grows with the radius).
#[test]
fn another_radius_is_proposed_to_tell_an_axial_wobble_from_a_tilt() {
    let name = "another_radius_is_proposed_to_tell_an_axial_wobble_from_a_tilt";
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
    // Both tilts look the same: the first of them by name is told.
    assert_eq!(separation["from"]["component"], "EAC");
    assert_eq!(separation["from"]["order"], 2);
    // The session's ball sits at 100 mm.
    let test = effect["separated_by"].as_str().unwrap();
    let radius = test
        .split("radius ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next())
        .unwrap();
    let radius_mm: f64 = radius.parse().unwrap();
    assert!((radius_mm - 100.0).abs() > 10.0, "{test}");
    assert!(separation["before_sigma"].as_f64().unwrap() < 1.0, "{separation}");
    assert!(separation["after_sigma"].as_f64().unwrap() > 10.0, "{separation}");
}

/// A tilt of A under the moment of a ball that stands at y = R cos C on the table lifts it by a · y²  = a R² (1 + cos 2C) / 2, as EZC of second order does
/// with that phase. One number says it for gravity, two for a wave, and no reading tells them apart.
#[test]
fn a_wave_is_named_beside_a_compliance_that_looks_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let plan = folder.path().join("chapter5.toml");
    let machine = ready("hermle-c600u/machine.toml");
    std::fs::copy(machine, folder.path().join("machine.toml")).unwrap();
    let effect = "\n[[effect]]\ncomponent = \"EZC\"\nshape = \"harmonic\"\norder = 2\n";
    let declared = std::fs::read_to_string(ready("hermle-c600u/chapter5.toml")).unwrap() + effect;
    std::fs::write(&plan, declared).unwrap();
    let run = folder.path().join("run");
    let planted = ["--effect", "EZC~C:h2.cos=1.5um", "--hide-effects", "--seed", "7"];
    let outcome = abbe(&[&["simulate", text(&plan), "--out", text(&run)], &planted[..]].concat());
    assert!(
        outcome.status.success(),
        "{}",
        String::from_utf8_lossy(&outcome.stderr)
    );
    let session = read::session(&run.join("session.toml"), &ReadOptions::default()).unwrap();
    let result = traced(&session, &TraceOptions::default());
    assert_eq!(result.effects.len(), 1);
    let gravity = |effect: &EffectName| effect.driver == "gravity";
    assert!(gravity(&result.effects[0].name), "{:?}", result.effects[0].name);
    assert!(named_or_alias(&result, &|effect| is(
        effect,
        "EZC",
        "harmonic",
        Some(2)
    )));
}

#[test]
fn the_bundled_session_is_explained_at_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let (json, next) = (folder.path().join("trace.json"), folder.path().join("next.toml"));
    let session = ready("hermle-c600u/measured/session.toml");
    let outcome = abbe(&[
        "trace",
        text(&session),
        "--json",
        text(&json),
        "--write",
        text(&next),
    ]);
    assert!(
        outcome.status.success(),
        "{}",
        String::from_utf8_lossy(&outcome.stderr)
    );
    assert!(String::from_utf8_lossy(&outcome.stdout).starts_with("Verdict: explained"));
    let result: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    for field in ["verdict", "noise_um", "before", "after", "effects", "remainder"] {
        assert!(!result[field].is_null(), "no field {field}");
    }
    for field in [
        "component",
        "driver",
        "shape",
        "order",
        "parameters",
        "p_value",
        "rms_gain_um",
        "aliases",
    ] {
        assert!(
            !result["effects"][0][field].is_null(),
            "no field {field} in an effect"
        );
    }
    let written = std::fs::read_to_string(&next).unwrap();
    assert!(
        written.contains("[[effect]]") && written.contains("EZC"),
        "{written}"
    );
    // The written session lies elsewhere than machine and data, and finds them where it is let.
    let again = folder.path().join("fit.json");
    let refused = abbe(&["fit", text(&next), "-q"]);
    assert!(!refused.status.success());
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--allow-outside"));
    let outcome = abbe(&[
        "fit",
        text(&next),
        "-q",
        "--allow-outside",
        "--json",
        text(&again),
    ]);
    let said = String::from_utf8_lossy(&outcome.stderr);
    assert!(outcome.status.success(), "{said}");
    let fit: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&again).unwrap()).unwrap();
    let [traced, fitted] = [&result["after"], &fit].map(|model| model["rms_um"].as_f64().unwrap());
    assert!((traced - fitted).abs() < 1e-6, "{traced} {fitted}");
}

#[test]
fn ur10_shows_the_seventeenth_harmonic_of_its_second_joint_first() {
    let name = "ur10_shows_the_seventeenth_harmonic_of_its_second_joint_first";
    let Some(session) = session_on_public_data(name, "ur10/session.toml", "landgraf_ur10") else {
        return;
    };
    let options = TraceOptions {
        max_effects: Some(8),
        draws: 99,
        ..TraceOptions::default()
    };
    let result = traced(&session, &options);
    let first = &result.effects[0].name;
    assert_eq!(
        (first.component.as_str(), first.shape.as_str()),
        ("EBJ2", "harmonic"),
        "{first:?}"
    );
    assert!(first.order.unwrap().abs_diff(17) <= 1, "{first:?}");
    let held_out = result.after.heldout_rms_3d_um.unwrap() * 1e-3;
    println!(
        "UR10 with {} effects: {held_out:.4} mm held out",
        result.effects.len()
    );
    assert!(held_out <= 0.25, "{held_out}");
}

#[test]
fn kuka_gives_under_gravity_and_has_no_harmonics() {
    let name = "kuka_gives_under_gravity_and_has_no_harmonics";
    let Some(session) = session_on_public_data(name, "kuka-iiwa14/session.toml", "mukca") else {
        return;
    };
    let result = traced(&session, &TraceOptions::default());
    assert!(
        result
            .effects
            .iter()
            .any(|effect| effect.name.driver == "gravity")
    );
    assert!(
        result
            .effects
            .iter()
            .all(|effect| effect.name.shape != "harmonic")
    );
    let held_out = result.after.heldout_rms_3d_um.unwrap() * 1e-3;
    println!(
        "KUKA with {} effects: {held_out:.4} mm held out",
        result.effects.len()
    );
    assert!(held_out <= 0.185, "{held_out}");
}
