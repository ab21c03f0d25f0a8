//! Bearings that precess: `trace` on the readings of a NumPy program that shares no kinematics with Abbe, against its
//! answer in a file of its own (`tests/precession`).

use std::path::Path;

use abbe::files::{self, ReadOptions};
use abbe::trace::result::{EffectResult, TraceResult};
use abbe::trace::{TraceOptions, trace};
use serde_json::Value;

fn traced(name: &str) -> (TraceResult, Value) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/precession");
    let session = files::session(&folder.join(format!("{name}.toml")), &ReadOptions::default()).unwrap();
    let answer: Value = serde_json::from_str(&std::fs::read_to_string(folder.join("answer.json")).unwrap()).unwrap();
    (trace(&session, &TraceOptions::default(), &|_| true).unwrap().result, answer[name].clone())
}

fn found<'r>(result: &'r TraceResult, component: &str, shape: &str) -> &'r EffectResult {
    let named = |effect: &&EffectResult| effect.name.component == component && effect.name.shape == shape;
    let names: Vec<_> = result.effects.iter().map(|effect| &effect.name).collect();
    result.effects.iter().find(named).unwrap_or_else(|| panic!("{component} {shape} in {names:?}"))
}

/// Amplitude and phase of a precession within four standard uncertainties. A phase φ of the answer is that of
/// cos(nq − φ), Abbe's is that of cos(nq + φ).
fn is_precession(effect: &EffectResult, answer: &Value, amplitude: &str) {
    let order = answer["order"].as_f64().unwrap();
    let signed = if answer["backward"].as_bool().unwrap() { -order } else { order };
    assert_eq!(effect.name.order, Some(signed));
    let [size, phase] = &effect.parameters[..] else { panic!("{:?}", effect.parameters) };
    let expected = answer[amplitude].as_f64().unwrap();
    println!("{} ± {} of {expected}, {} ± {}", size.value, size.u, phase.value, phase.u);
    assert!((size.value - expected).abs() < 4.0 * size.u && size.u < 0.1 * expected, "{size:?}");
    let off = phase.value + answer["phase_deg"].as_f64().unwrap();
    let off = off - 360.0 * (off / 360.0).round();
    assert!(off.abs() < 4.0 * phase.u && phase.u < 6.0, "{phase:?}");
}

/// A mount whose azimuth axis precesses and whose tube sags. Nothing else is claimed.
#[test]
fn a_precessing_azimuth_axis_is_named() {
    let (result, answer) = traced("mount");
    is_precession(found(&result, "EAAZ", "precession"), &answer["precession"], "amplitude_arcsec");
    let sag = &found(&result, "EBEL", "cosine").parameters[0];
    assert!((sag.value - answer["sag_arcsec"].as_f64().unwrap()).abs() < 4.0 * sag.u, "{sag:?}");
    assert_eq!(result.effects.len(), 2);
    let noise = answer["noise_arcsec"].as_f64().unwrap();
    assert!((result.after.fit.heldout_rms_um / noise - 1.0).abs() < 0.15, "{}", result.after.fit.heldout_rms_um);
}

/// A joint of a robot that moves on a circle, three times per turn.
#[test]
fn a_precessing_joint_of_a_robot_is_named() {
    let (result, answer) = traced("arm");
    is_precession(found(&result, "EXJ1", "precession"), &answer["precession"], "amplitude_um");
    assert_eq!(result.effects.len(), 1);
}
