//! Detection of outliers: along runs against neighbouring readings, among independent poses against the median
//! residual.
//!
//! Structure in the residual must not be excluded. Along a run a residual is therefore compared with the medians of its
//! neighbours on either side, not with zero (Hampel's identifier: Davies & Gather, J. Am. Stat. Assoc. 88 (1993) 782).
//! In the residual of a circle's own diagnosis, which contains all structure, it is compared with zero and with both
//! neighbours. Poses have no neighbours. A pose is an outlier if its residual is a large multiple of the median
//! residual.

use abbe_model::session::readings::Readings;

use crate::numerics::{median, parallel, robust_deviation};
use crate::problem::Problem;

/// Number of neighbours on either side in the median.
const NEIGHBOURS: usize = 5;
/// Limit along a run, in robust standard deviations: exceeded once in 10⁷ Gaussian readings.
const OUTLIER_ALONG_RUN: f64 = 5.3;
/// Limit for a pose, in median residual lengths: exceeded once in 10⁹ Gaussian poses of three coordinates. Unmodelled
/// structure is bounded and stayed far below it.
const OUTLIER_POSE: f64 = 5.0;

/// Limit for a single reading in the residual of a complete model, in robust standard deviations.
const OUTLIER_ALONE: f64 = 6.0;

/// The outliers of the problem, by test and row, from the residuals of a fit, mm.
pub fn reject(problem: &Problem, residuals: &[Vec<f64>]) -> Vec<Vec<bool>> {
    let coordinates = problem.coordinates();
    if problem.folds.kind.is_poses() {
        let lengths: Vec<Vec<f64>> = residuals
            .iter()
            .map(|residual| {
                residual.chunks_exact(coordinates).map(|v| v.iter().map(|x| x * x).sum::<f64>().sqrt()).collect()
            })
            .collect();
        let mut all: Vec<f64> = lengths.iter().flatten().copied().collect();
        let limit = OUTLIER_POSE * median(&mut all);
        return lengths.iter().map(|test| test.iter().map(|length| *length > limit).collect()).collect();
    }
    parallel::map(problem.tests.len(), &|test| match &problem.tests[test].readings {
        Some(readings) => reject_along_runs(readings, &residuals[test], coordinates, problem.noise.sigma_mm),
        None => Vec::new(),
    })
}

/// The outliers in the residual of a model that contains all structure, by index: large beside both neighbours too.
pub(crate) fn alone(residual: &[f64]) -> impl Iterator<Item = usize> {
    let limit = OUTLIER_ALONE * robust_deviation(residual);
    let is_small = move |place: Option<usize>, value: f64| {
        place.and_then(|place| residual.get(place)).is_none_or(|other| other.abs() < 0.5 * value)
    };
    (0..residual.len()).filter(move |&i| {
        let value = residual[i].abs();
        value > limit && is_small(i.checked_sub(1), value) && is_small(Some(i + 1), value)
    })
}

fn reject_along_runs(readings: &Readings, residual: &[f64], coordinates: usize, sigma_mm: f64) -> Vec<bool> {
    let mut reject = vec![false; readings.rows()];
    for run in readings.runs() {
        if run.len() < 2 * NEIGHBOURS + 1 {
            continue;
        }
        for coordinate in 0..coordinates {
            let values: Vec<f64> = (run.clone().map(|row| residual[row * coordinates + coordinate])).collect();
            let middle: Vec<f64> = values.array_windows().map(|five| median_of_five(*five)).collect();
            let mut deviations: Vec<f64> = Vec::with_capacity(run.len());
            for (row, value) in values.iter().enumerate() {
                // Beside a step (backlash at a reversal) a reading agrees with one of the two sides. An outlier agrees
                // with neither.
                let start = row.saturating_sub(NEIGHBOURS);
                let end = (row + NEIGHBOURS + 1).min(values.len());
                let from = |side: std::ops::Range<usize>| match side.len() {
                    0..3 => None,
                    NEIGHBOURS => Some(value - middle[side.start]),
                    _ => Some(value - median(&mut values[side].to_vec())),
                };
                let deviation = match (from(start..row), from(row + 1..end)) {
                    (Some(before), Some(after)) if before * after <= 0.0 => 0.0,
                    (Some(before), Some(after)) if before.abs() < after.abs() => before,
                    (_, Some(after)) => after,
                    (Some(before), None) => before,
                    (None, None) => 0.0,
                };
                deviations.push(deviation);
            }
            let spread = robust_deviation(&deviations).max(sigma_mm);
            for (row, deviation) in run.clone().zip(&deviations) {
                reject[row] |= deviation.abs() > OUTLIER_ALONG_RUN * spread;
            }
        }
    }
    reject
}

/// The median of five values: that of the fifth and the two middle values of the first four.
fn median_of_five([a, b, c, d, e]: [f64; NEIGHBOURS]) -> f64 {
    let low = a.min(b).max(c.min(d));
    let high = a.max(b).min(c.max(d));
    low.min(high).max(low.max(high).min(e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_five_is_the_third_in_order() {
        // All orders of five numbers, ties included.
        for code in 0..5_usize.pow(5) {
            let values: [f64; 5] = std::array::from_fn(|place| (code / 5_usize.pow(place as u32) % 5) as f64);
            let mut sorted = values;
            sorted.sort_by(f64::total_cmp);
            assert_eq!(median_of_five(values), sorted[2], "{values:?}");
        }
    }
}
