//! What comes and goes from run to run: waves along a run that no memory explains.
//!
//! A wave whose size swells and fades is no line in a spectrum but a hump, some cycles wide, and an autoregression of two or three terms can imitate one.
//! Deviations are therefore whitened with one term, whose spectrum only falls, and a hump is looked for in bands.

use std::ops::Range;

use abbe_model::session::Test;
use statrs::function::gamma::gamma_ur;

use super::trends::MIN_RUN;
use super::{Autocorrelation, PureError};
use crate::outliers::median;

/// Half cycles along a run where the bands may begin that are looked at in deviations, and how many half cycles wide they are.
const FIRST: std::ops::RangeInclusive<usize> = 2..=40;
const WIDTHS: [usize; 3] = [1, 4, 8];
/// Half cycles up to which the level is taken that a band has to stand out from.
const HIGHEST: usize = 100;
/// The most bands that are taken out of a test.
const MAX_BANDS: usize = 4;
/// Probability that anything is taken out of a test's noise.
const BAND_SIGNIFICANCE: f64 = 1e-4;

/// Rows of a test that were read in one go.
#[derive(Clone)]
struct Run {
    test: usize,
    rows: Range<usize>,
}

impl PureError {
    /// The same less waves along runs that no memory explains: what comes and goes from run to run is structure, and would be taken for noise. A band is taken
    /// out of all tests, or of one, where the periodogram of their whitened deviations, summed over runs, stands out from the median of all ordinates.
    pub fn without_waves(mut self, tests: &[&Test], kept: impl Fn(usize, usize) -> bool) -> PureError {
        let Some(mut memory) = self.autocorrelation_up_to(1, tests, &kept) else {
            return self;
        };
        let of_tests: Vec<Vec<Run>> = tests
            .iter()
            .enumerate()
            .map(|(test, of)| {
                let runs = of.readings.iter().flat_map(|readings| readings.runs());
                let long = runs.filter(|run| run.len() >= MIN_RUN);
                long.map(|rows| Run { test, rows }).collect()
            })
            .collect();
        for runs in std::iter::once(of_tests.concat()).chain(of_tests) {
            for _ in 0..MAX_BANDS {
                let Some(band) = self.band(&runs, &memory) else {
                    break;
                };
                let independent: Vec<f64> = (self.deviations.iter().zip(&self.of_tests))
                    .map(|(deviations, freedom)| freedom / deviations.iter().flatten().count().max(1) as f64)
                    .collect();
                for run in &runs {
                    // Half cycles overlap: every second one of a band holds all of it.
                    for half_cycles in band.clone().step_by(2) {
                        if take_out(&mut self.deviations[run.test][run.rows.clone()], half_cycles) {
                            // Of deviations that repeats hold more than once, their share of two degrees of freedom.
                            self.of_tests[run.test] -= 2.0 * independent[run.test];
                        }
                    }
                }
                self.of_tests
                    .iter_mut()
                    .for_each(|freedom| *freedom = freedom.max(0.0));
                self.count();
                let Some(of_rest) = self.autocorrelation_up_to(1, tests, &kept) else {
                    return self;
                };
                memory = of_rest;
            }
        }
        self
    }

    /// The band, in half cycles, that stands out most in runs, if any does.
    fn band(&self, runs: &[Run], memory: &Autocorrelation) -> Option<Range<usize>> {
        let shortest = runs.iter().map(|run| run.rows.len()).min()?;
        let whitened: Vec<Vec<f64>> = runs
            .iter()
            .map(|Run { test, rows }| {
                let deviation = |row: usize| self.deviations[*test][row].unwrap_or(0.0);
                let past = |row: usize| -> f64 {
                    let lags = memory.coefficients.iter().enumerate();
                    lags.filter(|(lag, _)| row > rows.start + lag)
                        .map(|(lag, a)| a * deviation(row - lag - 1))
                        .sum()
                };
                rows.clone().map(|row| deviation(row) - past(row)).collect()
            })
            .collect();
        let ordinate = |run: &Vec<f64>, half_cycles: usize| {
            let step = std::f64::consts::PI * half_cycles as f64 / run.len() as f64;
            let (c, s) = run.iter().enumerate().fold((0.0, 0.0), |(c, s), (t, value)| {
                let (sin, cos) = (step * t as f64).sin_cos();
                (c + value * cos, s + value * sin)
            });
            (c * c + s * s) / run.len() as f64
        };
        let first = *FIRST.start();
        let sums: Vec<f64> = (first..HIGHEST.min(shortest))
            .map(|half_cycles| whitened.iter().map(|run| ordinate(run, half_cycles)).sum())
            .collect();
        // Repeats hold the same deviation more than once: so many of these runs are independent.
        let seen = self.deviations.iter().flatten().flatten().count().max(1);
        let independent = runs.len() as f64 * self.freedom as f64 / seen as f64;
        // Wilson and Hilferty's median of a gamma distribution.
        let median_of_gamma = independent * (1.0 - 1.0 / (9.0 * independent)).powi(3);
        let level = median(&mut sums.clone()) / median_of_gamma;
        if level <= 0.0 {
            return None;
        }
        let looks = (FIRST.count() * WIDTHS.len()) as f64;
        WIDTHS
            .into_iter()
            .flat_map(|width| sums.windows(width).take(FIRST.count()).enumerate())
            .map(|(begin, band)| {
                // Of ordinates half a cycle apart every second one is independent.
                let cycles = (0.5 * band.len() as f64).max(1.0);
                let mean = band.iter().sum::<f64>() / (band.len() as f64 * level);
                let by_chance = gamma_ur(independent * cycles, mean * cycles);
                (first + begin..first + begin + band.len(), by_chance)
            })
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .filter(|(_, by_chance)| *by_chance < BAND_SIGNIFICANCE / looks)
            .map(|(band, _)| band)
    }
}

/// Takes a wave of so many half cycles out of the deviations of a run, by least squares; what is left is rescaled for what the wave took of the noise.
/// Returns whether there was anything to take it from.
fn take_out(run: &mut [Option<f64>], half_cycles: usize) -> bool {
    let step = std::f64::consts::PI * half_cycles as f64 / run.len() as f64;
    let (mut cc, mut cs, mut ss, mut cy, mut sy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (t, value) in run.iter().enumerate() {
        if let Some(value) = value {
            let (s, c) = (step * t as f64).sin_cos();
            cc += c * c;
            cs += c * s;
            ss += s * s;
            cy += c * value;
            sy += s * value;
        }
    }
    let determinant = cc * ss - cs * cs;
    if determinant <= 1e-6 * cc * ss {
        return false;
    }
    let (a, b) = (
        (ss * cy - cs * sy) / determinant,
        (cc * sy - cs * cy) / determinant,
    );
    let count = run.iter().flatten().count() as f64;
    let rescale = (count / (count - 2.0).max(1.0)).sqrt();
    for (t, value) in run.iter_mut().enumerate() {
        let (s, c) = (step * t as f64).sin_cos();
        if let Some(value) = value {
            *value = (*value - a * c - b * s) * rescale;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waves of whole cycles are orthogonal along a run: one goes, the other stays and is rescaled by `√(n/(n − 2))`.
    #[test]
    fn a_wave_is_taken_out_and_no_other() {
        const N: usize = 48;
        let wave = |half_cycles: f64, t: usize| {
            (std::f64::consts::PI * half_cycles * t as f64 / N as f64 + 0.4).cos()
        };
        let mut run: Vec<Option<f64>> = (0..N).map(|t| Some(3.0 * wave(4.0, t) + wave(10.0, t))).collect();
        take_out(&mut run, 4);
        let rescale = (N as f64 / (N as f64 - 2.0)).sqrt();
        for (t, left) in run.iter().enumerate() {
            assert!((left.unwrap() - rescale * wave(10.0, t)).abs() < 1e-12);
        }
        // Gaps stay gaps, and half a cycle may be taken out beside them.
        let mut run: Vec<Option<f64>> = (0..N).map(|t| (t % 5 != 0).then(|| wave(5.0, t))).collect();
        take_out(&mut run, 5);
        for (t, left) in run.iter().enumerate() {
            assert_eq!(left.is_none(), t % 5 == 0);
            assert!(left.unwrap_or(0.0).abs() < 1e-12);
        }
    }
}
