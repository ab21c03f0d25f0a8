//! Single effects beside families, or in their place.
//!
//! The candidates of the library are screened by their gain in the residual of the model with the families. The best
//! are fitted together with the families, which keep their scales. One is added only if its gain is significant among
//! all candidates with the inflated noise of the families, and if it lowers the held-out error over blocks of joint
//! space by more than the standard error of the decrease. Of those that fit equally well the simplest is added. A
//! harmonic of a joint about its own axis frees that order from the prior of its spectrum.

use abbe_identify::fit::families::FoldEquations;
use abbe_identify::fit::{Fit, with_families_linearised};
use abbe_identify::numerics::tails::ln_chi_square_tail;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::driver::Driver;

use super::{AcceptedEffect, PoseModel};
use crate::candidates::candidate::Candidate;
use crate::candidates::columns::{Columns, EffectColumns};
use crate::candidates::gain::TrainedModel;
use crate::candidates::gram::Gram;
use crate::candidates::library::{self, Family};
use crate::constants::{INDISTINGUISHABLE, LINES_TRIED, MAX_IN_PLACE_OF_FAMILIES};
use crate::interrupt::Interrupt;
use crate::paired::HeldOutDecrease;
use crate::plausible::prior_cost;
use crate::start::Start;
use crate::{Progress, TraceOptions, screening};

/// The candidates of the library for the declared model.
pub(super) struct Library<'c> {
    columns: &'c Columns<'c>,
    /// The products of the candidates, over the declared model and its residual.
    gram: Gram<'c>,
    candidates: Vec<Candidate>,
    families: Vec<Family>,
}

impl<'c> Library<'c> {
    /// The requested single effects of the library.
    ///
    /// # Errors
    /// If the model cannot be evaluated, or a requested string occurs in no identifier.
    pub fn of(
        problem: &Problem,
        columns: &'c Columns<'c>,
        fit: &Fit,
        options: &TraceOptions,
    ) -> Result<Library<'c>, Diagnostic> {
        let start = Start::of(problem, columns, fit)?;
        let searched = screening::searched_candidates(problem, columns, options)?;
        let is_single = |candidate: &Candidate| !candidate.last_resort && !candidate.dictionary;
        let candidates: Vec<Candidate> = searched.into_iter().filter(is_single).collect();
        let sets: Vec<EffectColumns> = candidates.iter().map(|candidate| candidate.columns.clone()).collect();
        let gram = Gram::new(columns, sets, start.model.clone(), &start.residual, start.prior());
        Ok(Library { columns, gram, candidates, families: library::families()? })
    }

    /// The candidates with a gain in each of some residuals, the largest evidence first, without some effects.
    ///
    /// # Errors
    /// If the gains cannot be computed, or `INTERRUPTED`.
    pub fn nearest(
        &self,
        effects: &[AcceptedEffect],
        residuals: &[Vec<Vec<f64>>],
        interrupt: Interrupt<'_>,
    ) -> Result<Vec<Vec<&Candidate>>, Diagnostic> {
        let candidates = |scored: Scored| scored.best.into_iter().map(|k| &self.candidates[k]).collect();
        Ok(scored(self, effects, residuals, interrupt)?.into_iter().map(candidates).collect())
    }

    /// Number of candidates.
    pub fn count(&self) -> usize {
        self.candidates.len()
    }
}

/// How a search for single effects ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ended {
    /// Number of candidates that are observable beside the declared parameters.
    pub detectable: usize,
    /// p-value of the best effect that was not added.
    pub last_p_value: f64,
}

/// Limits of a search for single effects.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Maximum number of effects of the model.
    pub effects: usize,
    /// Probability that an effect is added to readings without one.
    pub significance: f64,
    /// The held-out rms of the model with families, mm, if the single effects are to take the place of families. The search
    /// ends when it cannot reach this value.
    pub to_reach_mm: Option<f64>,
}

/// Adds single effects to a model until none lowers the held-out error, or a limit is reached.
///
/// # Errors
/// If a model cannot be fitted, or `INTERRUPTED`; `found` then holds the effects accepted so far.
pub(super) fn add(
    found: &mut PoseModel,
    library: &Library<'_>,
    limits: Limits,
    interrupt: Interrupt<'_>,
) -> Result<Ended, Diagnostic> {
    let mut ended = Ended { detectable: 0, last_p_value: 1.0 };
    let mut added = 0;
    while found.effects.len() < limits.effects {
        interrupt.check()?;
        let ranked = ranked(library, found, interrupt)?;
        ended.detectable = ranked.detectable;
        let tried: Vec<&Candidate> = ranked.best.iter().map(|k| &library.candidates[*k]).collect();
        let (best, last_p_value) = best_of(found, &tried, library.count(), limits.significance, interrupt)?;
        ended.last_p_value = last_p_value;
        let Some(best) = best else { break };
        let before_mm = found.near.held_out_rms_mm;
        let mut with = found.problem.clone();
        with.add_effect(&best.candidate.effect)?;
        let mut beta = found.near.beta.clone();
        beta.resize(with.parameters.list.len(), 0.0);
        interrupt.check()?;
        (found.problem, found.near) = with_families_linearised(with, beta, found.near.inflation)?;
        added += 1;
        let family = library.families.get(best.candidate.family);
        found.effects.push(AcceptedEffect {
            effect: best.candidate.effect.clone(),
            group: family.map(|family| family.name.clone()).unwrap_or_default(),
            is_single: true,
            p_value: best.p_value,
            heldout_rms_mm: best.held_out_mm,
            aliases: Vec::new(),
        });
        let Some(to_reach_mm) = limits.to_reach_mm else {
            let (id, unit) = (best.candidate.effect.id(), found.problem.unit());
            (interrupt.0)(Progress::SelectedEffect(found.effects.len(), id, best.held_out_mm * 1e3, unit));
            continue;
        };
        // No later effect lowers the error by more than this one did.
        let [now, before, least] = [found.near.held_out_rms_mm, before_mm, to_reach_mm].map(|rms| rms * rms);
        let further = MAX_IN_PLACE_OF_FAMILIES.saturating_sub(added) as f64;
        if now - further * (before - now).max(0.0) > least {
            break;
        }
    }
    Ok(ended)
}

/// The candidates with a gain in a residual.
#[derive(Default)]
struct Scored {
    /// Candidates other than the accepted effects, the largest score first.
    best: Vec<usize>,
    /// Number of candidates that are observable beside the declared parameters.
    detectable: usize,
}

/// The candidates with the largest gains in the residual of a model.
fn ranked(library: &Library<'_>, found: &PoseModel, interrupt: Interrupt<'_>) -> Result<Scored, Diagnostic> {
    let residuals = std::slice::from_ref(&found.near.residuals);
    let mut of_residuals = scored(library, &found.effects, residuals, interrupt)?;
    let Scored { best, detectable } = of_residuals.pop().unwrap_or_default();
    // One for each component and driver, so that the neighbouring orders of one cause do not take all places.
    let mut kinds: Vec<(String, Driver)> = Vec::new();
    let mut is_new = |k: &usize| {
        let effect = &library.candidates[*k].effect;
        let kind = (effect.component.to_string(), effect.driver.clone());
        let new = !kinds.contains(&kind);
        kinds.push(kind);
        new
    };
    Ok(Scored { best: best.into_iter().filter(|k| is_new(k)).take(LINES_TRIED).collect(), detectable })
}

/// The candidates with a gain in each of some residuals.
fn scored(
    library: &Library<'_>,
    effects: &[AcceptedEffect],
    residuals: &[Vec<Vec<f64>>],
    interrupt: Interrupt<'_>,
) -> Result<Vec<Scored>, Diagnostic> {
    let Library { columns, gram, candidates, .. } = library;
    let whitened: Vec<Vec<f64>> = residuals.iter().map(|residuals| columns.whitened_values(residuals)).collect();
    let should_continue = || interrupt.check().is_ok();
    let grams = gram.with_residuals(&whitened, &should_continue)?;
    let folds: Vec<usize> = (0..columns.fold_rows.len()).collect();
    let chosen: Vec<_> = effects.iter().map(|accepted| &accepted.effect).collect();
    let scored = |(gram, residual): (Gram<'_>, &Vec<f64>)| {
        let square: f64 = residual.iter().map(|value| value * value).sum();
        let variance = (square / columns.rows().max(1) as f64).max(f64::MIN_POSITIVE);
        let gains = TrainedModel::new(&gram, &[], &folds)?.gains(&|_| true)?;
        let mut scores: Vec<(usize, f64)> = (gains.iter().enumerate())
            .filter(|(k, gain)| gain.freedom > 0 && !chosen.contains(&&candidates[*k].effect))
            .map(|(k, gain)| (k, -ln_chi_square_tail(gain.gain / variance, gain.freedom) - candidates[k].cost))
            .collect();
        scores.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let detectable = gains.iter().filter(|gain| gain.freedom > 0).count();
        Ok(Scored { best: scores.into_iter().map(|(k, _)| k).collect(), detectable })
    };
    grams.into_iter().zip(&whitened).map(scored).collect()
}

/// A candidate that lowers the held-out error.
struct Lowering<'c> {
    candidate: &'c Candidate,
    /// Probability of a gain as large among all candidates.
    p_value: f64,
    /// Held-out rms with it, mm.
    held_out_mm: f64,
    /// Decrease of the sum of squares of the held-out residuals.
    decrease: f64,
    /// Decrease of χ².
    gain: f64,
}

/// The candidate that lowers the held-out error most, by more than the standard error of the decrease, or the simplest of
/// those that the readings do not tell from it; and the least p-value of the candidates.
fn best_of<'c>(
    found: &PoseModel,
    tried: &[&'c Candidate],
    candidates: usize,
    significance: f64,
    interrupt: Interrupt<'_>,
) -> Result<(Option<Lowering<'c>>, f64), Diagnostic> {
    let mut all = found.problem.clone();
    let present = all.parameters.list.len();
    let mut own = Vec::new();
    for candidate in tried {
        let first = all.parameters.list.len();
        all.add_effect(&candidate.effect)?;
        own.push(first..all.parameters.list.len());
    }
    let mut beta = found.near.beta.clone();
    beta.resize(all.parameters.list.len(), 0.0);
    let equations = FoldEquations::of(&all, &beta)?;
    interrupt.check()?;
    let models = equations.bordered(&(0..present).collect::<Vec<_>>(), true, &all)?;
    let (without, by_present) = (models.held_out(&[])?, models.explained(&[])?);
    let mut accepted: Vec<Lowering<'c>> = Vec::new();
    let mut last = 1.0_f64;
    for (candidate, own) in tried.iter().zip(own) {
        interrupt.check()?;
        let own: Vec<usize> = own.collect();
        let with = models.held_out(&own)?;
        let decrease = HeldOutDecrease::over_blocks(&without, &with);
        // The best of all candidates, by the bound of Bonferroni.
        let gain = (models.explained(&own)? - by_present).max(0.0);
        let tail = ln_chi_square_tail(gain, candidate.columns.count);
        let p_value = (tail + (candidates as f64).ln()).min(0.0).exp();
        last = last.min(p_value);
        if p_value <= significance && decrease.is_significant() {
            let held_out_mm = (with.iter().sum::<f64>() / equations.readings()).sqrt() * all.noise.likelihood_mm();
            accepted.push(Lowering { candidate, p_value, held_out_mm, decrease: decrease.by, gain });
        }
    }
    let lowest = accepted.iter().max_by(|a, b| a.decrease.total_cmp(&b.decrease));
    let least_gain = lowest.map_or(0.0, |best| best.gain - 2.0 * INDISTINGUISHABLE);
    let length = |one: &Lowering<'_>| prior_cost(&one.candidate.effect) + one.candidate.description_length();
    let equal = accepted.into_iter().filter(|one| one.gain >= least_gain);
    let simplest = equal.min_by(|a, b| length(a).total_cmp(&length(b)).then(b.decrease.total_cmp(&a.decrease)));
    Ok((simplest, last))
}
