//! Faults with a nonlinear parameter: the width of a reversal spike, the pitch of a cyclic error.
//!
//! A fault is significant if `P(χ² ≥ gain / s²)` times the number of candidates is below one in a thousand. `s²` is the
//! variance of the residual, enlarged for the correlation of neighbours.

use super::fault::{Fault, columns, variance_and_enlargement};
use super::path::Path;
use super::terms::PathRows;
use crate::numerics::regression::Regression;
use crate::numerics::tails::chi_square_tail;
use crate::results::ParameterResult;

/// Significance level of a spike or cyclic error.
const SIGNIFICANCE: f64 = 1e-3;
/// Least amplitude, 2 nm. Smaller values are below the resolution of a ball bar, and the terms are of first order only:
/// 20 µm across a radius of 100 mm change it by 2 nm.
const MIN_MM: f64 = 2e-6;
/// Candidate widths of reversal spikes, degrees of the path.
const SPIKE_WIDTHS_DEG: [f64; 6] = [0.5, 1.0, 2.0, 3.0, 5.0, 8.0];

/// Names of the third-order faults.
const THIRD_ORDER: [&str; 2] = ["third-order positioning", "third-order straightness"];

/// Whether a fault is a third-order fault.
pub(super) fn is_third_order(fault: &Fault) -> bool {
    THIRD_ORDER.contains(&fault.fault)
}

/// Errors that grow with the third power of the position. Beside radius, centre and scale they contribute `cos 4θ` and
/// `sin 4θ`, with which a cyclic error of few periods is confounded.
pub(super) fn third_order(rows: &PathRows, names: &[String; 2]) -> Vec<Fault> {
    let figures = ["sum", "difference"];
    let columns = rows.third_order().into_iter().zip(THIRD_ORDER).zip(figures);
    columns
        .map(|((column, name), figure)| {
            Fault::new(name, names.concat(), vec![column]).figure(figure, &[(0, 1.0)], 1e3, "um")
        })
        .collect()
}

/// Whether a fault of one column is significant beside all the others.
pub(super) fn is_separable(rows: &PathRows, faults: &[Fault], fault: &Fault, regression: &Regression) -> bool {
    let before = faults.iter().take_while(|other| !std::ptr::eq(*other, fault));
    let place = rows.setup().len() + before.map(|other| other.columns.len()).sum::<usize>();
    let u = regression.u(&[(place, 1.0)], 1.0);
    u > 0.0 && is_significant((regression.beta[place] / u).powi(2), gain_variance(rows, regression), 1, 2)
}

/// The variance of the gain test: that of the residual, enlarged for the correlation of neighbours.
fn gain_variance(rows: &PathRows, regression: &Regression) -> f64 {
    let (variance, enlargement) = variance_and_enlargement(rows, regression);
    variance.max(MIN_MM * MIN_MM) * enlargement
}

/// Whether a gain of this many columns is significant after this many candidates.
fn is_significant(gain: f64, variance: f64, columns: usize, candidates: usize) -> bool {
    variance > 0.0 && chi_square_tail(gain / variance, columns as f64) * candidates as f64 <= SIGNIFICANCE
}

/// The reversal spikes of each axis, at the width with the largest gain.
pub(super) fn spikes(
    path: &Path,
    rows: &PathRows,
    names: &[String; 2],
    faults: &[Fault],
    regression: &Regression,
) -> Vec<Fault> {
    let present = columns(rows, faults);
    let variance = gain_variance(rows, regression);
    let step = path.arc() / (rows.count() as f64 / path.runs.len() as f64);
    let mut found = Vec::new();
    for axis in 0..2 {
        let tried = SPIKE_WIDTHS_DEG.map(f64::to_radians);
        let best = tried
            .into_iter()
            .filter(|width| *width >= 0.5 * step)
            .map(|width| (regression.gain(&present, &rows.spikes(axis, width)), width))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((gain, width)) = best else { continue };
        if !is_significant(gain, variance, 2, 2 * tried.len()) {
            continue;
        }
        let name = &names[axis];
        let mut fault = Fault::new("reversal spike", name.clone(), rows.spikes(axis, width).to_vec())
            .figure(format!("{name}+"), &[(0, 1.0)], 1e3, "um")
            .figure(format!("{name}-"), &[(1, 1.0)], 1e3, "um");
        fault.searched.push(searched("width", width.to_degrees(), "deg"));
        found.push(fault);
    }
    found
}

/// The cyclic error of each axis, at the pitch with the largest gain.
pub(super) fn cyclic(rows: &PathRows, names: &[String; 2], faults: &[Fault], regression: &Regression) -> Vec<Fault> {
    let present = columns(rows, faults);
    let variance = gain_variance(rows, regression);
    let mut found = Vec::new();
    for axis in 0..2 {
        let q = &rows.q[axis];
        let (least, most) = q.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
        let spacing = (1..q.len()).filter(|i| rows.follows[*i]).map(|i| (q[i] - q[i - 1]).abs()).fold(0.0, f64::max);
        let travel = most - least;
        // From four periods over the travel to 2.5 readings per period.
        let (slowest, fastest) = (4.0, travel / (2.5 * spacing.max(1e-3)));
        let tried = (((fastest - slowest) * 4.0).max(0.0) as usize).min(1000);
        let best = (0..tried)
            .map(|k| travel / (slowest + k as f64 / 4.0))
            .map(|pitch| (regression.gain(&present, &rows.cyclic(axis, pitch)), pitch))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((gain, pitch)) = best else { continue };
        if !is_significant(gain, variance, 2, 2 * tried) {
            continue;
        }
        // A significant cyclic error has a separate amplitude for each direction of travel.
        let both = rows.cyclic(axis, pitch);
        let (mut columns, mut amplitudes) = (Vec::new(), Vec::new());
        for (direction, name) in [(1.0, "forward"), (-1.0, "backward")] {
            if !rows.d[axis].contains(&direction) {
                continue;
            }
            amplitudes.push((name.to_string(), columns.len()));
            for column in &both {
                let travels = column.iter().zip(&rows.d[axis]);
                columns.push(travels.map(|(value, d)| if *d == direction { *value } else { 0.0 }).collect());
            }
        }
        let mut fault = Fault::new("cyclic error", names[axis].clone(), columns);
        fault.amplitudes = amplitudes;
        fault.searched.push(searched("pitch", pitch, "mm"));
        found.push(fault);
    }
    found
}

/// A parameter from a grid search, without an uncertainty of its own.
fn searched(id: &str, value: f64, unit: &str) -> ParameterResult {
    ParameterResult::new(id, value, 0.0, unit)
}
