//! Rates of the comparison on simulated pairs of sessions.

use std::path::Path;

use abbe_files::ReadOptions;
use abbe_identify::fit;
use abbe_identify::model_file::{ModelParameter, Provenance};
use abbe_identify::quantity::Given;
use abbe_identify::results::ParameterChange;
use abbe_identify::simulate::{Simulation, simulate};
use abbe_model::document::value::Positive;
use abbe_model::instrument::ballbar::BAR;
use abbe_model::session::{Prior, Session};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::*;

fn plan() -> Session {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/chapter5.toml");
    abbe_files::session(&file, &ReadOptions { read_data: false, ..ReadOptions::default() }).unwrap()
}

/// A session with the same bars as its partner, and balls that were mounted for it.
fn model(plan: &Session, errors: &[(String, f64)], bars: &[(String, f64)], seed: u64) -> IdentifiedModel {
    let given = errors.iter().chain(bars).map(|(id, um)| Given::parse(&format!("{id}={um}um")).unwrap()).collect();
    let simulation = Simulation { given, draw_setups: true, seed, ..Simulation::default() };
    let readings = simulate(plan, &simulation).unwrap().readings;
    let (problem, fit) = fit::prepare(&plan.clone().with_readings(readings), 1).unwrap();
    IdentifiedModel::of_fit(&problem, &fit, Provenance::default()).unwrap()
}

fn bars(seed: u64) -> Vec<(String, f64)> {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
    ["A100", "A150", "C100", "C150"].map(|test| (format!("bar[{test}]"), 0.5 * draw())).to_vec()
}

fn compared(a: &IdentifiedModel, b: &IdentifiedModel) -> Comparison {
    let named = [Named { name: "A".into(), model: a }, Named { name: "B".into(), model: b }];
    compare(&named, &CompareOptions { places: 0, ..CompareOptions::default() }).unwrap()
}

/// Figures of a study of pairs of sessions, with nothing changed and with a change of 5 u.
struct Study {
    pairs: u64,
    false_claims: usize,
    found: usize,
    chi_square: f64,
    freedom: usize,
    /// Bars that are taken for one.
    shared: usize,
}

/// `ABBE_STUDY` pairs, or a few: the share of pairs with any false claim, and that in which a change of 5 u is found.
/// `second` gives the bars of the second session by those of the first.
fn study(plan: Session, second: impl Fn(&[(String, f64)]) -> Vec<(String, f64)>) -> Study {
    let stated = std::env::var("ABBE_STUDY").ok().and_then(|text| text.parse::<u64>().ok());
    let pairs = stated.unwrap_or(40).max(1);
    let before = vec![("EX0C".to_string(), 10.0), ("EY0A".to_string(), -20.0)];
    let mut study = Study { pairs, false_claims: 0, found: 0, chi_square: 0.0, freedom: 0, shared: 0 };
    for number in 0..pairs {
        let first = bars(number);
        let others = second(&first);
        let a = model(&plan, &before, &first, 1000 + 2 * number);
        let b = model(&plan, &before, &others, 1001 + 2 * number);
        let same = compared(&a, &b);
        study.false_claims += usize::from(same.pairs[0].significant > 0);
        study.chi_square += same.pairs[0].chi_square;
        study.freedom += same.pairs[0].degrees_of_freedom;
        study.shared += same.pairs[0].shared_setup.len();
        assert_eq!(same.pairs[0].shared_setup.len() + same.pairs[0].not_shared.len(), 4);
        let u = same.differences.iter().find(|difference| difference.change.id == "EX0C").unwrap().change.u;
        let after = vec![("EX0C".to_string(), 10.0 + 5.0 * u), before[1].clone()];
        let c = model(&plan, &after, &others, 1001 + 2 * number);
        let changed = compared(&a, &c);
        study.found += usize::from(changed.differences.iter().any(|d| d.change.id == "EX0C" && d.significant));
    }
    println!(
        "{pairs} pairs: {} with a false claim, {} with the change found, χ² {:.1} of {}, {} of {} bars shared",
        study.false_claims,
        study.found,
        study.chi_square,
        study.freedom,
        study.shared,
        4 * pairs
    );
    // Three standard deviations of the counts about 5 % and 95 %.
    let slack = 3.0 * (0.05 * 0.95 * pairs as f64).sqrt();
    assert!(study.false_claims as f64 <= 0.05 * pairs as f64 + slack, "{} of {pairs}", study.false_claims);
    assert!(study.found as f64 >= 0.95 * pairs as f64 - slack, "{} of {pairs}", study.found);
    study
}

#[test]
fn changes_are_found_and_false_claims_are_rare() {
    let Study { pairs, chi_square, freedom, shared, .. } = study(plan(), <[_]>::to_vec);
    // The bars are taken for others with a probability of 0.001.
    assert!(4 * pairs - shared as u64 <= 4 * (pairs / 100), "{shared} of {} bars are shared", 4 * pairs);
    let deviation = (chi_square - freedom as f64) / (2.0 * freedom as f64).sqrt();
    assert!(deviation.abs() < 4.0, "χ² {chi_square} with {freedom} degrees of freedom");
}

/// Two bars of one name that differ by 0.5 µm: their difference is no change of the machine. Where the balls are known,
/// the readings determine the bars and show that they are two; where they are not, they do not.
#[test]
fn bars_of_one_name_that_are_two_cause_no_false_claims() {
    let longer = |bars: &[(String, f64)]| bars.iter().map(|(id, um)| (id.clone(), um + 0.5)).collect::<Vec<_>>();
    study(plan(), longer);
    let mut known = plan();
    for test in &mut known.tests {
        test.priors[..BAR].fill(Prior::Known);
    }
    let Study { pairs, shared, .. } = study(known, longer);
    assert!((shared as f64) < 0.05 * 4.0 * pairs as f64, "{shared} of {} bars are shared", 4 * pairs);
}

/// The textbook example: of p = 0.01, 0.04, 0.03, 0.005 at the level 0.05 the two smallest are rejected.
#[test]
fn the_procedure_of_holm_steps_down() {
    let difference = |p_value: f64| Difference {
        from: String::new(),
        to: String::new(),
        change: ParameterChange { id: String::new(), value: 0.0, u: 1.0, unit: String::new() },
        p_value,
        significant: false,
    };
    let mut differences = [0.01, 0.04, 0.03, 0.005].map(difference);
    holm(&mut differences, 0.05);
    assert_eq!(differences.map(|difference| difference.significant), [true, false, false, true]);
}

/// All location errors of both axes, of which the tests separate some: two models in different gauges have the same
/// differences.
#[test]
fn differences_do_not_depend_on_the_gauge() {
    let mut plan = plan();
    let names = ["X", "Y", "Z", "A", "B", "C"].into_iter().flat_map(|freedom| ["A", "C"].map(|axis| (freedom, axis)));
    plan.unknowns =
        names.filter_map(|(f, axis)| abbe_model::component::ErrorName::parse(&format!("E{f}0{axis}"))).collect();
    let a = model(&plan, &[("EX0C".to_string(), 10.0)], &[], 7);
    let b = model(&plan, &[("EX0C".to_string(), 30.0)], &[], 8);
    assert!(!a.null_directions.is_empty());
    let reference = compared(&a, &b);
    assert!(!reference.pairs[0].not_comparable.is_empty());
    // The same model elsewhere along its null space: values move, predictions do not.
    let mut moved = b.clone();
    for direction in &b.null_directions {
        for (parameter, share) in moved.parameters.iter_mut().zip(direction) {
            parameter.value += 0.01 * share;
        }
    }
    let named = [Named { name: "A".into(), model: &a }, Named { name: "B".into(), model: &moved }];
    let none = Some(vec!["none".to_string()]);
    let options = CompareOptions { places: 0, shared: none, ..CompareOptions::default() };
    let unknown = CompareOptions { shared: Some(vec!["ball".to_string()]), ..options.clone() };
    let refused = compare(&named, &unknown).unwrap_err().to_string();
    assert!(refused.contains("with the same prior in both called `ball`"), "{refused}");
    assert!(refused.ends_with("these are: bar, spindle_ball, workpiece_ball"), "{refused}");
    let both = CompareOptions { shared: Some(vec!["bar".to_string(), "none".to_string()]), ..options.clone() };
    assert!(compare(&named, &both).unwrap_err().to_string().contains("state either"));
    let again = compare(&named, &options).unwrap();
    let reference =
        compare(&[Named { name: "A".into(), model: &a }, Named { name: "B".into(), model: &b }], &options).unwrap();
    for difference in &reference.differences {
        let other = again.differences.iter().find(|other| other.change.id == difference.change.id).unwrap();
        // The null directions of the two sessions differ in second order of the errors.
        assert!(
            (difference.change.value - other.change.value).abs() < 1e-3 * difference.change.u,
            "{difference:?} {other:?}"
        );
    }
}

/// Models whose readings determine no error of the machine: no difference is not "no significant difference".
#[test]
fn models_without_a_common_estimate_are_refused() {
    let mut a = model(&plan(), &[], &[], 9);
    for j in a.carried_parameters() {
        a.parameters[j].held = true;
        a.parameters[j].value = 0.0;
        (0..a.parameters.len()).for_each(|i| (a.covariance[(i, j)], a.covariance[(j, i)]) = (0.0, 0.0));
        let direction = (0..a.parameters.len()).map(|i| if i == j { a.parameters[j].size } else { 0.0 });
        a.null_directions.push(direction.collect());
    }
    let named = [Named { name: "A".into(), model: &a }, Named { name: "B".into(), model: &a }];
    let refused = compare(&named, &CompareOptions::default()).unwrap_err().to_string();
    assert!(refused.contains("nothing can be compared"), "{refused}");
}

/// A reading `error + bar` in one session and `error + 2·bar` in the other, with uncertainties that are enlarged by 2
/// and by 3. The readings do not determine the bar: it stays at its narrower prior, and enters the difference once.
#[test]
fn a_shared_bar_keeps_one_prior_under_enlarged_uncertainties() {
    let fitted = model(&plan(), &[], &[], 10);
    let own = |id: &str| fitted.parameters.iter().find(|own| own.id.to_string() == id).unwrap().clone();
    let (noise, bar) = (1e-3, 2e-3);
    let of = |reading_mm: f64, bars: f64, enlargement: f64| {
        let mut model = fitted.clone();
        model.parameters = vec![
            ModelParameter { value: reading_mm, held: false, ..own("EX0C") },
            ModelParameter { value: 0.0, held: false, prior_u: Some(Positive(bar)), ..own("bar[C100]") },
        ];
        let square = Mat::from_fn(2, 2, |i, j| match (i, j) {
            (0, 0) => noise * noise + (bars * bar).powi(2),
            (1, 1) => bar * bar,
            _ => -bars * bar * bar,
        });
        model.covariance = square * faer::Scale(enlargement * enlargement);
        model.null_directions = Vec::new();
        model.fit.u_enlargement = enlargement;
        model
    };
    let found = compared(&of(0.005, 1.0, 2.0), &of(0.017, 2.0, 3.0));
    assert_eq!(found.pairs[0].shared_setup, ["bar[C100]"]);
    let difference = &found.differences[0].change;
    assert!((difference.value - 12.0).abs() < 1e-6, "{difference:?}");
    // 2² + 3² of the noises of 1 µm, and (2·2)² of the bar.
    assert!((difference.u / 29.0_f64.sqrt() - 1.0).abs() < 1e-6, "{difference:?}");
}
