//! Whitening of readings and columns by the known noise, run by run.

use super::noise::{Noise, RESOLUTION_UM};
use super::plan::Plan;
use nalgebra::DMatrix;

/// The indices of all readings.
pub fn rows_of(plan: &Plan) -> Vec<usize> {
    (0..plan.instants.len()).collect()
}

/// Whitens columns in µm to independent rows of variance one. The rows are the readings at `rows` (ascending indices in
/// [`Plan::instants`]). If its neighbour is missing, a row is whitened against the last one before it in the same run.
pub fn whiten(plan: &Plan, noise: Noise, rows: &[usize], mut columns: DMatrix<f64>) -> DMatrix<f64> {
    let rounding = RESOLUTION_UM * RESOLUTION_UM / 12.0;
    let variance = noise.sigma_um() * noise.sigma_um();
    // For each row: the factor of the previous row and the divisor.
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
            (carried, (variance * (1.0 - kept) + rounding * (1.0 + kept)).sqrt())
        })
        .collect();
    for mut column in columns.column_iter_mut() {
        for k in (0..steps.len()).rev() {
            let (carried, scale) = steps[k];
            let before = if carried == 0.0 { 0.0 } else { carried * column[k - 1] };
            column[k] = (column[k] - before) / scale;
        }
    }
    columns
}
