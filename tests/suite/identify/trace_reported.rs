//! Consistency of the result of a trace: effects, coefficients, residuals before and after, and uncertainties that
//! cover aliases.

use abbe::identify::results::TraceVerdict;
use std::sync::Arc;

use abbe::files::{self, ReadOptions};
use abbe::identify::fit::fit;
use abbe::identify::noise::Noise;
use abbe::identify::problem::Problem;
use abbe::identify::quantity::Given;
use abbe::identify::simulate::{Simulation, simulate};
use abbe::model::driver::Driver;
use abbe::model::effect::shape::{Harmonic, Local};
use abbe::model::effect::{Component, Effect, Shape};
use abbe::model::session::Session;
use abbe::plan::aliases::separate_aliases;
use abbe::plan::candidates::candidate_tests;
use abbe::plan::variations::TestVariations;
use abbe::trace::result::EffectName;
use abbe::trace::{TraceOptions, trace};

use crate::suite::{abbe, ready, text};

fn of_c(component: &str, shape: Shape) -> Effect {
    Effect::new(Component::parse(component).unwrap(), Driver::parse("C"), shape)
}

/// The session of chapter 5 with readings of a machine with some effects, of which it declares the first `declared`.
fn measured(effects: Vec<Effect>, values: &[&str], declared: usize) -> Session {
    let plan = ready("hermle-c600u/chapter5.toml");
    let mut session = files::session(&plan, &ReadOptions::default()).unwrap();
    session.effects = effects;
    let simulation = Simulation {
        given: values.iter().map(|text| Given::parse(text).unwrap()).collect(),
        seed: 3,
        ..Simulation::default()
    };
    let simulated = simulate(&session, &simulation).unwrap();
    session = session.with_readings(simulated.readings);
    session.effects.truncate(declared);
    session
}

/// EZC of order 2 and EAC of order 3, of which the first `declared` are declared.
fn wave_and_tilt(declared: usize) -> Session {
    let waves = vec![
        of_c("EZC", Shape::Harmonic(Harmonic { order: 2.0 })),
        of_c("EAC", Shape::Harmonic(Harmonic { order: 3.0 })),
    ];
    let values = ["EZC~C:h2.amplitude=1.5um", "EAC~C:h3.amplitude=4arcsec", "EAC~C:h3.phase=40deg"];
    measured(waves, &values, declared)
}

/// With a library of a harmonic and a nonparametric curve, a local feature is first attributed to the harmonic, which
/// the curve then replaces.
#[test]
fn the_reported_model_has_the_reported_effects() {
    let bump = Shape::Local(Local { centre: 150_f64.to_radians(), width: 12_f64.to_radians(), recurs: None });
    let session = measured(vec![of_c("EZC", bump)], &["EZC~C:local=5um"], 0);
    let options =
        TraceOptions { only: ["EZC~C:h3", "EZC~C:curve"].map(String::from).to_vec(), ..TraceOptions::default() };
    let trace = trace(&session, &options, &|_| true).unwrap();
    let steps: Vec<&str> = trace.steps.iter().map(|step| step.id.as_str()).collect();
    assert_eq!(steps, ["EZC~C:h3", "EZC~C:curve"]);
    let reported: Vec<&str> = trace.result.effects.iter().map(|e| e.name.shape.as_str()).collect();
    assert_eq!(reported, ["curve"]);
    let shapes = |effects: &[Effect]| -> Vec<&str> { effects.iter().map(|e| e.shape.word()).collect() };
    assert_eq!(shapes(&trace.effects), reported);
    assert_eq!(shapes(&trace.after.parameters.effects), reported);
    assert!(!trace.result.effects[0].curve.is_empty());
    // The noise is 0.3 µm, and the curve describes the local feature.
    let result = &trace.result;
    assert!(result.before.fit.rms_um > 0.4 && result.after.fit.rms_um < 0.32, "{}", result.after.fit.rms_um);
    assert_eq!(result.verdict, TraceVerdict::Explained);
}

/// At radius R, EAC = a cos 3C raises the ball by a R sin C cos 3C = a R (sin 4C − sin 2C) / 2. It is confounded with
/// EZC of order 4 together with EZC of order 2. If the latter is declared and EAC is the truth, the found effect
/// changes the declared one, whose uncertainty must cover the change.
#[test]
fn the_uncertainty_of_a_declared_harmonic_covers_the_aliases_of_the_found_effect() {
    let session = wave_and_tilt(1);
    let result = trace(&session, &TraceOptions::default(), &|_| true).unwrap().result;
    assert_eq!(result.effects.len(), 1);
    let is_truth = |name: &&abbe::trace::result::EffectName| {
        name.component == "EAC" && name.shape == "harmonic" && name.order == Some(3.0)
    };
    let effect = &result.effects[0];
    assert!(effect.aliases.iter().map(|alias| &alias.name).chain([&effect.name]).any(|name| is_truth(&name)));
    let found = |id: &str| {
        let mut parameters = result.after.parameters.iter();
        let parameter = parameters.find(|parameter| parameter.id == id).unwrap();
        (parameter.value, parameter.u)
    };
    // 4″ at 100 mm are 1.94 µm, of which half is of order 2.
    let (amplitude, u) = found("EZC~C:h2.amplitude");
    assert!((amplitude - 1.5).abs() > 0.5, "{amplitude}");
    assert!((amplitude - 1.5).abs() < 2.0 * u && u < 2.0, "{amplitude} ± {u}");
    let (phase, u) = found("EZC~C:h2.phase");
    assert!(phase.abs() > 5.0 && phase.abs() < 2.0 * u && u <= 103.93, "{phase} ± {u}");
}

/// The same without a declaration: both harmonics are found, and an alias of one changes the other.
#[test]
fn the_uncertainty_of_a_found_harmonic_covers_the_aliases_of_another_effect() {
    let session = wave_and_tilt(0);
    let options = TraceOptions { only: ["EZC~C:h", "EAC~C:h3"].map(String::from).to_vec(), ..TraceOptions::default() };
    let result = trace(&session, &options, &|_| true).unwrap().result;
    let named: Vec<(&str, Option<f64>)> =
        result.effects.iter().map(|effect| (effect.name.component.as_str(), effect.name.order)).collect();
    assert_eq!(named, [("EZC", Some(2.0)), ("EZC", Some(4.0))]);
    let fourth = &result.effects[1];
    assert!(fourth.aliases.iter().any(|alias| alias.name.component == "EAC" && alias.name.order == Some(3.0)));
    for parameters in [&result.after.parameters, &result.effects[0].parameters] {
        let found = |id: &str| {
            let parameter = parameters.iter().find(|parameter| parameter.id == id).unwrap();
            (parameter.value, parameter.u)
        };
        let (amplitude, u) = found("EZC~C:h2.amplitude");
        assert!((amplitude - 1.5).abs() > 0.5, "{amplitude}");
        assert!((amplitude - 1.5).abs() < 2.0 * u && u < 2.0, "{amplitude} ± {u}");
        let (phase, u) = found("EZC~C:h2.phase");
        assert!(phase.abs() > 5.0 && phase.abs() < 2.0 * u && u < 50.0, "{phase} ± {u}");
    }
}

/// Replaces the readings of a session by those of a machine with one effect and no other error.
fn as_with_effect(session: &Session, noise: &Noise, effect: &Effect, coefficients: &[f64]) -> Session {
    let mut problem = Problem::new(session, noise.clone(), 1).unwrap();
    problem.add_effect(effect).unwrap();
    let mut beta = vec![0.0; problem.parameters.list.len()];
    let first = beta.len() - coefficients.len();
    beta[first..].copy_from_slice(coefficients);
    let residuals = problem.residuals(&beta);
    let mut changed = session.clone();
    for (test, residuals) in changed.tests.iter_mut().zip(residuals) {
        let readings = Arc::make_mut(test.readings.as_mut().unwrap());
        assert_eq!(readings.observed.len(), residuals.len());
        for (observed, residual) in readings.observed.iter_mut().zip(residuals) {
            *observed -= residual;
        }
    }
    changed
}

/// The residual of an effect after a refit of the model with another effect in its place, in standard deviations.
fn left_by(session: &Session, noise: &Noise, alternative: &Effect) -> f64 {
    let mut problem = Problem::new(session, noise.clone(), 1).unwrap();
    problem.add_effect(alternative).unwrap();
    let fit = fit(&problem, None).unwrap();
    problem.sum_of_squares(&fit.beta).sqrt()
}

/// The effect of the bundled session has aliases. The result describes each in words and states how well a further test
/// separates it. The figure agrees with a refit that includes the readings of that test.
#[test]
fn each_explanation_states_its_separation_by_a_further_test() {
    let file = ready("hermle-c600u/measured/session.toml");
    let session = files::session(&file, &ReadOptions::default()).unwrap();
    let mut trace = trace(&session, &TraceOptions::default(), &|_| true).unwrap();
    let menu = TestVariations { thin: 1, ..TestVariations::short() };
    separate_aliases(&mut trace, &menu, &|_| true).unwrap();
    let effect = &trace.result.effects[0];
    assert!(!effect.unique && effect.explanation_count == effect.aliases.len() + 1);
    assert!(effect.aliases.len() > 4, "{:?}", effect.aliases);
    assert_eq!(effect.name.meaning, "C table: axial motion twice per turn");
    for alias in &effect.aliases {
        let what = alias.name.meaning.split_once(": ").unwrap().1;
        assert!(effect.explanations.contains(what), "{}: {what}", effect.explanations);
    }

    // The first test lists all aliases, nearest first; each further test lists the remaining ones.
    let tests = &effect.separating_tests;
    let named: Vec<&EffectName> = tests[0].alternatives.iter().map(|one| &one.name).collect();
    assert_eq!(named, effect.aliases.iter().map(|alias| &alias.name).collect::<Vec<_>>());
    for pair in tests.windows(2) {
        assert_eq!(pair[1].alternative_count, pair[0].alternative_count - pair[0].separated_count);
    }
    for test in tests {
        assert_eq!(test.alternative_count, test.alternatives.len());
        let separated = test.alternatives.iter().filter(|one| one.after_sigma >= 3.0).count();
        assert!(separated == test.separated_count && separated > 0, "{test:?}");
    }
    assert_eq!(effect.separated_by.as_ref(), Some(&tests[0].test));

    let noise = &trace.after.noise;
    let found = &trace.effects[0];
    let coefficients = &trace.after_fit.beta[trace.after_fit.beta.len() - 2..];
    let alternatives = &trace.alias_effects[0];
    let menu = menu.for_effects(std::iter::once(found).chain(alternatives));
    let proposed = candidate_tests(&session, &menu).unwrap();
    let proposed = proposed.iter().find(|entry| entry.name == tests[0].test).unwrap();
    let mut longer = session.clone();
    longer.tests.push(proposed.test.clone());
    let [before, after] = [&session, &longer].map(|session| as_with_effect(session, noise, found, coefficients));
    for (one, alternative) in tests[0].alternatives.iter().zip(alternatives) {
        let [before, after] = [&before, &after].map(|session| left_by(session, noise, alternative));
        let alike = |stderr: f64, refitted: f64| (stderr - refitted).abs() < 0.05 * refitted + 0.05;
        assert!(
            alike(one.before_sigma, before) && alike(one.after_sigma, after),
            "{one:?}: refitted {before} and {after}"
        );
    }
}

/// The increase of χ² by an alias is that of a fit with the alias in place of the found effect.
#[test]
fn an_alias_states_the_increase_of_chi_square() {
    let file = ready("hermle-c600u/measured/session.toml");
    let session = files::session(&file, &ReadOptions::default()).unwrap();
    let trace = trace(&session, &TraceOptions::default(), &|_| true).unwrap();
    let chi_square = |effect: &Effect| {
        let mut problem = trace.before.clone();
        problem.add_effect(effect).unwrap();
        fit(&problem, None).unwrap().chi_square
    };
    let found = chi_square(&trace.effects[0]);
    let aliases = &trace.result.effects[0].aliases;
    assert!(!aliases.is_empty());
    for (alias, effect) in aliases.iter().zip(&trace.alias_effects[0]) {
        let expected = chi_square(effect) - found;
        assert!((alias.delta_chi2 - expected).abs() < 0.1 + 0.02 * expected.abs(), "{alias:?}: {expected}");
        assert_eq!(alias.likelihood_ratio, (-0.5 * alias.delta_chi2).exp());
    }
}

#[test]
fn an_effect_without_an_alias_is_unique() {
    let file = ready("hermle-c600u/measured/session.toml");
    let session = files::session(&file, &ReadOptions::default()).unwrap();
    let options = TraceOptions { only: vec!["EZC~C:h".to_string()], ..TraceOptions::default() };
    let mut trace = trace(&session, &options, &|_| true).unwrap();
    separate_aliases(&mut trace, &TestVariations::short(), &|_| true).unwrap();
    let effect = &trace.result.effects[0];
    assert!(effect.unique && effect.explanation_count == 1 && effect.aliases.is_empty());
    assert_eq!(effect.explanations, effect.name.meaning);
    assert!(effect.separating_tests.is_empty() && effect.separated_by.is_none());
}

/// The second line states whether the explanation is unique, before any figure.
#[test]
fn the_line_below_the_verdict_states_whether_an_effect_is_unique() {
    let session = ready("hermle-c600u/measured/session.toml");
    let output = |only: &[&str]| {
        let outcome = abbe(&[&["trace", text(&session), "--all"], only].concat());
        assert!(outcome.status.success());
        String::from_utf8(outcome.stdout).unwrap()
    };
    let all = output(&[]);
    let mut lines = all.lines();
    assert!(lines.next().unwrap().starts_with("Verdict: explained. 1 effect explains the residual"));
    let second = lines.next().unwrap();
    let count = second.strip_prefix("1 of ").and_then(|rest| rest.split_once(' ')).unwrap();
    assert!(count.0.parse::<usize>().unwrap() > 5, "{second}");
    assert!(
        count.1.starts_with("indistinguishable explanations: C table: axial motion twice per turn, or "),
        "{second}"
    );
    let stderr = all.lines().filter(|line| line.contains("likelihood ratio")).count();
    assert_eq!(stderr + 1, count.0.parse::<usize>().unwrap());
    assert!(all.contains(" separates it from "), "{all}");
    let one = output(&["--only", "EZC~C:h"]);
    let second = one.lines().nth(1).unwrap();
    assert!(
        second.starts_with("Unique among ")
            && second.ends_with(" candidates screened: C table: axial motion twice per turn."),
        "{second}"
    );
}
