//! What a trace reports belongs together: effects, their coefficients, the errors before and after, and uncertainties that cover what looks the same.

use abbe::identify::quantity::Given;
use abbe::identify::simulate::{Simulation, simulate};
use abbe::identify::trace::{TraceOptions, trace};
use abbe::model::effect::{Component, Driver, Effect, Shape};
use abbe::model::session::Session;
use abbe::model::session::read::{self, ReadOptions};

use super::ready;

fn of_c(component: &str, shape: Shape) -> Effect {
    Effect {
        component: Component::parse(component).unwrap(),
        driver: Driver::parse("C"),
        shape,
        tests: Vec::new(),
    }
}

/// The session of chapter 5 as measured on a machine with some effects, of which it declares the first few.
fn measured(effects: Vec<Effect>, values: &[&str], declared: usize) -> Session {
    let plan = ready("hermle-c600u/chapter5.toml");
    let mut session = read::session(&plan, &ReadOptions::default()).unwrap();
    session.effects = effects;
    let simulation = Simulation {
        given: values.iter().map(|text| Given::parse(text).unwrap()).collect(),
        seed: 3,
        ..Simulation::default()
    };
    let simulated = simulate(&session, &simulation).unwrap();
    for (test, readings) in session.tests.iter_mut().zip(simulated.readings) {
        test.readings = Some(readings);
    }
    session.effects.truncate(declared);
    session
}

/// EZC of order 2 and EAC of order 3, of which the first few are declared.
fn wave_and_tilt(declared: usize) -> Session {
    let waves = vec![
        of_c("EZC", Shape::Harmonic { order: 2.0 }),
        of_c("EAC", Shape::Harmonic { order: 3.0 }),
    ];
    let values = [
        "EZC~C:h2.amplitude=1.5um",
        "EAC~C:h3.amplitude=4arcsec",
        "EAC~C:h3.phase=40deg",
    ];
    measured(waves, &values, declared)
}

/// Where the library is a wave and, as a last resort, a curve, a bump is first taken for the wave and then for the curve in its place.
#[test]
fn the_model_that_is_reported_has_the_effects_that_are_reported() {
    let bump = Shape::Local {
        centre: 150_f64.to_radians(),
        width: 12_f64.to_radians(),
        recurs: None,
    };
    let session = measured(vec![of_c("EZC", bump)], &["EZC~C:local=5um"], 0);
    let options = TraceOptions {
        only: ["EZC~C:h3", "EZC~C:curve"].map(String::from).to_vec(),
        ..TraceOptions::default()
    };
    let trace = trace(&session, &options, &|_| true).unwrap();
    let steps: Vec<&str> = trace.steps.iter().map(|step| step.id.as_str()).collect();
    assert_eq!(steps, ["EZC~C:h3", "EZC~C:curve"]);
    let reported: Vec<&str> = trace
        .result
        .effects
        .iter()
        .map(|e| e.name.shape.as_str())
        .collect();
    assert_eq!(reported, ["curve"]);
    let shapes = |effects: &[Effect]| -> Vec<&str> { effects.iter().map(|e| e.shape.word()).collect() };
    assert_eq!(shapes(&trace.effects), reported);
    assert_eq!(shapes(&trace.after.parameters.effects), reported);
    assert!(!trace.result.effects[0].curve.is_empty());
    // The noise is 0.3 µm, and the curve takes the bump off.
    let result = &trace.result;
    assert!(
        result.before.rms_um > 0.4 && result.after.rms_um < 0.32,
        "{}",
        result.after.rms_um
    );
    assert_eq!(result.verdict, "explained");
}

/// At radius R, EAC = a cos 3C lifts the ball by a R sin C cos 3C = a R (sin 4C − sin 2C) / 2: no reading tells it from EZC of order 4 beside EZC of
/// order 2. Where the latter is declared and the former is the truth, the named effect moves the declared one, whose uncertainty has to say so.
#[test]
fn the_uncertainty_of_a_declared_wave_covers_what_looks_like_the_found_effect() {
    let session = wave_and_tilt(1);
    let result = trace(&session, &TraceOptions::default(), &|_| true)
        .unwrap()
        .result;
    assert_eq!(result.effects.len(), 1);
    let is_truth = |name: &&abbe::identify::results::EffectName| {
        name.component == "EAC" && name.shape == "harmonic" && name.order == Some(3.0)
    };
    let effect = &result.effects[0];
    assert!(
        effect
            .aliases
            .iter()
            .chain([&effect.name])
            .any(|name| is_truth(&name))
    );
    let found = |id: &str| {
        let mut parameters = result.after.parameters.iter();
        let parameter = parameters.find(|parameter| parameter.id == id).unwrap();
        (parameter.value, parameter.u)
    };
    // 4″ at 100 mm are 1.94 µm, and half of that goes to order 2.
    let (amplitude, u) = found("EZC~C:h2.amplitude");
    assert!((amplitude - 1.5).abs() > 0.5, "{amplitude}");
    assert!((amplitude - 1.5).abs() < 2.0 * u && u < 2.0, "{amplitude} ± {u}");
    let (phase, u) = found("EZC~C:h2.phase");
    assert!(
        phase.abs() > 5.0 && phase.abs() < 2.0 * u && u <= 103.93,
        "{phase} ± {u}"
    );
}

/// The same with nothing declared: both waves are found, and what looks like the one moves the other.
#[test]
fn the_uncertainty_of_a_found_wave_covers_what_looks_like_another_found_effect() {
    let session = wave_and_tilt(0);
    let options = TraceOptions {
        only: ["EZC~C:h", "EAC~C:h3"].map(String::from).to_vec(),
        ..TraceOptions::default()
    };
    let result = trace(&session, &options, &|_| true).unwrap().result;
    let named: Vec<(&str, Option<f64>)> = result
        .effects
        .iter()
        .map(|effect| (effect.name.component.as_str(), effect.name.order))
        .collect();
    assert_eq!(named, [("EZC", Some(2.0)), ("EZC", Some(4.0))]);
    let fourth = &result.effects[1];
    assert!(
        fourth
            .aliases
            .iter()
            .any(|name| name.component == "EAC" && name.order == Some(3.0))
    );
    for parameters in [&result.after.parameters, &result.effects[0].parameters] {
        let found = |id: &str| {
            let parameter = parameters.iter().find(|parameter| parameter.id == id).unwrap();
            (parameter.value, parameter.u)
        };
        let (amplitude, u) = found("EZC~C:h2.amplitude");
        assert!((amplitude - 1.5).abs() > 0.5, "{amplitude}");
        assert!((amplitude - 1.5).abs() < 2.0 * u && u < 2.0, "{amplitude} ± {u}");
        let (phase, u) = found("EZC~C:h2.phase");
        assert!(
            phase.abs() > 5.0 && phase.abs() < 2.0 * u && u < 50.0,
            "{phase} ± {u}"
        );
    }
}
