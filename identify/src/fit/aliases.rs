//! Aliases of the effects of a model: how the estimates change if an alias takes the place of its effect.
//!
//! With the triangular factor `[R c]` at the solution, over the parameters of the model and the coefficients `a` of an
//! alias, the effect with the coefficients `b` is taken out and the others are fitted together with the alias:
//!
//! ```text
//! min ‖c + R_b·b − R_s·δ − R_a·a‖²     s: the parameters without b
//! ```
//!
//! `δ` is the change of the parameters. The coefficients of the effect itself have none: the alias does not have them.
//! An uncertainty covers, for each effect, the largest change by one of its aliases:
//!
//! ```text
//! u² = u₀² + Σ_effects max_aliases δ²
//! ```
//!
//! The covariance has the changes of one alias correlated: `D·(Σ δδᵀ)·D` for each effect, with `D` such that the
//! diagonal is the largest `δ²`.

use std::ops::Range;

use abbe_model::effect::Effect;
use faer::Mat;

use super::Fit;
use super::quantities::{quantities, u_of_undetermined_phase_deg, values_at};
use crate::error::IdentifyError;
use crate::numerics::solve::Svd;
use crate::parameters::Role;
use crate::problem::Problem;
use crate::results::{EnlargedBy, ParameterResult, phases_follow_amplitudes};

/// Share of an uncertainty without aliases that a change needs to be listed.
const LISTED: f64 = 0.05;

/// An alias in the place of its effect.
#[derive(Clone, Debug)]
pub struct AliasChange {
    /// Index among the aliases of the effect.
    pub alias: usize,
    /// Change of each parameter of the model, internal units.
    pub changes: Vec<f64>,
    /// Increase of χ².
    pub delta_chi2: f64,
}

/// The aliases of one effect.
#[derive(Clone, Debug)]
pub struct EffectAliases {
    /// Index of the effect.
    pub effect: usize,
    /// What each of its aliases changes.
    pub aliases: Vec<AliasChange>,
}

/// The aliases of all effects at a solution. An effect that is assumed, and one without aliases, has none.
///
/// # Errors
/// If an alias cannot be evaluated.
pub fn at_solution(problem: &Problem, beta: &[f64]) -> Result<Vec<EffectAliases>, IdentifyError> {
    let effects = &problem.parameters.effects;
    if effects.iter().all(|effect| effect.covered_aliases().is_empty()) {
        return Ok(Vec::new());
    }
    let count = beta.len();
    // The coefficients of all aliases beside the parameters: one linearisation serves them all.
    let mut wide = problem.clone();
    let mut added: Vec<(&Effect, Range<usize>)> = Vec::new();
    let mut places: Vec<Vec<(usize, Range<usize>)>> = Vec::new();
    for effect in effects {
        let mut own = Vec::new();
        for (number, alias) in effect.covered_aliases().iter().enumerate() {
            // An effect of the model cannot also take the place of another one.
            if effects.iter().any(|present| present.is_same(alias)) {
                continue;
            }
            // Two effects may have an alias in common.
            let place = match added.iter().find(|(present, _)| present.is_same(alias)) {
                Some((_, place)) => place.clone(),
                None => {
                    let first = wide.parameters.list.len();
                    wide.add_effect(alias)?;
                    let place = first..wide.parameters.list.len();
                    added.push((alias, place.clone()));
                    place
                }
            };
            own.push((number, place));
        }
        places.push(own);
    }
    let mut at = beta.to_vec();
    at.resize(wide.parameters.list.len(), 0.0);
    let (r, c, _) = wide.prior_triangle(&at).merged(&wide.triangles(&at)?).parts();
    let sizes = wide.parameters.sizes();
    let squares = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    let mut found = Vec::new();
    for (number, own) in places.iter().enumerate().filter(|(_, own)| !own.is_empty()) {
        let is_own = |j: usize| match problem.parameters.list[j].role {
            Role::Coefficient { effect, .. } | Role::Number { effect, .. } => effect == number,
            Role::Error | Role::Setup => false,
        };
        let others: Vec<usize> = (0..count).filter(|j| !is_own(*j)).collect();
        let without: Vec<f64> = (0..r.nrows())
            .map(|i| c[i] + (0..count).filter(|j| is_own(*j)).map(|j| r[(i, j)] * beta[j]).sum::<f64>())
            .collect();
        let mut aliases = Vec::new();
        for (alias, place) in own {
            let columns: Vec<usize> = others.iter().copied().chain(place.clone()).collect();
            let scaled = Mat::from_fn(r.nrows(), columns.len(), |i, k| r[(i, columns[k])] * sizes[columns[k]]);
            let step = Svd::of(scaled.as_ref())?.solve_identifiable(&without);
            let mut changes = vec![0.0; count];
            others.iter().zip(&step).for_each(|(j, step)| changes[*j] = step * sizes[*j]);
            let residual: Vec<f64> = (0..r.nrows())
                .map(|i| without[i] - (0..columns.len()).map(|k| scaled[(i, k)] * step[k]).sum::<f64>())
                .collect();
            aliases.push(AliasChange { alias: *alias, changes, delta_chi2: squares(&residual) - squares(&c) });
        }
        found.push(EffectAliases { effect: number, aliases });
    }
    Ok(found)
}

/// The changes of some functions of the parameters by each alias, by effect. `values` gives the functions.
fn shifts(fit: &Fit, values: impl Fn(&[f64]) -> Vec<f64>) -> Vec<Vec<Vec<f64>>> {
    let present = values(&fit.beta);
    let of_alias = |alias: &AliasChange| -> Vec<f64> {
        let moved: Vec<f64> = fit.beta.iter().zip(&alias.changes).map(|(value, by)| value + by).collect();
        values(&moved).iter().zip(&present).map(|(moved, present)| moved - present).collect()
    };
    fit.aliases.iter().map(|effect| effect.aliases.iter().map(of_alias).collect()).collect()
}

/// The largest change of each function by one alias of an effect, without its sign.
fn largest(shifts: &[Vec<f64>], count: usize) -> Vec<f64> {
    let most = |k: usize| shifts.iter().map(|of_alias| of_alias[k].abs()).fold(0.0, f64::max);
    (0..count).map(most).collect()
}

/// By how much uncertainties of functions of the parameters exceed those without aliases, as a contribution of its own.
pub fn contribution(fit: &Fit, count: usize, values: impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let mut squares = vec![0.0; count];
    for of_effect in shifts(fit, values) {
        squares.iter_mut().zip(largest(&of_effect, count)).for_each(|(sum, most)| *sum += most * most);
    }
    squares.into_iter().map(f64::sqrt).collect()
}

/// Adds the aliases to a covariance of functions of the parameters.
pub(crate) fn add_to_covariance(covariance: &mut Mat<f64>, fit: &Fit, values: impl Fn(&[f64]) -> Vec<f64>) {
    let count = covariance.nrows();
    for of_effect in shifts(fit, values) {
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

/// Enlarges the uncertainties of reported parameters to cover the aliases, and states which alias enlarges which.
pub(super) fn cover(parameters: &mut [ParameterResult], problem: &Problem, fit: &Fit) {
    if fit.aliases.is_empty() {
        return;
    }
    let quantities = quantities(problem, &fit.rank);
    let values = |beta: &[f64]| {
        let mut values = Vec::with_capacity(parameters.len());
        values_at(problem, fit, &quantities, beta, |value| values.push(value));
        values
    };
    let by_effect = shifts(fit, values);
    for (k, parameter) in parameters.iter_mut().enumerate() {
        let without = parameter.u;
        let mut variance = without * without;
        for (of_effect, aliases) in by_effect.iter().zip(&fit.aliases) {
            let most = of_effect.iter().enumerate().max_by(|a, b| a.1[k].abs().total_cmp(&b.1[k].abs()));
            let Some((place, shift)) = most.map(|(place, of_alias)| (place, of_alias[k])) else { continue };
            variance += shift * shift;
            if shift.abs() > LISTED * without {
                let effect = &problem.parameters.effects[aliases.effect];
                let alias = effect.aliases.get(aliases.aliases[place].alias);
                parameter.enlarged_by.push(EnlargedBy {
                    effect: problem.parameters.effect_ids[aliases.effect].clone(),
                    alias: alias.map(|alias| alias.id()).unwrap_or_default(),
                    change: shift,
                });
            }
        }
        if !parameter.enlarged_by.is_empty() {
            parameter.u_without_aliases = Some(without);
        }
        let mut u = variance.sqrt();
        if parameter.id.ends_with(".phase") {
            u = u.min(u_of_undetermined_phase_deg());
        }
        parameter.set_u(u);
    }
    phases_follow_amplitudes(parameters);
}

impl Fit {
    /// Covariance of the parameters with everything that their uncertainties cover: noise, its enlargement, aliases.
    pub fn covariance_with_aliases(&self) -> Mat<f64> {
        let mut covariance = &self.covariance * faer::Scale(self.u_enlargement * self.u_enlargement);
        add_to_covariance(&mut covariance, self, <[f64]>::to_vec);
        covariance
    }
}
