//! How the deviations of repeats remember each other along runs.

use std::collections::BTreeMap;

use abbe_model::session::Test;

use super::{PureError, TERMS, trend_terms};

impl PureError {
    /// How the deviations remember each other along runs: autoregressive coefficients by Yule–Walker, of the least order up to three whose successor
    /// adds nothing. `None` without enough repeats to tell.
    ///
    /// The trend that was taken out of every run took slow noise with it: with 0.8 between neighbours and a hundred readings a run, more than half of
    /// what is slow. Covariances are therefore corrected until noise of the found memory, treated alike, would show those that were seen (indirect inference:
    /// Gouriéroux, Monfort & Renault, J. Appl. Econometrics 8 (1993) S85).
    pub fn memory(&self, tests: &[&Test], kept: impl Fn(usize, usize) -> bool) -> Option<Memory> {
        self.memory_up_to(MOST, tests, kept)
    }

    /// The same with no more than so many coefficients.
    pub(super) fn memory_up_to(
        &self,
        order: usize,
        tests: &[&Test],
        kept: impl Fn(usize, usize) -> bool,
    ) -> Option<Memory> {
        let mut covariance = [0.0; MOST + 1];
        let mut pairs = [0_usize; MOST + 1];
        let mut lengths: BTreeMap<usize, usize> = BTreeMap::new();
        for (number, test) in tests.iter().enumerate() {
            let readings = test.readings.as_ref()?;
            if readings.coordinates != 1 {
                return None;
            }
            for run in readings.runs() {
                for lag in 0..=MOST {
                    for row in run.start + lag..run.end {
                        let both = self.deviations[number][row].zip(self.deviations[number][row - lag]);
                        if let Some((now, before)) = both
                            && kept(number, row)
                            && kept(number, row - lag)
                        {
                            covariance[lag] += now * before;
                            pairs[lag] += 1;
                        }
                    }
                }
                *lengths.entry(run.len()).or_default() += run.len();
            }
        }
        if pairs[MOST] < 100 || covariance[0] <= 0.0 {
            return None;
        }
        let seen: [f64; MOST + 1] = std::array::from_fn(|lag| covariance[lag] / pairs[lag] as f64);
        // Two repeats hold the same deviation twice; half the pairs are independent.
        let insignificant = 3.0 / (0.5 * pairs[0] as f64).sqrt();
        let (coefficients, variance) = without_trends_taken(&seen, order, insignificant, &lengths);
        // Bartlett's standard error of the correlation between neighbours, carried through the correction.
        let neighbours = seen[1] / seen[0];
        let u = SCATTER * ((1.0 - neighbours * neighbours).max(0.0) / self.freedom.max(1) as f64).sqrt();
        let mut slower = seen;
        slower[1..].iter_mut().for_each(|value| *value += u * seen[0]);
        let (of_slower, _) = without_trends_taken(&slower, order, insignificant, &lengths);
        let total = |coefficients: &[f64]| coefficients.iter().sum::<f64>();
        let sum_u = (total(&of_slower) - total(&coefficients)).abs();
        Some(Memory {
            sum_u: if coefficients.is_empty() { 0.0 } else { sum_u },
            coefficients,
            inflation: (variance / seen[0]).sqrt(),
        })
    }
}

/// Coefficients and variance of the noise whose deviations from trends have these autocovariances.
fn without_trends_taken(
    seen: &[f64; MOST + 1],
    order: usize,
    insignificant: f64,
    lengths: &BTreeMap<usize, usize>,
) -> (Vec<f64>, f64) {
    let mut coefficients = autoregression(seen, order, insignificant);
    let mut variance = seen[0];
    for _ in 0..CORRECTIONS {
        let (process, shown) = with_trends_out(&coefficients, lengths);
        variance = seen[0] / shown[0];
        let corrected = std::array::from_fn(|lag| seen[lag] + variance * (process[lag] - shown[lag]));
        let next = autoregression(&corrected, order, insignificant);
        if next == coefficients {
            break;
        }
        coefficients = next;
    }
    (coefficients, variance)
}

/// The highest order of a memory.
const MOST: usize = 3;
const CORRECTIONS: usize = 8;
/// By how much memories scatter beyond Bartlett's formula, for trends that were taken out and orders that were chosen: 0.034 was seen over 64 simulated
/// sessions of memory 0.8.
const SCATTER: f64 = 1.6;
/// Runs longer than this lose next to nothing with a trend.
const LONG: usize = 600;

/// How readings remember each other along runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Memory {
    /// Autoregressive coefficients; empty where readings are as good as white.
    pub coefficients: Vec<f64>,
    /// Standard uncertainty of their sum.
    pub sum_u: f64,
    /// By how much the noise is larger than its deviations from trends show.
    pub inflation: f64,
}

/// Coefficients from autocovariances (Durbin–Levinson); the last coefficient of each order is its partial autocorrelation.
fn autoregression(covariance: &[f64; MOST + 1], most: usize, insignificant: f64) -> Vec<f64> {
    let correlation = covariance.map(|value| value / covariance[0]);
    let mut coefficients: Vec<f64> = Vec::new();
    let mut accepted = Vec::new();
    let mut left = 1.0;
    for order in 1..=most {
        let predicted: f64 = coefficients
            .iter()
            .enumerate()
            .map(|(k, a)| a * correlation[order - 1 - k])
            .sum();
        let partial = ((correlation[order] - predicted) / left).clamp(-0.99, 0.99);
        let previous = coefficients.clone();
        for k in 0..previous.len() {
            coefficients[k] = previous[k] - partial * previous[previous.len() - 1 - k];
        }
        coefficients.push(partial);
        left *= 1.0 - partial * partial;
        if partial.abs() > insignificant {
            accepted = coefficients.clone();
        }
    }
    accepted
}

/// Autocorrelations of a process, and what is seen of them once a trend is taken out of runs of these lengths (and how many readings are in
/// runs of each).
fn with_trends_out(
    coefficients: &[f64],
    lengths: &BTreeMap<usize, usize>,
) -> ([f64; MOST + 1], [f64; MOST + 1]) {
    let longest = lengths
        .keys()
        .copied()
        .filter(|n| *n <= LONG)
        .max()
        .unwrap_or(0)
        .max(MOST + 1);
    // Impulse response, long enough for any memory that is not a drift.
    let mut response = vec![0.0; longest + 2000];
    response[0] = 1.0;
    for t in 1..response.len() {
        response[t] = coefficients
            .iter()
            .enumerate()
            .filter(|(k, _)| *k < t)
            .map(|(k, a)| a * response[t - 1 - k])
            .sum();
    }
    let power: f64 = response.iter().map(|r| r * r).sum();
    let correlation: Vec<f64> = (0..longest)
        .map(|lag| {
            response[lag..]
                .iter()
                .zip(&response)
                .map(|(a, b)| a * b)
                .sum::<f64>()
                / power
        })
        .collect();
    let process = std::array::from_fn(|lag| correlation[lag]);
    let mut shown = [0.0; MOST + 1];
    let mut total = 0.0;
    for (&n, &readings) in lengths {
        let weight = readings as f64;
        total += weight;
        if !(MOST + 3..=LONG).contains(&n) {
            (0..=MOST).for_each(|lag| shown[lag] += weight * process[lag]);
            continue;
        }
        // d = e − Q Qᵀe with orthonormal terms Q, so Cov d = Γ − Q(QᵀΓ) − (ΓQ)Qᵀ + Q(QᵀΓQ)Qᵀ.
        let times: Vec<f64> = (0..n).map(|t| t as f64).collect();
        let q = trend_terms(&times);
        let gq: Vec<[f64; TERMS]> = (0..n)
            .map(|t| {
                let along = |i: usize| (0..n).map(|s| correlation[t.abs_diff(s)] * q[s][i]).sum();
                std::array::from_fn(along)
            })
            .collect();
        let qgq: [[f64; TERMS]; TERMS] =
            std::array::from_fn(|i| std::array::from_fn(|j| (0..n).map(|t| q[t][i] * gq[t][j]).sum()));
        for lag in 0..=MOST {
            let sum: f64 = (lag..n)
                .map(|t| {
                    let s = t - lag;
                    let mut value = correlation[lag];
                    for i in 0..TERMS {
                        value -= q[t][i] * gq[s][i] + gq[t][i] * q[s][i];
                        for j in 0..TERMS {
                            value += q[t][i] * qgq[i][j] * q[s][j];
                        }
                    }
                    value
                })
                .sum();
            shown[lag] += weight * sum / (n - lag) as f64;
        }
    }
    (process, shown.map(|value| value / total))
}
