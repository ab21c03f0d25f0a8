//! What uncertainties cover beside the noise: the aliases of effects, the estimated positions of steps, a further step, and
//! numbers of shapes in which χ² is not parabolic.
//!
//! For each effect they cover the largest change `δ` by one of its aliases; for each step the positions `p` in which it, or a
//! further one, may lie, by their weights; for each number the ends `p` of its profile interval ([`super::numbers`]):
//!
//! ```text
//! u² = u₀² + Σ_effects max_aliases δ² + Σ_steps, numbers Σ_p w(p) δ(p)²
//! ```
//!
//! The covariance has the changes of one alias correlated: `D·(Σ δδᵀ)·D` for each effect, with `D` such that the
//! diagonal is the largest `δ²`.

use abbe_model::parameter_id::ParameterId;
use faer::Mat;

use super::Fit;
use super::aliases::AliasChange;
use super::quantities::{quantities, u_of_undetermined_phase_deg, values_at};
use crate::problem::Problem;
use crate::results::{EnlargedBy, Estimate, phases_follow_amplitudes};

/// Share of an uncertainty without aliases that a change needs to be listed.
const LISTED: f64 = 0.05;

/// The change of some functions of the parameters by a change of these. `values` gives the functions.
fn shift(fit: &Fit, changes: &[f64], values: &impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let moved: Vec<f64> = fit.beta.iter().zip(changes).map(|(value, by)| value + by).collect();
    values(&moved).iter().zip(values(&fit.beta)).map(|(moved, present)| moved - present).collect()
}

/// The changes of some functions of the parameters by each alias, by effect.
fn shifts(fit: &Fit, values: &impl Fn(&[f64]) -> Vec<f64>) -> Vec<Vec<Vec<f64>>> {
    let of_alias = |alias: &AliasChange| shift(fit, &alias.changes, values);
    fit.aliases.iter().map(|effect| effect.aliases.iter().map(of_alias).collect()).collect()
}

/// The changes of some functions of the parameters by each other position of a step, by a further step and by each end of a
/// profile interval, with its weight.
fn shifts_of_numbers(fit: &Fit, values: &impl Fn(&[f64]) -> Vec<f64>) -> impl Iterator<Item = (f64, Vec<f64>)> {
    let positions = fit.positions.iter().flat_map(|position| &position.others);
    let ends = fit.intervals.iter().flat_map(|interval| &interval.covered).filter(|(weight, _)| *weight > 0.0);
    let weighted = positions.chain(&fit.further_steps).chain(ends);
    weighted.map(|(weight, changes)| (*weight, shift(fit, changes, values)))
}

/// The variance of some functions of the parameters by the positions of steps and the numbers of shapes.
fn variances_of_numbers(fit: &Fit, count: usize, values: &impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let mut variances = vec![0.0; count];
    for (weight, shift) in shifts_of_numbers(fit, values) {
        variances.iter_mut().zip(shift).for_each(|(sum, shift)| *sum += weight * shift * shift);
    }
    variances
}

/// The largest change of each function by one alias of an effect, without its sign.
fn largest(shifts: &[Vec<f64>], count: usize) -> Vec<f64> {
    let most = |k: usize| shifts.iter().map(|of_alias| of_alias[k].abs()).fold(0.0, f64::max);
    (0..count).map(most).collect()
}

/// The contribution of aliases, positions of steps and numbers of shapes to the uncertainties of functions of the parameters,
/// beside the noise.
pub fn contribution(fit: &Fit, count: usize, values: impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let mut squares = variances_of_numbers(fit, count, &values);
    for of_effect in shifts(fit, &values) {
        squares.iter_mut().zip(largest(&of_effect, count)).for_each(|(sum, most)| *sum += most * most);
    }
    squares.into_iter().map(f64::sqrt).collect()
}

/// Adds aliases, positions of steps and numbers of shapes to a covariance of functions of the parameters.
pub(crate) fn add_to_covariance(covariance: &mut Mat<f64>, fit: &Fit, values: impl Fn(&[f64]) -> Vec<f64>) {
    let count = covariance.nrows();
    for (weight, shift) in shifts_of_numbers(fit, &values) {
        for i in 0..count {
            for j in 0..count {
                covariance[(i, j)] += weight * shift[i] * shift[j];
            }
        }
    }
    for of_effect in shifts(fit, &values) {
        let most = largest(&of_effect, count);
        let scale: Vec<f64> = (0..count)
            .map(|k| {
                let sum: f64 = of_effect.iter().map(|of_alias| of_alias[k] * of_alias[k]).sum();
                if sum > 0.0 { most[k] / sum.sqrt() } else { 0.0 }
            })
            .collect();
        for of_alias in &of_effect {
            let scaled: Vec<f64> = of_alias.iter().zip(&scale).map(|(shift, scale)| shift * scale).collect();
            for i in 0..count {
                for j in 0..count {
                    covariance[(i, j)] += scaled[i] * scaled[j];
                }
            }
        }
    }
}

/// Enlarges the uncertainties of reported parameters to cover positions of steps, numbers of shapes and aliases, and states
/// which alias enlarges which.
pub(super) fn cover(parameters: &mut [Estimate], problem: &Problem, fit: &Fit) {
    if fit.aliases.is_empty() && fit.positions.is_empty() && fit.intervals.is_empty() {
        return;
    }
    let quantities = quantities(problem, fit);
    let values = |beta: &[f64]| {
        let mut values = Vec::with_capacity(parameters.len());
        values_at(problem, fit, &quantities, beta, |value| values.push(value));
        values
    };
    let by_effect = shifts(fit, &values);
    let of_numbers = variances_of_numbers(fit, parameters.len(), &values);
    for (k, parameter) in parameters.iter_mut().enumerate() {
        let without = (parameter.u * parameter.u + of_numbers[k]).sqrt();
        let mut variance = without * without;
        for (of_effect, aliases) in by_effect.iter().zip(&fit.aliases) {
            let most = of_effect.iter().enumerate().max_by(|a, b| a.1[k].abs().total_cmp(&b.1[k].abs()));
            let Some((place, shift)) = most.map(|(place, of_alias)| (place, of_alias[k])) else { continue };
            variance += shift * shift;
            if shift.abs() > LISTED * without {
                let effect = &problem.parameters.effects[aliases.effect];
                let alias = effect.aliases.get(aliases.aliases[place].alias);
                parameter.enlarged_by.push(EnlargedBy {
                    effect: problem.parameters.effect_ids[aliases.effect].to_string(),
                    alias: alias.map(|alias| alias.id()).unwrap_or_default(),
                    change: shift,
                });
            }
        }
        if !parameter.enlarged_by.is_empty() {
            parameter.u_without_aliases = Some(without);
        }
        let mut u = variance.sqrt();
        if parameter.is(ParameterId::is_phase) {
            u = u.min(u_of_undetermined_phase_deg());
        }
        parameter.set_u(u);
    }
    phases_follow_amplitudes(parameters);
}

impl Fit {
    /// Covariance of the parameters with everything that their uncertainties cover: noise, its enlargement, positions of
    /// steps, numbers of shapes, aliases.
    pub fn whole_covariance(&self) -> Mat<f64> {
        let mut covariance = &self.covariance * faer::Scale(self.u_enlargement * self.u_enlargement);
        add_to_covariance(&mut covariance, self, <[f64]>::to_vec);
        covariance
    }
}
