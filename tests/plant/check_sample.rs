//! Tests of the plant against the samples of another independent simulator: conventions, signs and schedule.

use super::component::{AxisName, Component, Freedom};
use super::effect::{Driver, Injected, Shape};
use super::kind::Kind;
use super::machine::Machine;
use super::noise::Noise;
use super::oracle::Oracle;
use super::plan::Plan;
use super::recipe::{Row, SimulatedSession, Truth};
use serde_json::Value;
use std::path::PathBuf;

fn samples() -> PathBuf {
    test_needs::data_folder().join("../sample")
}

fn samples_exist(test: &str) -> bool {
    test_needs::data(test, "../sample").is_some()
}

/// The plan of a sample: one traversal forward, one backward.
fn plan(kind: Kind, step_deg: f64) -> Plan {
    let mut tests = kind.tests(step_deg);
    for test in &mut tests {
        test.traversals = 2;
    }
    Plan::of_tests(kind, Machine::default(), tests, false)
}

fn truth(name: &str) -> Value {
    let text = std::fs::read_to_string(samples().join("truth").join(format!("{name}.json"))).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The readings of a sample, after a comparison of its positions with those of the plan.
fn readings(name: &str, plan: &Plan) -> Vec<Row> {
    let mut rows = Vec::new();
    for test in &plan.tests {
        let path = samples().join(name).join(format!("{}.csv", test.name));
        let text = std::fs::read_to_string(path).unwrap();
        for line in text.lines().skip(1) {
            let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
            let instant = &plan.instants[rows.len()];
            assert_eq!(f64::from(instant.run), fields[1], "{name}: {line}");
            for axis in AxisName::ALL {
                let position = instant.commanded.position[axis.index()];
                let shown = if axis.is_rotary() { position.to_degrees() } else { position };
                assert!((shown - fields[2 + axis.index()]).abs() < 1e-6, "{name}: {line}: {shown}");
            }
            rows.push(Row::taken(rows.len(), fields[7]));
        }
    }
    assert_eq!(rows.len(), plan.instants.len());
    rows
}

/// Values of the parameters of the plan from a truth file.
fn values(truth: &Value, plan: &Plan) -> Vec<f64> {
    let number = |value: &Value| value.as_f64().unwrap();
    plan.unknowns
        .iter()
        .map(|unknown| {
            let test = unknown.in_test.iter().position(|within| *within).unwrap();
            let setup = &truth["setup"][&plan.tests[test].name];
            match unknown.component {
                Component::WorkpieceBall(axis) => number(&setup["ball_w_um"][axis.0]),
                Component::SpindleBall(axis) => number(&setup["ball_s_um"][axis.0]),
                Component::Bar => number(&setup["bar_um"]),
                _ => number(&truth["pige"][&unknown.id][0]),
            }
        })
        .collect()
}

fn rotary_rms_um(name: &str, effects: &[Injected]) -> f64 {
    let plan = plan(Kind::Rotary, 0.25);
    let values = values(&truth(name), &plan);
    let rows = readings(name, &plan);
    let squares = rows.iter().map(|row| {
        let expected = plan.reading_mm(&plan.instants[row.instant], &values, effects);
        ((row.length_mm - expected) * 1e3).powi(2)
    });
    (squares.sum::<f64>() / rows.len() as f64).sqrt()
}

/// 2 µm as in the truth file, which states no phase: 0.4 rad reproduces the readings, and a fit agrees within its
/// uncertainty.
fn axial_third_order() -> Injected {
    let component = Component::Motion(Freedom::Z, AxisName::C);
    let shape = Shape::Harmonic { order: 3, phase_deg: 0.4_f64.to_degrees() };
    Injected::new(component, Driver::Axis(AxisName::C), shape, 2.0)
}

/// Readings without true values.
fn measured(rows: Vec<Row>) -> SimulatedSession {
    let truth = Truth {
        unknowns: Vec::new(),
        effects: Vec::new(),
        noise: Noise::White { sigma_um: 0.3 },
        outlier_rows: Vec::new(),
    };
    SimulatedSession { files: Vec::new(), rows, truth }
}

#[test]
fn rotary_clean_is_reproduced_to_its_noise() {
    if !samples_exist("rotary_clean_is_reproduced_to_its_noise") {
        return;
    }
    let rms = rotary_rms_um("rotary-clean", &[]);
    println!("rotary-clean: {rms:.4} um");
    assert!((0.29..0.32).contains(&rms), "{rms}");
}

#[test]
fn rotary_axial_h3_is_reproduced_to_its_noise_with_its_effect_only() {
    if !samples_exist("rotary_axial_h3_is_reproduced_to_its_noise_with_its_effect_only") {
        return;
    }
    let rms = rotary_rms_um("rotary-axial-h3", &[axial_third_order()]);
    println!("rotary-axial-h3: {rms:.4} um");
    assert!((0.29..0.32).contains(&rms), "{rms}");
    let without = rotary_rms_um("rotary-axial-h3", &[]);
    println!("rotary-axial-h3 without its effect: {without:.4} um");
    assert!(without > 0.5);
    assert!(rotary_rms_um("rotary-axial-h3", &[axial_third_order().with_amplitude(-2.0)]) > without);
}

#[test]
fn a_fit_of_rotary_axial_h3_finds_amplitude_and_phase() {
    if !samples_exist("a_fit_of_rotary_axial_h3_finds_amplitude_and_phase") {
        return;
    }
    let plan = plan(Kind::Rotary, 0.25);
    let draw = measured(readings("rotary-axial-h3", &plan));
    let oracle = Oracle::on(plan, Noise::White { sigma_um: 0.3 });
    let fit = oracle.fit(&draw, &[axial_third_order()]);
    let (cosine, u_cosine) = fit.get("effect 0").unwrap();
    let (sine, u_sine) = fit.get("effect 1").unwrap();
    println!("rotary-axial-h3: {:.3} um at {:.2} deg", cosine.hypot(sine), (-sine).atan2(cosine).to_degrees());
    assert!((cosine - 2.0 * 0.4_f64.cos()).abs() < 3.0 * u_cosine);
    assert!((sine + 2.0 * 0.4_f64.sin()).abs() < 3.0 * u_sine);
}

#[test]
fn circle_backlash_y_is_reproduced_to_its_noise_with_its_lost_motion() {
    if !samples_exist("circle_backlash_y_is_reproduced_to_its_noise_with_its_lost_motion") {
        return;
    }
    let plan = plan(Kind::LinearCircles, 0.5);
    let rows = readings("circle-backlash-y", &plan);
    let draw = measured(rows);
    let oracle = Oracle::on(plan, Noise::White { sigma_um: 0.3 });
    let backlash =
        Injected::new(Component::Motion(Freedom::Y, AxisName::Y), Driver::Axis(AxisName::Y), Shape::Backlash, 1.0);
    // The truth file does not state the set-up offsets of the circles: they are fitted together with the amplitude.
    let fit = oracle.fit(&draw, std::slice::from_ref(&backlash));
    let (amplitude, u) = fit.get("effect 0").unwrap();
    println!("circle-backlash-y: {:.4} um, lost motion {amplitude:.3} um, u {u:.3}", fit.rms_um);
    assert!((0.29..0.32).contains(&fit.rms_um), "{}", fit.rms_um);
    assert!((amplitude - 4.0).abs() < 3.0 * u, "{amplitude} ± {u}");
}
