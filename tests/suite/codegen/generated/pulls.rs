//! Pulls of fitted errors over simulated sessions.

use abbe::identify::fit::{parameters, prepare};
use abbe::model::session::Session;
use abbe::model::session::planned::planned_session;
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use super::draw::draw;
use super::{codes, generated};

/// Sessions per code without `ABBE_STUDY`.
const FEW: usize = 3;
/// Significance level for a mean or a standard deviation of pulls: of some 400 figures one exceeds it in 250 suites.
const MIN_P: f64 = 1e-5;

/// Pulls of every error over sessions: estimate minus truth over stated standard uncertainty.
fn pulls(code: &str, plan: &Session, seeds: std::ops::Range<u64>) -> Vec<(String, Vec<f64>)> {
    let of_session = |seed: u64| -> Vec<f64> {
        let drawn = draw(code, plan, seed, 0.3);
        let (problem, found) = prepare(&drawn.measured, 1).unwrap();
        let fitted = parameters(&problem, &found);
        plan.unknowns
            .iter()
            .map(|name| {
                let id = name.to_string();
                let Some(parameter) = fitted.iter().find(|parameter| parameter.id == id) else {
                    panic!("{code}: {id} is not identifiable");
                };
                let truth = drawn.values.iter().find(|(name, _)| *name == id).unwrap().1;
                (parameter.value - truth) / parameter.u
            })
            .collect()
    };
    let sessions: Vec<Vec<f64>> = seeds.into_par_iter().map(of_session).collect();
    let of_error = |k: usize| sessions.iter().map(|pulls| pulls[k]).collect();
    (plan.unknowns.iter().enumerate()).map(|(k, name)| (name.to_string(), of_error(k))).collect()
}

#[test]
fn errors_are_found_within_their_uncertainties_on_every_code() {
    let study = std::env::var("ABBE_STUDY").ok().and_then(|text| text.parse().ok());
    let sessions: u64 = study.unwrap_or(FEW as u64);
    if sessions == 0 {
        test_needs::skip("errors_are_found_within_their_uncertainties_on_every_code", "ABBE_STUDY is 0");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    println!(
        "| code | readings | errors | mean of pulls | standard deviation of pulls | all pulls |\n|---|---|---|---|---|---|"
    );
    for (number, code) in codes().enumerate() {
        let plan = generated(code, folder.path());
        let first = 1000 * (number as u64 + 1);
        let by_error = pulls(code, &plan, first..first + sessions);
        let n = sessions as f64;
        let (mut means, mut deviations) = (Vec::new(), Vec::new());
        let squares = ChiSquared::new(n).unwrap();
        for (id, pulls) in &by_error {
            let mean = pulls.iter().sum::<f64>() / n;
            let sum: f64 = pulls.iter().map(|pull| pull * pull).sum();
            let p_mean = 2.0 * Normal::standard().sf(mean.abs() * n.sqrt());
            let p_squares = 2.0 * squares.sf(sum).min(squares.cdf(sum));
            assert!(p_mean > MIN_P, "{code} {id}: mean {mean:.3} over {sessions}");
            assert!(p_squares > MIN_P, "{code} {id}: rms {:.3} over {sessions}", (sum / n).sqrt());
            means.push(mean);
            deviations.push(((sum - n * mean * mean) / (n - 1.0).max(1.0)).sqrt());
        }
        let range = |values: &[f64]| {
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            format!("{low:+.2} to {high:+.2}")
        };
        let all: Vec<f64> = by_error.iter().flat_map(|(_, pulls)| pulls.iter().copied()).collect();
        let (count, sum) = (all.len() as f64, all.iter().sum::<f64>());
        let rms = (all.iter().map(|pull| pull * pull).sum::<f64>() / count).sqrt();
        let readings: usize = planned_session(&plan).unwrap().iter().map(|test| test.rows()).sum();
        println!(
            "| `{code}` | {readings} | {} | {} | {} | mean {:+.3}, rms {rms:.3} |",
            by_error.len(),
            range(&means),
            range(&deviations),
            sum / count
        );
    }
}
