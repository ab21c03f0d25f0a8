//! Faults with a number that has to be searched for: the width of a reversal spike, the pitch of a cyclic error.
//!
//! One is taken for found where `P(χ² ≥ gain / s²)` times the number of looks is below one in a thousand, `s²` the variance of what is left over, enlarged
//! for the correlation of neighbours.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::diagnosis::{columns, variance_and_correlation};
use super::fault::Fault;
use super::path::Path;
use super::regression::{Orthonormal, Regression};
use super::terms::Rows;
use crate::results::ParameterResult;

/// Probability with which chance may yield a spike or a cyclic error.
const CHANCE: f64 = 1e-3;
/// Widths of reversal spikes that are tried, degrees of the path.
const SPIKE_WIDTHS_DEG: [f64; 6] = [0.5, 1.0, 2.0, 3.0, 5.0, 8.0];

/// Reversal spikes of each axis, at the width that explains most.
pub(super) fn spikes(
    path: &Path,
    rows: &Rows,
    names: &[String; 2],
    faults: &[Fault],
    regression: &Regression,
) -> Vec<Fault> {
    let mut basis = Orthonormal::of(&columns(rows, faults));
    let (variance, r) = variance_and_correlation(rows, regression);
    let unit = variance * (1.0 + r) / (1.0 - r);
    let step = path.arc() / (rows.count() as f64 / path.runs.len() as f64);
    let mut found = Vec::new();
    for axis in 0..2 {
        let tried = SPIKE_WIDTHS_DEG.map(f64::to_radians);
        let best = tried
            .into_iter()
            .filter(|width| *width >= 0.5 * step)
            .map(|width| {
                (
                    basis.gain(&regression.residual, rows.spikes(axis, width).to_vec()),
                    width,
                )
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((gain, width)) = best else { continue };
        let chance = ChiSquared::new(2.0).map_or(1.0, |chi| chi.sf(gain / unit)) * (2 * tried.len()) as f64;
        if chance > CHANCE || unit <= 0.0 {
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

/// The cyclic error of each axis, at the pitch that explains most.
pub(super) fn cyclic(
    rows: &Rows,
    names: &[String; 2],
    faults: &[Fault],
    regression: &Regression,
) -> Vec<Fault> {
    let mut basis = Orthonormal::of(&columns(rows, faults));
    let (variance, r) = variance_and_correlation(rows, regression);
    let unit = variance * (1.0 + r) / (1.0 - r);
    let mut found = Vec::new();
    for axis in 0..2 {
        let q = &rows.q[axis];
        let (least, most) = q.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
            (a.min(*x), b.max(*x))
        });
        let spacing = (1..q.len())
            .filter(|i| rows.follows[*i])
            .map(|i| (q[i] - q[i - 1]).abs())
            .fold(0.0, f64::max);
        let travel = most - least;
        // From four periods over the travel to two and a half readings a period.
        let (slowest, fastest) = (4.0, travel / (2.5 * spacing.max(1e-3)));
        let tried = (((fastest - slowest) * 4.0).max(0.0) as usize).min(1000);
        let best = (0..tried)
            .map(|k| travel / (slowest + k as f64 / 4.0))
            .map(|pitch| {
                (
                    basis.gain(&regression.residual, rows.cyclic(axis, pitch).to_vec()),
                    pitch,
                )
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((gain, pitch)) = best else { continue };
        if unit <= 0.0 || (-0.5 * gain / unit).exp() * (2 * tried) as f64 > CHANCE {
            continue;
        }
        // Once found, each direction of travel has its own amplitude.
        let both = rows.cyclic(axis, pitch);
        let (mut columns, mut amplitudes) = (Vec::new(), Vec::new());
        for (direction, name) in [(1.0, "forward"), (-1.0, "backward")] {
            if !rows.d[axis].contains(&direction) {
                continue;
            }
            amplitudes.push((name.to_string(), columns.len()));
            for column in &both {
                let travels = column.iter().zip(&rows.d[axis]);
                columns.push(
                    travels
                        .map(|(value, d)| if *d == direction { *value } else { 0.0 })
                        .collect(),
                );
            }
        }
        let mut fault = Fault::new("cyclic error", names[axis].clone(), columns);
        fault.amplitudes = amplitudes;
        fault.searched.push(searched("pitch", pitch, "mm"));
        found.push(fault);
    }
    found
}

/// A number that was searched for on a grid, and has no uncertainty of its own.
fn searched(id: &str, value: f64, unit: &str) -> ParameterResult {
    ParameterResult {
        id: id.to_string(),
        value,
        u: 0.0,
        unit: unit.to_string(),
    }
}
