//! Diagnosis of a circular test of two linear axes: the contribution of each classical fault to the radial deviation.
//!
//! Values have the signs of the error motions `E` of ISO 230-1, along R. For example, the backlash of X has the sign of
//! the effect `EXX~X:backlash`, whatever the counting direction of X. Faults that follow from a difference or a sum
//! over both axes (scale mismatch, servo mismatch, third-order positioning) refer to the axes' positive directions.
//! They are positive if an axis travels too far or lags.
//!
//! One least-squares fit estimates all terms of [`super::faults`], the radius and the centre. Radius and centre absorb
//! the set-up. The width of reversal spikes and the pitch of cyclic errors are searched. These faults are added only if
//! chance gives as large a gain in fewer than one of a thousand circles. The share of a fault is the range of its own
//! `δL` over the sum of all ranges.
//!
//! The uncertainties follow from the noise, or from the residual if that is larger. If neighbouring residuals have the
//! correlation r, the uncertainties are enlarged by √((1 + r)/(1 − r)).
//!
//! The terms stand beside [`crate::problem::Problem`]. A spike decays with the angle of the path. The slope of backlash and
//! the powers of a bow count from the centre of the circle. A cyclic error has an amplitude for each direction, and a lag
//! has a direction where the data have no time. No shape and no driver of the library of effects is any of these: half of
//! the terms would be effects of a problem, and the other half columns beside it. Those that are effects have the figures
//! of a fit that declares them.

use abbe_model::chain::Machine;

use super::decomposition::Decomposition;
use super::faults::{FaultFigure, is_third_order};
use super::path::Path;
use super::results::{CircularTest, Diagnosis};
use crate::noise::outliers;
use crate::numerics::range;
use crate::results::Estimate;

/// The outliers of a circle: single readings with a large residual of the diagnosis; `None` if there is no diagnosis.
pub(super) fn reject_outliers(machine: &Machine, path: &Path) -> Option<Vec<bool>> {
    let model = Decomposition::of(machine, path).ok()?;
    let mut left_out = path.left_out.clone();
    for i in outliers::alone(&model.regression.residual) {
        left_out[model.rows[i].row] = true;
    }
    Some(left_out)
}

/// Adds the diagnosis and its limitations to a result.
pub(super) fn add(machine: &Machine, path: &Path, noise_mm: f64, result: &mut CircularTest) {
    match Decomposition::of(machine, path) {
        Ok(model) => {
            let (variance, enlargement) = model.variance_and_enlargement();
            let sigma_mm = (variance.max(noise_mm * noise_mm) * enlargement).sqrt();
            report(&model, sigma_mm, result);
            limits(path, &model, sigma_mm, result);
        }
        Err(why) => result.not_identifiable.extend(why),
    }
}

fn report(model: &Decomposition, sigma_mm: f64, result: &mut CircularTest) {
    let regression = &model.regression;
    for (k, fault) in model.faults.iter().enumerate() {
        let first = model.place(k);
        let beta = &regression.beta[first..first + fault.columns.len()];
        let value = |(id, figure): &(String, FaultFigure)| {
            let (factors, unit) = match figure {
                FaultFigure::Searched(value, unit) => return Estimate::new(id, *value, 0.0, *unit),
                FaultFigure::Sum(factors, unit) => (factors.clone(), *unit),
                FaultFigure::Amplitude(cos) => {
                    let amplitude = beta[*cos].hypot(beta[cos + 1]);
                    let along = |j: usize| if j == *cos || j == cos + 1 { 1e3 * beta[j] / amplitude } else { 0.0 };
                    ((0..beta.len()).map(along).collect(), "um")
                }
            };
            let value = factors.iter().zip(beta).map(|(factor, beta)| factor * beta).sum();
            let weights: Vec<(usize, f64)> = (first..).zip(factors).collect();
            Estimate::new(id, value, regression.u(&weights, sigma_mm), unit)
        };
        let meant = |value: Estimate| {
            let meaning = format!("{} of {}: {}", fault.fault, fault.axes, value.id);
            value.with_meaning(meaning)
        };
        let own = |i: usize| fault.columns.iter().zip(beta).map(|(column, beta)| column[i] * beta).sum::<f64>();
        result.diagnosis.push(Diagnosis {
            fault: fault.fault.to_string(),
            axes: fault.axes.clone(),
            values: fault.figures.iter().map(value).map(meant).collect(),
            circularity_um: range(&(0..model.rows.len()).map(own).collect::<Vec<f64>>()) * 1e3,
            share_percent: 0.0,
        });
    }
    let total: f64 = result.diagnosis.iter().map(|fault| fault.circularity_um).sum();
    for fault in &mut result.diagnosis {
        fault.share_percent = if total > 0.0 { 100.0 * fault.circularity_um / total } else { 0.0 };
    }
    result.diagnosis.sort_by(|a, b| b.circularity_um.total_cmp(&a.circularity_um));
    result.diagnosis_rms_um = Some((regression.sum_of_squares() / model.rows.len() as f64).sqrt() * 1e3);
}

/// States the limitations: confounded faults and missing data.
fn limits(path: &Path, model: &Decomposition, sigma_mm: f64, result: &mut CircularTest) {
    let [first, second] = &model.names;
    let (radius_um, u) = (model.regression.beta[0] * 1e3, model.regression.u(&[(0, 1e3)], sigma_mm));
    let mut limit = |words: String| result.not_identifiable.push(words);
    limit(format!(
        "the mean radius deviates by {radius_um:.2} µm (u {u:.2}): it combines the bar length, the mean scale of {first} and \
         {second}, and the mean lag of both axes (proportional to the square of the feed)"
    ));
    if !path.both_directions() {
        let why =
            "one direction only: servo mismatch is confounded with squareness, and lateral play with radius and scale";
        limit(why.into());
    } else if path.feed_mm_s.is_none() {
        limit("no time in the data: servo mismatch is given as a lag in µm at this feed, not in ms".into());
    }
    limit("straightness is confounded with a positioning error of the other axis that grows with the square".into());
    if model.faults.iter().any(is_third_order) {
        limit(format!(
            "the third-order errors of {first} and {second} are confounded: the value is that of their combination"
        ));
    }
}
