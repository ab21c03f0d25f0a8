//! Waves along runs that vary from run to run and that no autocorrelation explains.
//!
//! A wave of varying amplitude has no line in the spectrum but a hump of some cycles' width. An autoregression of order
//! two or three can imitate such a hump. The deviations are therefore whitened with order one, whose spectrum is
//! monotonic, and the search for humps is by bands.

use std::ops::Range;

use abbe_model::session::Test;
use faer::Mat;
use statrs::function::gamma::gamma_ur;

use super::PureError;
use super::restricted::DetrendedRuns;
use super::trends::MIN_RUN;
use crate::numerics::{median, parallel};

/// Half cycles along a run at which the candidate bands begin, and the widths of the bands in half cycles.
const FIRST: std::ops::RangeInclusive<usize> = 2..=40;
const WIDTHS: [usize; 3] = [1, 4, 8];
/// Half cycles up to which the median level is computed.
const HIGHEST: usize = 100;
/// Maximum number of bands to remove from a test.
const MAX_BANDS: usize = 4;
/// Significance level of a band, over all candidate bands.
const BAND_SIGNIFICANCE: f64 = 1e-4;

/// Consecutive rows of one run of a test.
#[derive(Clone)]
struct RunRows {
    test: usize,
    rows: Range<usize>,
}

/// Deviations of repeats along runs, without waves.
pub struct AlongRuns {
    /// The deviations.
    pub pure: PureError,
    /// The sums that the likelihood of their autoregression needs; `None` without enough repeats.
    pub(super) runs: Option<DetrendedRuns>,
}

impl PureError {
    /// Removes waves along runs that no autocorrelation explains: they vary from run to run, so they are structure that
    /// would count as noise. A band is removed from all tests or from one. The criterion is the periodogram of the
    /// whitened deviations, summed over runs, against the median of all ordinates.
    pub fn without_waves(mut self, tests: &[Test], kept: impl Fn(usize, usize) -> bool + Sync) -> AlongRuns {
        let Some(mut detrended) = DetrendedRuns::of(&self, tests, &kept) else {
            return AlongRuns { pure: self, runs: None };
        };
        let runs: Vec<RunRows> = tests
            .iter()
            .enumerate()
            .flat_map(|(test, of)| {
                let runs = of.readings.iter().flat_map(|readings| readings.runs());
                let long = runs.filter(|run| run.len() >= MIN_RUN);
                long.map(move |rows| RunRows { test, rows })
            })
            .collect();
        let of_test =
            |test: usize| runs.partition_point(|run| run.test < test)..runs.partition_point(|run| run.test <= test);
        let mut ordinates = self.ordinates(&runs, &detrended.coefficients_of_first_order());
        for range in std::iter::once(0..runs.len()).chain((0..tests.len()).map(of_test)) {
            for _ in 0..MAX_BANDS {
                let Some(band) = self.band(&ordinates[range.clone()]) else {
                    break;
                };
                let independent: Vec<f64> = (self.deviations.iter().zip(&self.freedom_of_tests))
                    .map(|(deviations, freedom)| freedom / deviations.iter().flatten().count().max(1) as f64)
                    .collect();
                for run in &runs[range.clone()] {
                    // Half cycles overlap: every second one of a band represents the whole band.
                    for half_cycles in band.clone().step_by(2) {
                        if remove_wave(&mut self.deviations[run.test][run.rows.clone()], half_cycles) {
                            // Repeats hold a deviation more than once, so a wave uses only its share of two degrees of
                            // freedom.
                            self.freedom_of_tests[run.test] -= 2.0 * independent[run.test];
                        }
                    }
                }
                self.freedom_of_tests.iter_mut().for_each(|freedom| *freedom = freedom.max(0.0));
                self.count();
                let Some(rest) = DetrendedRuns::of(&self, tests, &kept) else {
                    return AlongRuns { pure: self, runs: None };
                };
                detrended = rest;
                ordinates = self.ordinates(&runs, &detrended.coefficients_of_first_order());
            }
        }
        AlongRuns { pure: self, runs: Some(detrended) }
    }

    /// The ordinates of the whitened deviations of each run ([`ordinates`]).
    fn ordinates(&self, runs: &[RunRows], coefficients: &[f64]) -> Vec<Vec<f64>> {
        parallel::map(runs.len(), &|k| {
            let RunRows { test, rows } = &runs[k];
            let deviation = |row: usize| self.deviations[*test][row].unwrap_or(0.0);
            let past = |row: usize| -> f64 {
                let lags = coefficients.iter().enumerate();
                lags.filter(|(lag, _)| row > rows.start + lag).map(|(lag, a)| a * deviation(row - lag - 1)).sum()
            };
            ordinates(&rows.clone().map(|row| deviation(row) - past(row)).collect::<Vec<f64>>())
        })
    }

    /// The most significant band of runs with these ordinates, in half cycles, if any is significant.
    fn band(&self, ordinates: &[Vec<f64>]) -> Option<Range<usize>> {
        // Repeats hold the same deviation more than once: this is the number of independent runs.
        let deviations_count = self.deviations.iter().flatten().flatten().count().max(1);
        let independent = ordinates.len() as f64 * self.freedom as f64 / deviations_count as f64;
        let candidates = (FIRST.count() * WIDTHS.len()) as f64;
        bands(ordinates, independent)
            .into_iter()
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .filter(|(_, p_value)| *p_value < BAND_SIGNIFICANCE / candidates)
            .map(|(band, _)| band)
    }
}

/// The candidate bands of whitened runs with these ordinates, so many of which are independent: half cycles along a run, and
/// the p-value. In white noise a sum of ordinates over `r` runs has a gamma distribution of shape `r`; its scale follows
/// from the median of all.
fn bands(ordinates: &[Vec<f64>], independent: f64) -> Vec<(Range<usize>, f64)> {
    let shortest = ordinates.iter().map(Vec::len).min().unwrap_or(0);
    let first = *FIRST.start();
    let sums: Vec<f64> = (0..shortest).map(|k| ordinates.iter().map(|of_run| of_run[k]).sum()).collect();
    // Median of a gamma distribution (Wilson and Hilferty).
    let median_of_gamma = independent * (1.0 - 1.0 / (9.0 * independent)).powi(3);
    let level = median(&mut sums.clone()) / median_of_gamma;
    if sums.is_empty() || level <= 0.0 {
        return Vec::new();
    }
    let widths = WIDTHS.into_iter();
    widths
        .flat_map(|width| sums.windows(width).take(FIRST.count()).enumerate())
        .map(|(begin, band)| {
            // Of ordinates half a cycle apart, every second one is independent.
            let cycles = (0.5 * band.len() as f64).max(1.0);
            let mean = band.iter().sum::<f64>() / (band.len() as f64 * level);
            let p_value = gamma_ur(independent * cycles, mean * cycles);
            (first + begin..first + begin + band.len(), p_value)
        })
        .collect()
}

/// Values of a block of a run.
const BLOCK: usize = 32;

/// The ordinates of the periodogram at the half cycles from the first one on along a run of `n` values,
/// `|Σ v(t) exp(iωt)|²/n`. With `t = bB + k` the sum is `Σ z^b Σ v(bB + k) exp(iωk)`, `z = exp(iωB)`: a product of matrices
/// for the blocks of `B` values, and the scheme of Horner over them.
fn ordinates(run: &[f64]) -> Vec<f64> {
    let first = *FIRST.start();
    let count = HIGHEST.min(run.len()).saturating_sub(first);
    let step = |k: usize| std::f64::consts::PI * (first + k) as f64 / run.len() as f64;
    // The cosines of all ordinates, then their sines.
    let mut waves = Mat::zeros(2 * count, BLOCK);
    for k in 0..count {
        let (sin, cos) = step(k).sin_cos();
        let (mut c, mut s) = (1.0, 0.0);
        for t in 0..BLOCK {
            (waves[(k, t)], waves[(count + k, t)]) = (c, s);
            (c, s) = (c * cos - s * sin, c * sin + s * cos);
        }
    }
    let blocks = run.len().div_ceil(BLOCK);
    let values = Mat::from_fn(BLOCK, blocks, |t, b| run.get(b * BLOCK + t).copied().unwrap_or(0.0));
    let of_blocks = waves * values;
    let turns: Vec<(f64, f64)> = (0..count).map(|k| (step(k) * BLOCK as f64).sin_cos()).collect();
    let mut sums = vec![(0.0, 0.0); count];
    for of_block in of_blocks.col_iter().rev() {
        let (cosines, sines) = of_block.split_at_row(count);
        let of_block = cosines.iter().zip(sines.iter());
        for ((sum, (sin, cos)), (c, s)) in sums.iter_mut().zip(&turns).zip(of_block) {
            *sum = (sum.0 * cos - sum.1 * sin + c, sum.0 * sin + sum.1 * cos + s);
        }
    }
    sums.iter().map(|(c, s)| (c * c + s * s) / run.len() as f64).collect()
}

/// Removes a wave of so many half cycles from the deviations of a run, by least squares. Rescales the rest for the
/// variance that the wave removes. Returns whether the run has enough deviations.
fn remove_wave(run: &mut [Option<f64>], half_cycles: usize) -> bool {
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
    let (a, b) = ((ss * cy - cs * sy) / determinant, (cc * sy - cs * cy) / determinant);
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
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;

    /// In white noise the p-value of a band of one ordinate is uniform; those of wide bands are small a little less often,
    /// since more than every second ordinate counts. A wave along all runs makes the bands that hold it significant, and no
    /// band far from it.
    #[test]
    fn bands_of_white_noise_have_uniform_p_values() {
        const DRAWS: usize = 400;
        const RUNS: usize = 5;
        let mut random = Pcg64::new(7, 11);
        let mut white = || -> Vec<Vec<f64>> {
            (0..RUNS).map(|_| (0..240).map(|_| StandardNormal.sample(&mut random)).collect()).collect()
        };
        let of = |runs: &[Vec<f64>]| runs.iter().map(|run| ordinates(run)).collect::<Vec<_>>();
        let drawn: Vec<Vec<(Range<usize>, f64)>> = (0..DRAWS).map(|_| bands(&of(&white()), RUNS as f64)).collect();
        assert_eq!(drawn[0].len(), FIRST.count() * WIDTHS.len());
        for width in WIDTHS {
            for level in [0.05, 0.2, 0.5] {
                // Bands 8 half cycles apart are nearly independent.
                let own = drawn.iter().flatten().filter(|(band, _)| band.len() == width && band.start % 8 == 2);
                let p_values: Vec<f64> = own.map(|(_, p_value)| *p_value).collect();
                let share = p_values.iter().filter(|p_value| **p_value < level).count() as f64 / p_values.len() as f64;
                println!("{width}, {level}: {share}");
                let sampling = (level * (1.0 - level) / p_values.len() as f64).sqrt();
                let least = if width == 1 { level } else { 0.6 * level };
                assert!(share < level + 4.0 * sampling && share > least - 4.0 * sampling, "{width}: {share}, {level}");
            }
        }
        let wave = |t: usize| 0.8 * (std::f64::consts::PI * 21.0 * t as f64 / 240.0).cos();
        let with_wave: Vec<Vec<f64>> =
            white().iter().map(|run| run.iter().enumerate().map(|(t, v)| v + wave(t)).collect()).collect();
        for (band, p_value) in bands(&of(&with_wave), RUNS as f64) {
            if band.contains(&21) {
                assert!(p_value < 1e-6, "{band:?}: {p_value}");
            } else if band.start > 24 || band.end < 19 {
                assert!(p_value > 1e-6, "{band:?}: {p_value}");
            }
        }
        assert!(bands(&of(&[vec![0.0; 100]]), 1.0).is_empty() && bands(&[], 1.0).is_empty());
    }

    /// The ordinate of a wave of amplitude `a` over `n` values is `a² n/4`, and that of another whole number of cycles is
    /// zero; the length is no multiple of a block.
    #[test]
    fn the_periodogram_has_one_ordinate_for_a_wave() {
        const N: usize = 5 * BLOCK + 7;
        let angle = |t: usize| std::f64::consts::PI * 6.0 * t as f64 / N as f64 + 0.4;
        let run: Vec<f64> = (0..N).map(|t| 3.0 * angle(t).cos()).collect();
        let found = ordinates(&run);
        let at = |half_cycles: usize| found[half_cycles - FIRST.start()];
        assert_eq!(found.len(), HIGHEST - FIRST.start());
        assert!((at(6) - 9.0 * N as f64 / 4.0).abs() < 1e-9);
        assert!([2, 4, 8, 98].iter().all(|half_cycles| at(*half_cycles) < 1e-20 * N as f64));
    }

    /// Compares with the sum over all values; a run of few values has fewer ordinates.
    #[test]
    fn the_periodogram_is_that_of_its_definition() {
        let mut random = Pcg64::new(3, 5);
        for n in [24, 31, 32, 33, 240, 6007] {
            let run: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut random)).collect();
            let found = ordinates(&run);
            assert_eq!(found.len(), HIGHEST.min(n) - 2);
            for (half_cycles, found) in (2..).zip(found) {
                let angle = |t: usize| std::f64::consts::PI * (half_cycles * t) as f64 / n as f64;
                let sum = |of: fn(f64) -> f64| run.iter().enumerate().map(|(t, v)| v * of(angle(t))).sum::<f64>();
                let wanted = (sum(f64::cos).powi(2) + sum(f64::sin).powi(2)) / n as f64;
                assert!((found - wanted).abs() < 1e-9 * wanted.max(1.0), "{n}, {half_cycles}: {found} {wanted}");
            }
        }
    }

    /// Waves of whole cycles are orthogonal along a run: one is removed, the other remains, rescaled by `√(n/(n − 2))`.
    #[test]
    fn only_the_wave_of_the_given_frequency_is_removed() {
        const N: usize = 48;
        let wave = |half_cycles: f64, t: usize| (std::f64::consts::PI * half_cycles * t as f64 / N as f64 + 0.4).cos();
        let mut run: Vec<Option<f64>> = (0..N).map(|t| Some(3.0 * wave(4.0, t) + wave(10.0, t))).collect();
        remove_wave(&mut run, 4);
        let rescale = (N as f64 / (N as f64 - 2.0)).sqrt();
        for (t, value) in run.iter().enumerate() {
            assert!((value.unwrap() - rescale * wave(10.0, t)).abs() < 1e-12);
        }
        // Gaps remain gaps, and half a cycle can be removed beside them.
        let mut run: Vec<Option<f64>> = (0..N).map(|t| (t % 5 != 0).then(|| wave(5.0, t))).collect();
        remove_wave(&mut run, 5);
        for (t, value) in run.iter().enumerate() {
            assert_eq!(value.is_none(), t % 5 == 0);
            assert!(value.unwrap_or(0.0).abs() < 1e-12);
        }
    }
}
