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

use std::ops::Range;

use abbe_model::Diagnostic;
use abbe_model::effect::Effect;
use faer::Mat;

use crate::numerics::parallel;
use crate::numerics::solve::Svd;
use crate::problem::Problem;

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
pub fn at_solution(problem: &Problem, beta: &[f64]) -> Result<Vec<EffectAliases>, Diagnostic> {
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
        let is_own = |j: usize| problem.parameters.list[j].effect == Some(number);
        let others: Vec<usize> = (0..count).filter(|j| !is_own(*j)).collect();
        let without: Vec<f64> = (0..r.nrows())
            .map(|i| c[i] + (0..count).filter(|j| is_own(*j)).map(|j| r[(i, j)] * beta[j]).sum::<f64>())
            .collect();
        let changed = |(alias, place): &(usize, Range<usize>)| {
            let columns: Vec<usize> = others.iter().copied().chain(place.clone()).collect();
            let scaled = Mat::from_fn(r.nrows(), columns.len(), |i, k| r[(i, columns[k])] * sizes[columns[k]]);
            let step = Svd::of(scaled.as_ref())?.solve_identifiable(&without);
            let mut changes = vec![0.0; count];
            others.iter().zip(&step).for_each(|(j, step)| changes[*j] = step * sizes[*j]);
            let residual: Vec<f64> = (0..r.nrows())
                .map(|i| without[i] - (0..columns.len()).map(|k| scaled[(i, k)] * step[k]).sum::<f64>())
                .collect();
            Ok(AliasChange { alias: *alias, changes, delta_chi2: squares(&residual) - squares(&c) })
        };
        let aliases = parallel::map(own.len(), &|k| changed(&own[k]));
        let aliases = aliases.into_iter().collect::<Result<Vec<AliasChange>, Diagnostic>>()?;
        found.push(EffectAliases { effect: number, aliases });
    }
    Ok(found)
}
