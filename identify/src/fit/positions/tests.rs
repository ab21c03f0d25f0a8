use std::path::Path;
use std::sync::Arc;

use abbe_files::ReadOptions;
use abbe_model::driver::Driver;
use abbe_model::effect::shape::Steps;
use abbe_model::effect::{Component, Shape};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::*;
use crate::fit::{contribution_beside_noise, fit, parameters, prepare, refit};

/// True positions, rad, and heights, mm, of steps that are added to measured readings.
const AT: [f64; 2] = [1.3, 3.6];
const HEIGHTS_MM: [f64; 2] = [2.2e-4, -3.5e-4];

fn with_steps(problem: &Problem, at: &[f64]) -> Problem {
    let mut problem = problem.clone();
    let shape = Shape::Steps(Steps { at: at.to_vec() });
    let effect = Effect::new(Component::parse("EZC").unwrap(), Driver::parse("C"), shape);
    problem.add_effect(&effect.with_estimated_numbers()).unwrap();
    problem
}

/// The problem of a measured session without steps, with the readings of a model with steps and noise.
fn problem() -> Problem {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
    let (mut problem, _) = prepare(&abbe_files::session(&file, &ReadOptions::default()).unwrap(), 1).unwrap();
    let truth = with_steps(&problem, &AT);
    let mut beta = vec![0.0; truth.parameters.list.len()];
    let count = beta.len();
    beta[count - 2..].copy_from_slice(&HEIGHTS_MM);
    let mut random = Pcg64::new(1, 2);
    for (test, residuals) in problem.tests.iter_mut().zip(truth.residuals(&beta)) {
        let readings = Arc::make_mut(test.readings.as_mut().unwrap());
        for (observed, residual) in readings.observed.iter_mut().zip(residuals) {
            let noise: f64 = StandardNormal.sample(&mut random);
            *observed += problem.noise.sigma_mm * noise - residual;
        }
    }
    problem
}

/// The positions of a problem's steps, which are its last effect.
fn positions(problem: &Problem) -> [f64; 2] {
    problem.parameters.effects.last().unwrap().shape.positions().try_into().unwrap()
}

/// χ² and the parameters of a full fit with the steps at two positions.
fn fitted(problem: &Problem, at: &[f64]) -> (f64, Vec<f64>) {
    let moved = with_steps(problem, at);
    let beta = fit(&moved, None).unwrap().beta;
    (moved.sum_of_squares(&beta), beta)
}

/// Each estimated position is a number that the readings determine.
#[test]
fn positions_count_in_the_degrees_of_freedom() {
    let problem = problem();
    let [without, with] = [&problem, &with_steps(&problem, &AT)].map(|problem| fit(problem, None).unwrap());
    assert_eq!(without.degrees_of_freedom - with.degrees_of_freedom, 2 * AT.len());
}

/// Full fits with a step inside and outside of an end of its interval: χ² has risen by less and by more than the
/// quantile. The intervals contain the true positions.
#[test]
fn an_interval_ends_where_full_fits_have_risen_by_the_quantile() {
    let problem = problem();
    let declared = with_steps(&problem, &AT);
    let found = fit(&declared, None).unwrap();
    let allowed = QUANTILE_95 * found.u_enlargement.powi(2);
    let (least, _) = fitted(&problem, &AT);
    let estimated = at_solution(&declared, &found).unwrap();
    assert_eq!(estimated.len(), 2);
    for (k, position) in estimated.iter().enumerate() {
        let [low, high] = position.interval_95.unwrap();
        assert!(low < AT[k] && AT[k] < high && high - low < 1.0, "{low} {high}");
        let share = position.u / (high - low);
        assert!(share > 0.1 && share < 0.8, "{share} of {low} {high}");
        for end in [low, high] {
            let rise = |share: f64| {
                let mut at = AT;
                at[k] += share * (end - AT[k]);
                fitted(&problem, &at).0 - least
            };
            let [inside, outside] = [0.998, 1.002].map(rise);
            assert!(inside < allowed && outside > allowed, "{inside} {allowed} {outside} at {end}");
        }
    }
}

/// No other gap between readings has a lower χ², by full fits for each of them; and the contribution to uncertainties is
/// that of these fits with their weights.
#[test]
fn steps_move_to_the_best_gaps_and_uncertainties_cover_the_others() {
    let problem = problem();
    let mut estimated = with_steps(&problem, &[AT[0] + 0.4, AT[1] - 0.5]);
    let first = fit(&estimated, None).unwrap();
    let mut found = refit(&mut estimated, &first).unwrap();
    found.further_steps.clear();
    let at = positions(&estimated);
    assert!((at[0] - AT[0]).abs() < 0.2 && (at[1] - AT[1]).abs() < 0.2, "{at:?}");
    let levels = estimated.levels(estimated.parameters.effects.last().unwrap()).unwrap();
    let least = estimated.sum_of_squares(&found.beta);
    let mut variances = vec![0.0; found.beta.len()];
    for k in 0..2 {
        let mut total = 0.0;
        let mut squares = vec![0.0; found.beta.len()];
        let (mut spread, mut within) = (0.0, 0.0);
        let interval = found.positions[k].interval_95.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        for pair in levels.windows(2) {
            let mut moved = at;
            moved[k] = 0.5 * (pair[0] + pair[1]);
            if (moved[k] - at[1 - k]).abs() < pair[1] - pair[0] || (moved[0] < moved[1]) != (at[0] < at[1]) {
                continue;
            }
            let (sum, beta) = fitted(&problem, &moved);
            assert!(sum > least - 2.0 * MIN_FALL, "{sum} {least} {moved:?}");
            let weight = (pair[1] - pair[0]) * (-0.5 * (sum - least) / found.u_enlargement.powi(2)).exp();
            total += weight;
            if (interval[0]..=interval[1]).contains(&moved[k]) {
                within += weight;
                spread += weight * ((moved[k] - at[k]).powi(2) + (pair[1] - pair[0]).powi(2) / 12.0);
            }
            let off = |j: usize| weight * (beta[j] - found.beta[j]).powi(2);
            squares.iter_mut().enumerate().for_each(|(j, square)| *square += off(j));
        }
        variances.iter_mut().zip(&squares).for_each(|(variance, square)| *variance += square / total);
        let u = found.positions[k].u;
        assert!((u / (spread / within).sqrt() - 1.0).abs() < 0.05, "{u} {spread} {within}");
    }
    let covered = contribution_beside_noise(&found, found.beta.len(), <[f64]>::to_vec);
    let mut compared = 0;
    for (j, variance) in variances.iter().enumerate() {
        let of_noise = found.covariance[(j, j)].sqrt() * found.u_enlargement;
        if variance.sqrt() > 0.005 * of_noise {
            compared += 1;
            let share = covered[j] / variance.sqrt();
            // Far gaps, of which few are tried, contribute too.
            assert!((share - 1.0).abs() < 0.25, "{}: {share}", estimated.parameters.list[j].id);
        }
    }
    assert!(compared >= 3, "{compared}");
}

/// The contribution of a further step is that of full fits with a step at each place: the integral over its height of its
/// prior, which is that of the found heights, times the likelihood. It counts one in two that there is one.
#[test]
fn uncertainties_cover_a_further_step() {
    let problem = problem();
    let mut estimated = with_steps(&problem, &AT);
    let first = fit(&estimated, None).unwrap();
    let mut found = refit(&mut estimated, &first).unwrap();
    let at = positions(&estimated);
    let heights = found.beta.len() - 2..found.beta.len();
    let prior = heights.map(|j| found.beta[j] * found.beta[j]).sum::<f64>() / 2.0;
    let levels = estimated.levels(estimated.parameters.effects.last().unwrap()).unwrap();
    let (low, high) = (levels[0], levels[levels.len() - 1]);
    let is_found = |place: f64| {
        let within = |k: usize| found.positions[k].interval_95.is_some_and(|[a, b]| (a..=b).contains(&place));
        let between = |k: usize| levels.iter().filter(|level| (**level < at[k]) != (**level < place)).count();
        (0..2).any(|k| within(k) || between(k) <= 1)
    };
    let (mut total, mut places) = (0.0, 0.0);
    let mut squares = vec![0.0; found.beta.len()];
    for place in (1..64).map(|k| low + (high - low) * f64::from(k) / 64.0).filter(|place| !is_found(*place)) {
        let three = with_steps(&problem, &[at[0], at[1], place]);
        let with = fit(&three, None).unwrap();
        let last = with.beta.len() - 1;
        let (height, variance) = (with.beta[last], with.covariance[(last, last)] * found.u_enlargement.powi(2));
        // Trapezoidal sums over the height.
        let width = 20.0 * (prior.sqrt() + variance.sqrt()) / 4000.0;
        let (mut factor, mut mean_square) = (0.0, 0.0);
        for k in -2000..=2000 {
            let h = f64::from(k) * width;
            let likelihood = (0.5 * (height * height - (h - height).powi(2)) / variance).exp();
            let density = (-0.5 * h * h / prior).exp() / (2.0 * std::f64::consts::PI * prior).sqrt();
            factor += likelihood * density * width;
            mean_square += h * h * likelihood * density * width;
        }
        places += 1.0;
        total += factor;
        let by_height = |j: usize| (with.beta[j] - found.beta[j]) / height;
        squares.iter_mut().enumerate().for_each(|(j, square)| *square += mean_square * by_height(j).powi(2));
    }
    found.positions.clear();
    let covered = contribution_beside_noise(&found, found.beta.len(), <[f64]>::to_vec);
    let mut compared = 0;
    for (j, square) in squares.iter().enumerate() {
        let expected = (square / (places + total)).sqrt();
        if expected > 0.01 * found.covariance[(j, j)].sqrt() * found.u_enlargement {
            compared += 1;
            let id = &estimated.parameters.list[j].id;
            assert!((covered[j] / expected - 1.0).abs() < 0.02, "{id}: {} {expected}", covered[j]);
        }
    }
    assert!(compared >= 3, "{compared}");
}

/// A step is reported in the middle of the gap between two readings, wherever in it the search left it. A step whose height
/// no reading determines has no position.
#[test]
fn positions_are_in_the_middle_of_their_gaps_and_only_of_heights_that_are_determined() {
    let problem = problem();
    let mut estimated = with_steps(&problem, &AT);
    let first = fit(&estimated, None).unwrap();
    let found = refit(&mut estimated, &first).unwrap();
    let levels = estimated.levels(estimated.parameters.effects.last().unwrap()).unwrap();
    for at in positions(&estimated) {
        let beyond = levels.partition_point(|level| *level < at);
        assert!((at - 0.5 * (levels[beyond - 1] + levels[beyond])).abs() < 1e-12, "{at}");
    }
    let ids = |problem: &Problem, fit: &Fit| -> Vec<String> {
        parameters(problem, fit).into_iter().map(|parameter| parameter.id).filter(|id| id.contains(".at")).collect()
    };
    assert_eq!(ids(&estimated, &found), ["EZC~C:steps.at1", "EZC~C:steps.at2"]);
    // The axial motion of C over A: with C at rest it is that of the ball on the table.
    let mut over_a = problem.clone();
    let effect = Effect {
        driver: Driver::parse("A"),
        shape: Shape::Steps(Steps { at: vec![0.3, 0.9] }),
        ..estimated.parameters.effects.last().unwrap().clone()
    };
    over_a.add_effect(&effect).unwrap();
    let first = fit(&over_a, None).unwrap();
    let found = refit(&mut over_a, &first).unwrap();
    let height = over_a.parameters.list.len() - 2;
    assert!(!found.rank.is_identifiable(height) && !found.positions.is_empty());
    assert!(ids(&over_a, &found).is_empty(), "{:?}", ids(&over_a, &found));
}
