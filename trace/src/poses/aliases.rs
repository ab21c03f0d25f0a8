//! Aliases of single effects beside families: candidates that explain the readings as well in their place.
//!
//! As in the search without families, an alias raises χ² by at most 4, and explains at least half of what the found
//! effect explains. χ² is that of the tempered likelihood, with the scales of the families.

use abbe_identify::fit::aliases_at_solution;
use abbe_identify::fit::families::FoldEquations;
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;

use super::PoseSearch;
use super::single_effects::Library;
use crate::candidates::candidate::Candidate;
use crate::constants::{INDISTINGUISHABLE, MAX_TUNED_ALIASES};
use crate::interrupt::Interrupt;
use crate::plausible::prior_cost;

/// Another explanation of a found effect.
#[derive(Clone, Debug)]
pub(crate) struct PoseAlias {
    pub effect: Effect,
    /// Increase of χ² if it replaces the found effect.
    pub delta_chi2: f64,
    /// Its prior cost less that of the found effect.
    pub prior_cost: f64,
}

/// Finds the aliases of the single effects of a model, whose uncertainties then cover them.
///
/// # Errors
/// If a model cannot be evaluated, or `INTERRUPTED`.
pub(super) fn find(model: &mut PoseSearch, library: &Library<'_>, interrupt: Interrupt<'_>) -> Result<(), Diagnostic> {
    let first = model.problem.parameters.effects.len() - model.effects.len();
    let single: Vec<usize> = (0..model.effects.len()).filter(|k| model.effects[*k].is_single).collect();
    let without = |k: &usize| model.problem.residuals(&beta_without(model, *k));
    let residuals: Vec<Vec<Vec<f64>>> = single.iter().map(without).collect();
    let nearest = library.nearest(&model.effects, &residuals, interrupt)?;
    drop(residuals);
    for (k, nearest) in single.into_iter().zip(nearest) {
        interrupt.check()?;
        let aliases = of_effect(model, k, nearest, interrupt)?;
        model.problem.parameters.effects[first + k].aliases =
            aliases.iter().map(|alias| alias.effect.clone()).collect();
        model.effects[k].aliases = aliases;
    }
    model.fit.aliases = aliases_at_solution(&model.problem, &model.fit.beta)?;
    Ok(())
}

/// Whether a parameter is a coefficient of the `k`-th found effect.
fn is_own(model: &PoseSearch, k: usize, parameter: usize) -> bool {
    let first = model.problem.parameters.effects.len() - model.effects.len();
    model.problem.parameters.list[parameter].coefficient_of() == Some(first + k)
}

/// The parameters of the fit with the coefficients of the `k`-th found effect at zero.
fn beta_without(model: &PoseSearch, k: usize) -> Vec<f64> {
    model.fit.beta.iter().enumerate().map(|(j, b)| if is_own(model, k, j) { 0.0 } else { *b }).collect()
}

/// The aliases of the `k`-th found effect, the most probable first, among the candidates that are nearest to it.
fn of_effect(
    model: &PoseSearch,
    k: usize,
    nearest: Vec<&Candidate>,
    interrupt: Interrupt<'_>,
) -> Result<Vec<PoseAlias>, Diagnostic> {
    let (found, problem) = (&model.effects[k].effect, &model.problem);
    let is_own = |j: &usize| is_own(model, k, *j);
    // The families keep the scales, and the readings the noise, of the model with the effect.
    let mut all = problem.clone();
    let present = all.parameters.list.len();
    let mut beta = beta_without(model, k);
    let is_new = |candidate: &&Candidate| {
        let id = candidate.effect.id();
        !model.effects.iter().any(|accepted| accepted.effect.id() == id)
    };
    let tried: Vec<&Candidate> = nearest.into_iter().filter(is_new).take(MAX_TUNED_ALIASES).collect();
    let mut own = vec![(0..present).filter(is_own).collect::<Vec<usize>>()];
    for candidate in &tried {
        let next = all.parameters.list.len();
        all.add_effect(&candidate.effect)?;
        own.push((next..all.parameters.list.len()).collect());
    }
    beta.resize(all.parameters.list.len(), 0.0);
    let equations = FoldEquations::of(&all, &beta)?;
    let others: Vec<usize> = (0..present).filter(|j| !is_own(j)).collect();
    let models = equations.bordered(&others, false, &all)?;
    let explained =
        |sets: &[usize]| models.explained(&sets.iter().flat_map(|k| own[*k].iter().copied()).collect::<Vec<_>>());
    let nothing = explained(&[])?;
    let by_found = explained(&[0])? - nothing;
    let mut aliases: Vec<PoseAlias> = Vec::new();
    for (place, candidate) in tried.iter().enumerate() {
        interrupt.check()?;
        let by_alias = explained(&[place + 1])? - nothing;
        let delta_chi2 = by_found - by_alias;
        let shared = by_found + by_alias - (explained(&[0, place + 1])? - nothing);
        if delta_chi2 <= 2.0 * INDISTINGUISHABLE && shared >= 0.5 * by_found {
            let prior_cost = prior_cost(&candidate.effect) - prior_cost(found);
            aliases.push(PoseAlias { effect: candidate.effect.clone(), delta_chi2, prior_cost });
        }
    }
    let cost = |alias: &PoseAlias| 0.5 * alias.delta_chi2 + alias.prior_cost;
    aliases.sort_by(|a, b| cost(a).total_cmp(&cost(b)).then_with(|| a.effect.id().cmp(&b.effect.id())));
    aliases.dedup_by(|a, b| a.effect.id() == b.effect.id());
    Ok(aliases)
}
