//! Readings without structure: the null distribution of the search.
//!
//! Along runs, the draws come from the pure error: whitened deviations of repeats from their mean, in blocks with
//! random signs. The blocks keep the autocorrelation that whitening leaves. Independent poses have few repeats. For
//! them the residual is drawn with a random sign for each pose (the wild bootstrap). This keeps the magnitude of each
//! pose and removes every dependence on position.

use std::collections::HashMap;

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

use super::constants::{MAX_AR_SUM, MIN_POOL, SMOOTHING};
use super::policy::{NullSource, Policy};
use crate::candidates::columns::Columns;
use crate::noise::{Noise, PureError};
use crate::numerics::median;
use crate::problem::Problem;

/// Null draws, each over the whitened rows in fold order, in blocks of `block` readings. A draw is formed when it is
/// taken: a hundred thousand readings times two hundred draws are 160 MB.
pub fn draws<'d>(
    problem: &'d Problem,
    columns: &'d Columns<'_>,
    residuals: &[Vec<f64>],
    whitened: &'d [f64],
    count: usize,
    block: usize,
    seed: u64,
) -> impl ExactSizeIterator<Item = Vec<f64>> + use<'d> {
    let mut generator = Pcg64::seed_from_u64(seed ^ 0x6e75_6c6c);
    let mut draw: Box<dyn FnMut() -> Vec<f64> + 'd> = if Policy::of(problem).null == NullSource::SignFlips {
        let origins = columns.origin_of_rows();
        Box::new(move || sign_flipped(&origins, whitened, &mut generator))
    } else {
        let pool = pool(problem, residuals);
        Box::new(move || {
            let mut values = block_draws(&pool, columns.rows(), block, &mut generator);
            with_noise_spectrum(&mut values, &problem.noise, &mut generator);
            columns.placed(&values)
        })
    };
    (0..count).map(move |_| draw())
}

/// The residual with a random sign for each pose. `origins` are the test, row and coordinate of each value.
fn sign_flipped(origins: &[(usize, usize, usize)], whitened: &[f64], generator: &mut Pcg64) -> Vec<f64> {
    let mut signs: HashMap<(usize, usize), f64> = HashMap::new();
    let flipped = |((test, row, _), value): (&(usize, usize, usize), &f64)| {
        *signs.entry((*test, *row)).or_insert_with(|| sign(generator)) * value
    };
    origins.iter().zip(whitened).map(flipped).collect()
}

fn sign(generator: &mut Pcg64) -> f64 {
    if generator.random::<bool>() { 1.0 } else { -1.0 }
}

/// Draws `rows` deviations from the pool in blocks with random signs. Draws Gaussian noise if the pool is too small.
fn block_draws(pool: &[Vec<f64>], rows: usize, block: usize, generator: &mut Pcg64) -> Vec<f64> {
    let ends: Vec<usize> = (pool.iter())
        .scan(0, |end, stretch| {
            *end += stretch.len();
            Some(*end)
        })
        .collect();
    let total = ends.last().copied().unwrap_or(0);
    if total < MIN_POOL {
        return (0..rows).map(|_| generator.sample(StandardNormal)).collect();
    }
    let mut values = Vec::with_capacity(rows + block);
    while values.len() < rows {
        // A stretch is chosen with probability proportional to its length, and a start within it uniformly.
        let place = generator.random_range(0..total);
        let chosen = ends.partition_point(|end| *end <= place);
        let stretch = &pool[chosen];
        let start = place - (ends[chosen] - stretch.len());
        let sign = sign(generator);
        let end = (start + block).min(stretch.len());
        values.extend(stretch[start..end].iter().map(|value| sign * value));
    }
    values.truncate(rows);
    values
}

/// Gives each draw the spectrum that an inaccurate whitening leaves. Whitening with an inaccurate autocorrelation
/// under- or over-whitens. The AR coefficients of each draw differ from the estimate by its uncertainty. With `A` the
/// estimated polynomial and `A*` that of the draw, `A* w = A ε`.
fn with_noise_spectrum(values: &mut [f64], noise: &Noise, generator: &mut Pcg64) {
    if noise.ar_coefficients.is_empty() || noise.ar_sum_u <= 0.0 {
        return;
    }
    let standard: f64 = generator.sample(StandardNormal);
    let sum: f64 = noise.ar_coefficients.iter().sum();
    let mut own = noise.ar_coefficients.clone();
    own[0] += (noise.ar_sum_u * standard).min(MAX_AR_SUM - sum);
    let drawn = values.to_vec();
    for t in 0..values.len() {
        let mut value = drawn[t];
        for (lag, (found, own)) in noise.ar_coefficients.iter().zip(&own).enumerate() {
            if let Some(before) = t.checked_sub(lag + 1) {
                value += own * values[before] - found * drawn[before];
            }
        }
        values[t] = value;
    }
}

/// Whitened deviations without structure, of unit variance, in uninterrupted stretches.
fn pool(problem: &Problem, residuals: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let kept = |test: usize, row: usize| !problem.rejected[test][row];
    let pure = PureError::of(&problem.tests, residuals, kept).without_waves(&problem.tests, kept);
    let repeats = pure.freedom >= MIN_POOL;
    let coordinates = problem.coordinates();
    let mut stretches = Vec::new();
    for block in problem.blocks() {
        let scalars = block.rows.start * coordinates..block.rows.end * coordinates;
        let deviations: Vec<Option<f64>> = if repeats {
            pure.deviations[block.test][scalars].to_vec()
        } else {
            without_smooth(&residuals[block.test][scalars], coordinates)
        };
        let memory = problem.noise.ar_coefficients.len() * coordinates;
        let mut stretch = Vec::new();
        for i in memory..deviations.len() {
            let row = block.rows.start + i / coordinates;
            let past: Option<f64> = problem
                .noise
                .ar_coefficients
                .iter()
                .enumerate()
                .map(|(lag, a)| deviations[i - (lag + 1) * coordinates].map(|value| a * value))
                .sum();
            match (deviations[i], past) {
                (Some(now), Some(past)) if !problem.rejected[block.test][row] => {
                    stretch.push((now - past) / problem.noise.innovation_mm());
                }
                _ => {
                    if !stretch.is_empty() {
                        stretches.push(std::mem::take(&mut stretch));
                    }
                }
            }
        }
        if !stretch.is_empty() {
            stretches.push(stretch);
        }
    }
    let (sum, count) =
        stretches.iter().flatten().fold((0.0, 0_usize), |(sum, count), value| (sum + value * value, count + 1));
    if count > 0 && sum > 0.0 {
        // The stated noise may differ from the true noise. The search uses whitened readings, so their own variance is
        // normalised.
        let scale = if repeats { 1.0 } else { (count as f64 / sum).sqrt() };
        stretches.iter_mut().flatten().for_each(|value| *value *= scale);
    }
    stretches
}

/// A residual less its running median.
fn without_smooth(residual: &[f64], coordinates: usize) -> Vec<Option<f64>> {
    let rows = residual.len() / coordinates;
    let mut rough = vec![None; residual.len()];
    for row in 0..rows {
        let (start, end) = (row.saturating_sub(SMOOTHING), (row + SMOOTHING + 1).min(rows));
        for coordinate in 0..coordinates {
            let mut window: Vec<f64> = (start..end).map(|r| residual[r * coordinates + coordinate]).collect();
            let level = median(&mut window);
            rough[row * coordinates + coordinate] = Some(residual[row * coordinates + coordinate] - level);
        }
    }
    rough
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three coordinates rise at their own rates. Nothing of the rise remains away from the ends. The spike remains up
    /// to the difference of its neighbours.
    #[test]
    fn smooth_structure_is_removed_from_each_coordinate() {
        const ROWS: usize = 60;
        let (spiked, coordinate) = (30, 1);
        let residual: Vec<f64> = (0..3 * ROWS)
            .map(|i| (i / 3) as f64 * [1.0, -2.0, 5.0][i % 3] + if i == 3 * spiked + coordinate { 1e3 } else { 0.0 })
            .collect();
        let rough = without_smooth(&residual, 3);
        assert_eq!(rough.len(), residual.len());
        for row in SMOOTHING..ROWS - SMOOTHING {
            for k in 0..3 {
                let left = rough[3 * row + k].unwrap();
                let spike = if (row, k) == (spiked, coordinate) { 1e3 } else { 0.0 };
                // A spike among an odd number of neighbours moves their median by at most one order statistic.
                assert!((left - spike).abs() <= 2.0 + 1e-9, "{row} {k}: {left}");
                if k != coordinate {
                    assert!(left.abs() < 1e-9);
                }
            }
        }
    }
}
