//! Faults with a number that has to be searched for: the width of a reversal spike, the pitch of a cyclic error.
//!
//! One is taken for found where `P(χ² ≥ gain / s²)` times the number of looks is below one in a thousand, `s²` the variance of the residual, enlarged
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
/// Below this, 2 nm, no bar reads and the terms are no longer right: they are of first order, and 20 µm across a radius of 100 mm are 2 nm along it.
const MIN_MM: f64 = 2e-6;
/// Widths of reversal spikes that are tried, degrees of the path.
const SPIKE_WIDTHS_DEG: [f64; 6] = [0.5, 1.0, 2.0, 3.0, 5.0, 8.0];

/// How the faults of third order are called.
const THIRD_ORDER: [&str; 2] = ["third-order positioning", "third-order straightness"];

/// Whether a fault is one of third order.
pub(super) fn is_third_order(fault: &Fault) -> bool {
    THIRD_ORDER.contains(&fault.fault)
}

/// Errors that grow with the third power of the position: with radius, centre and scale they leave `cos 4θ` and `sin 4θ`, which a cyclic error of few
/// periods would stand in for.
pub(super) fn third_order(rows: &Rows, names: &[String; 2]) -> Vec<Fault> {
    let figures = ["sum", "difference"];
    let columns = rows.third_order().into_iter().zip(THIRD_ORDER).zip(figures);
    columns
        .map(|((column, name), figure)| {
            Fault::new(name, names.concat(), vec![column]).figure(figure, &[(0, 1.0)], 1e3, "um")
        })
        .collect()
}

/// Whether a fault of one column stands out of the noise beside all the others.
pub(super) fn is_separable(rows: &Rows, faults: &[Fault], fault: &Fault, regression: &Regression) -> bool {
    let before = faults.iter().take_while(|other| !std::ptr::eq(*other, fault));
    let place = rows.setup().len() + before.map(|other| other.columns.len()).sum::<usize>();
    let u = regression.u(&[(place, 1.0)], 1.0);
    u > 0.0
        && is_significant(
            (regression.beta[place] / u).powi(2),
            unit_of_gain(rows, regression),
            1,
            2,
        )
}

/// The variance in which a gain is counted: that of the residual, enlarged for the correlation of neighbours.
fn unit_of_gain(rows: &Rows, regression: &Regression) -> f64 {
    let (variance, r) = variance_and_correlation(rows, regression);
    variance.max(MIN_MM * MIN_MM) * (1.0 + r) / (1.0 - r)
}

/// Whether chance would seldom give so large a gain, by this many columns, in this many looks.
fn is_significant(gain: f64, unit: f64, columns: usize, looks: usize) -> bool {
    let chance = ChiSquared::new(columns as f64).map_or(1.0, |chi| chi.sf(gain / unit));
    unit > 0.0 && chance * looks as f64 <= CHANCE
}

/// Reversal spikes of each axis, at the width that explains most.
pub(super) fn spikes(
    path: &Path,
    rows: &Rows,
    names: &[String; 2],
    faults: &[Fault],
    regression: &Regression,
) -> Vec<Fault> {
    let mut basis = Orthonormal::of(&columns(rows, faults));
    let unit = unit_of_gain(rows, regression);
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
        if !is_significant(gain, unit, 2, 2 * tried.len()) {
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
    let unit = unit_of_gain(rows, regression);
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
    ParameterResult::new(id, value, 0.0, unit)
}
