//! Readings and columns in units of known noise, run by run.

use super::noise::{Noise, RESOLUTION_UM};
use super::plan::Plan;
use nalgebra::DMatrix;

/// The places of all readings.
pub fn rows_of(plan: &Plan) -> Vec<usize> {
    (0..plan.instants.len()).collect()
}

/// Whitens columns whose rows are the readings at `rows` (ascending places in [`Plan::instants`]), µm: independent, variance one. A row
/// whose neighbours are missing is whitened against the last one before it in the same run.
pub fn whiten(plan: &Plan, noise: Noise, rows: &[usize], mut columns: DMatrix<f64>) -> DMatrix<f64> {
    let rounding = RESOLUTION_UM * RESOLUTION_UM / 12.0;
    let variance = noise.sigma_um() * noise.sigma_um();
    // For each row: what to take of the row before, and what to divide by.
    let steps: Vec<(f64, f64)> = rows
        .iter()
        .enumerate()
        .map(|(k, row)| {
            let here = &plan.instants[*row];
            let previous = k.checked_sub(1).map(|k| rows[k]).filter(|previous| {
                let before = &plan.instants[*previous];
                (before.test, before.run) == (here.test, here.run)
            });
            let carried = previous.map_or(0.0, |previous| {
                let gap = i32::try_from(row - previous).unwrap_or(i32::MAX);
                noise.coefficient().powi(gap)
            });
            let kept = carried * carried;
            (
                carried,
                (variance * (1.0 - kept) + rounding * (1.0 + kept)).sqrt(),
            )
        })
        .collect();
    for mut column in columns.column_iter_mut() {
        for k in (0..steps.len()).rev() {
            let (carried, scale) = steps[k];
            let before = if carried == 0.0 {
                0.0
            } else {
                carried * column[k - 1]
            };
            column[k] = (column[k] - before) / scale;
        }
    }
    columns
}
