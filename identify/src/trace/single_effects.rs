//! The second stage of a search with families: single effects beside them.
//!
//! The candidates of the library are screened by their gain in the residual of the model with the families. The best
//! are fitted together with the families, which keep their scales. One is added only if its gain is significant among
//! all candidates with the inflated noise of the families, and if it lowers the held-out error over blocks of joint
//! space by more than the standard error of the decrease. A harmonic of a joint about its own axis
//! frees that order from the prior of its spectrum.

use abbe_model::driver::Driver;

use super::constants::LINES_TRIED;
use super::families::{AcceptedEffect, AcceptedFamilies};
use super::interrupt::Interrupt;
use super::screening;
use super::start::Start;
use super::{Progress, TraceOptions};
use crate::candidates::candidate::Candidate;
use crate::candidates::columns::{Columns, EffectColumns};
use crate::candidates::gain::TrainedModel;
use crate::candidates::gram::Gram;
use crate::candidates::library;
use crate::error::IdentifyError;
use crate::fit::families::FoldEquations;
use crate::fit::{Fit, with_families};
use crate::numerics::tails::ln_chi_square_tail;
use crate::problem::Problem;

/// How the stage ended.
pub(super) struct SingleEffects {
    /// Number of screened candidates.
    pub candidates: usize,
    /// Number of those that are observable beside the declared parameters.
    pub detectable: usize,
    /// p-value of the best effect that was not added.
    pub last_p_value: f64,
}

/// Adds single effects to accepted families until none lowers the held-out error, or there are `most` effects.
///
/// # Errors
/// If a model cannot be fitted, or [`IdentifyError::Interrupted`]; `found` then holds the effects accepted so far.
pub(super) fn add(
    (problem, fit): (&Problem, &Fit),
    found: &mut AcceptedFamilies,
    options: &TraceOptions,
    most: usize,
    interrupt: Interrupt<'_>,
) -> Result<SingleEffects, IdentifyError> {
    let columns = Columns::new(problem, &fit.beta);
    let start = Start::of(problem, &columns, fit)?;
    let searched = screening::searched_candidates(problem, &columns, options)?;
    let candidates: Vec<Candidate> =
        searched.into_iter().filter(|candidate| !candidate.last_resort && !candidate.dictionary).collect();
    (interrupt.0)(Progress::Screening(candidates.len()));
    let families = library::families()?;
    let mut ended = SingleEffects { candidates: candidates.len(), detectable: 0, last_p_value: 1.0 };
    while found.effects.len() < most {
        interrupt.check()?;
        let ranked = ranked(&columns, &candidates, &start, found, interrupt)?;
        ended.detectable = ranked.detectable;
        let tried: Vec<&Candidate> = ranked.best.iter().map(|k| &candidates[*k]).collect();
        let best = best_of(found, &tried, &mut ended, options.significance, interrupt)?;
        let Some((candidate, p_value, held_out_mm)) = best else { break };
        let mut with = found.problem.clone();
        with.add_effect(&candidate.effect)?;
        let mut beta = found.fit.beta.clone();
        beta.resize(with.parameters.list.len(), 0.0);
        interrupt.check()?;
        (found.problem, found.fit) = with_families(with, beta)?;
        found.effects.push(AcceptedEffect {
            effect: candidate.effect.clone(),
            group: families.get(candidate.family).map(|family| family.name.clone()).unwrap_or_default(),
            p_value,
            heldout_rms_mm: held_out_mm,
        });
        let id = candidate.effect.id();
        let unit = found.problem.unit();
        (interrupt.0)(Progress::SelectedEffect(found.effects.len(), id, held_out_mm * 1e3, unit));
    }
    Ok(ended)
}

/// The candidates with the largest gains in the residual, the largest first.
struct Ranked {
    best: Vec<usize>,
    detectable: usize,
}

fn ranked(
    columns: &Columns<'_>,
    candidates: &[Candidate],
    start: &Start,
    found: &AcceptedFamilies,
    interrupt: Interrupt<'_>,
) -> Result<Ranked, IdentifyError> {
    let sets: Vec<EffectColumns> = candidates.iter().map(|candidate| candidate.columns.clone()).collect();
    let residual = columns.whitened_values(&found.fit.residuals);
    let should_continue = || interrupt.check().is_ok();
    let gram = Gram::new(columns, sets, start.model.clone(), &residual, start.prior());
    let folds: Vec<usize> = (0..columns.fold_rows.len()).collect();
    gram.prepare(&[], &should_continue)?;
    let trained = TrainedModel::new(&gram, &[], &folds)?;
    let square: f64 = residual.iter().map(|value| value * value).sum();
    let variance = (square / columns.rows().max(1) as f64).max(f64::MIN_POSITIVE);
    let gains = trained.gains(&|_| true)?;
    let chosen: Vec<_> = found.effects.iter().map(|found| &found.effect).collect();
    let mut scored: Vec<(usize, f64)> = (gains.iter().enumerate())
        .filter(|(k, gain)| gain.freedom > 0 && !chosen.contains(&&candidates[*k].effect))
        .map(|(k, gain)| (k, -ln_chi_square_tail(gain.gain / variance, gain.freedom) - candidates[k].cost))
        .collect();
    let detectable = gains.iter().filter(|gain| gain.freedom > 0).count();
    scored.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    // One for each component and driver, so that the neighbouring orders of one cause do not take all places.
    let mut kinds: Vec<(String, Driver)> = Vec::new();
    let mut is_new = |k: usize| {
        let kind = (candidates[k].effect.component.to_string(), candidates[k].effect.driver.clone());
        let new = !kinds.contains(&kind);
        kinds.push(kind);
        new
    };
    let best = scored.into_iter().map(|(k, _)| k).filter(|k| is_new(*k)).take(LINES_TRIED).collect();
    Ok(Ranked { best, detectable })
}

/// The candidate that lowers the held-out error most, if by more than the standard error of the decrease; its p-value
/// and the held-out rms with it, mm.
fn best_of<'c>(
    found: &AcceptedFamilies,
    tried: &[&'c Candidate],
    ended: &mut SingleEffects,
    significance: f64,
    interrupt: Interrupt<'_>,
) -> Result<Option<(&'c Candidate, f64, f64)>, IdentifyError> {
    let mut all = found.problem.clone();
    let present = all.parameters.list.len();
    let mut own = Vec::new();
    for candidate in tried {
        let first = all.parameters.list.len();
        all.add_effect(&candidate.effect)?;
        own.push(first..all.parameters.list.len());
    }
    let mut beta = found.fit.beta.clone();
    beta.resize(all.parameters.list.len(), 0.0);
    let equations = FoldEquations::of(&all, &beta, &all.triangles(&beta)?);
    interrupt.check()?;
    let without = equations.with_parameters(&(0..present).collect::<Vec<_>>()).at_present(&all)?;
    let mut best: Option<(&Candidate, f64, f64, f64)> = None;
    let mut last = 1.0_f64;
    for (candidate, own) in tried.iter().zip(own) {
        interrupt.check()?;
        let parameters: Vec<usize> = (0..present).chain(own).collect();
        let with = equations.with_parameters(&parameters).at_present(&all)?;
        let decrease = with.decrease_from(&without);
        // The best of all candidates, by the bound of Bonferroni.
        let gain = (with.explained() - without.explained()).max(0.0);
        let tail = ln_chi_square_tail(gain, candidate.columns.count);
        let p_value = (tail + (ended.candidates as f64).ln()).min(0.0).exp();
        last = last.min(p_value);
        let accepted = p_value <= significance && decrease.is_significant();
        if accepted && best.as_ref().is_none_or(|(_, by, ..)| decrease.by > *by) {
            let held_out_mm = (with.held_out_sum() / equations.readings()).sqrt() * all.noise.likelihood_mm();
            best = Some((*candidate, decrease.by, p_value, held_out_mm));
        }
    }
    ended.last_p_value = last;
    Ok(best.map(|(candidate, _, p_value, held_out_mm)| (candidate, p_value, held_out_mm)))
}
