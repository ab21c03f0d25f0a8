//! The next test: improvement over the published methods, and separation of two effects.

use abbe::model::driver::Driver;
use abbe::model::effect::shape::Harmonic;
use abbe::model::effect::{Component, Effect, Shape};
use abbe::model::instrument::Station;
use abbe::model::session::{Prior, Session};
use abbe::plan::candidates::candidate_tests;
use abbe::plan::design::Goal;
use abbe::plan::improve::{ImproveOptions, improve};
use abbe::plan::variations::TestVariations;
use abbe::plan::{PlanOptions, analyse, separation, states};

use crate::suite::plan::help::{machine, noise_um, ready, session};

fn with_setups_of_1_um(chapter: usize) -> Session {
    let mut session = ready(&format!("hermle-c600u/chapter{chapter}.toml"));
    for test in &mut session.tests {
        for prior in &mut test.priors {
            if matches!(prior, Prior::Gaussian(_)) {
                *prior = Prior::Gaussian(1e-3);
            }
        }
    }
    session
}

fn worst(session: &Session) -> f64 {
    let plan = analyse(session, &PlanOptions { effects: false, ..PlanOptions::default() }).unwrap();
    plan.errors.iter().map(|error| error.u.unwrap()).fold(0.0, f64::max)
}

#[test]
fn one_test_more_than_chapter_5_reduces_the_uncertainty_by_a_third() {
    let best = [4, 5, 6].map(|chapter| worst(&with_setups_of_1_um(chapter))).into_iter().fold(f64::INFINITY, f64::min);
    let complete = states::complete(&with_setups_of_1_um(5), true).unwrap();
    let problem = states::problem_by_test(&complete, noise_um(0.3)).unwrap();
    let options = ImproveOptions { goal: Goal::WorstUncertainty, tests: 1, by_minute: false };
    for follow in [true, false] {
        // As in the published methods, every test has its own spindle ball. No linear axis follows, so its errors have
        // no influence.
        let menu = TestVariations { keep_spindle_ball: false, follow, ..TestVariations::default() };
        let found = improve(&problem, &menu, &options).unwrap();
        let after = found.steps[0].after;
        println!("best published {best:.2}, chapter 5 {:.2}, with {}: {after:.2}", found.before, found.steps[0].test);
        assert!(after < 0.7 * best, "{after} against {best}");

        // The updated information agrees with a new analysis of the plan that includes the test.
        let entry =
            candidate_tests(&complete, &menu).unwrap().into_iter().find(|entry| entry.name == found.steps[0].test);
        let mut longer = complete.clone();
        longer.tests.push(entry.unwrap().test);
        assert!((worst(&longer) - after).abs() < 1e-3 * after, "{} against {after}", worst(&longer));
    }
}

#[test]
fn a_proposed_test_makes_a_combination_identifiable() {
    let known = "sweep = { axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 2, runs = 1, both_directions = true }";
    let text = format!(
        "{}[instrument]\nkind = \"ballbar\"\nnoise_um = 0.3\n[[test]]\nname = \"C100\"\nbar_mm = 100\nworkpiece_ball_mm = [0, 100, 50]\n\
         spindle_ball_mm = [0, 0, 0]\nat = {{ z_mm = 50 }}\nworkpiece_ball_u_um = [2, 2, 2]\nspindle_ball_u_um = [1, 1, 1]\n{known}\n",
        machine("w C A b Y X Z t", None)
    );
    let complete = states::complete(&session(&text), true).unwrap();
    let problem = states::problem_by_test(&complete, noise_um(0.3)).unwrap();
    let options = ImproveOptions { goal: Goal::WorstUncertainty, tests: 2, by_minute: false };
    let found = improve(&problem, &TestVariations { thin: 4, ..TestVariations::default() }, &options).unwrap();
    assert!(found.before > 1e3, "{}", found.before);
    let opened: Vec<&String> = found.steps.iter().flat_map(|step| &step.makes_identifiable).collect();
    assert!(opened.len() >= 4, "{opened:?}");
    assert!(found.steps.last().unwrap().after < 10.0);
}

#[test]
fn a_second_radius_separates_tilt_and_axial_motion() {
    let session = ready("hermle-c600u/chapter5.toml");
    let complete = states::complete(&session, true).unwrap();
    let problem = states::problem_by_test(&complete, noise_um(0.3)).unwrap();
    let harmonic = |component: &str, order: f64| {
        Effect::new(Component::parse(component).unwrap(), Driver::Axis("C".into()), Shape::Harmonic(Harmonic { order }))
    };
    let beta = vec![0.0; problem.parameters.list.len()];
    let menu = TestVariations::short();
    // 1.5 µm of EZC order 2 against EAC order 1; the two are confounded at one radius.
    let found = separation(&problem, &beta, &harmonic("EZC", 2.0), &[1.5e-3, 0.0], &harmonic("EAC", 1.0), &menu)
        .unwrap()
        .expect("a candidate test");
    println!("{found:?}");
    assert!(found.before_sigma < 3.0, "{found:?}");
    assert!(found.after_sigma > 20.0 * found.before_sigma.max(1.0), "{found:?}");
    assert!(found.test.starts_with('C') && found.test.contains("radius"), "{found:?}");
}

/// A curve is the sensitivity along a test; the result also states the largest of all tests. A length changes a reading
/// by at most its own size, an angle of 1″ by 5 nm per millimetre of lever.
#[test]
fn curves_reach_the_largest_sensitivity() {
    let options = PlanOptions { effects: false, ..PlanOptions::default() };
    let plan = analyse(&with_setups_of_1_um(5), &options).unwrap();
    let [mut lengths, mut angles] = [0, 0];
    for error in &plan.errors {
        let largest = error.sensitivity.largest.abs();
        let reached = error
            .curves
            .iter()
            .filter(|curve| curve.test == error.sensitivity.largest_in_test)
            .flat_map(|curve| &curve.values)
            .fold(0.0_f64, |most, value| most.max(value.abs()));
        // A curve holds a subset of the readings.
        assert!(reached <= largest * (1.0 + 1e-9) && reached > 0.99 * largest, "{}: {reached} {largest}", error.id);
        if error.unit == "um" {
            lengths += 1;
            assert!((0.5..1.0 + 1e-9).contains(&largest), "{}: {largest}", error.id);
        } else {
            angles += 1;
            assert!(largest < 0.005 * 1000.0, "{}: {largest}", error.id);
        }
    }
    assert!(lengths >= 3 && angles >= 3, "{lengths} {angles}");
}

/// No proposed test exceeds the travel of the bar sensor; with more travel there are more candidate tests.
#[test]
fn proposed_tests_stay_within_the_travel_of_the_bar() {
    let complete = states::complete(&with_setups_of_1_um(5), true).unwrap();
    let within = |reach_mm: f64| {
        let menu = TestVariations { reach_mm, ..TestVariations::short() };
        let found = candidate_tests(&complete, &menu).unwrap();
        for entry in &found {
            let Station::BallBar(bar) = &entry.test.station else { panic!("{}", entry.name) };
            let readings = &entry.test.readings.as_ref().unwrap().observed;
            let most = readings.iter().map(|reading| (reading - bar.bar).abs()).fold(0.0, f64::max);
            assert!(most <= reach_mm, "{}: {most}", entry.name);
            // The description names only axes that are not at zero.
            assert!(!entry.name.contains(" at 0°"), "{}", entry.name);
        }
        found.len()
    };
    let [little, usual, much] = [1e-6, 1.0, 500.0].map(within);
    println!("{little} {usual} {much}");
    assert!(0 < little && little <= usual && usual < much);
}

#[test]
fn gain_per_minute_selects_a_short_test() {
    let complete = states::complete(&with_setups_of_1_um(5), true).unwrap();
    let problem = states::problem_by_test(&complete, noise_um(0.3)).unwrap();
    let menu = TestVariations {
        bars_mm: vec![100.0, 150.0],
        radii_mm: vec![100.0],
        heights_mm: vec![0.0],
        standing_deg: vec![0.0],
        ranges: vec![1.0, 0.5],
        both_directions: vec![true, false],
        ..TestVariations::default()
    };
    let proposed = |by_minute| {
        let options = ImproveOptions { goal: Goal::WorstUncertainty, tests: 1, by_minute };
        improve(&problem, &menu, &options).unwrap()
    };
    let [best, quick] = [proposed(false), proposed(true)];
    // A part never has more information than the whole, …
    assert!(!best.steps[0].test.contains("in one direction"), "{}", best.steps[0].test);
    // … and if set-ups dominate, it has nearly as much in less time.
    assert!(quick.steps[0].test.contains("in one direction"), "{}", quick.steps[0].test);
    let gain = |found: &abbe::plan::improve::Improvement| {
        (found.before / found.steps[0].after).ln() / found.steps[0].duration_min
    };
    assert!(gain(&quick) > gain(&best));
}
