//! The search. Each round projects out the present model, scores every candidate, and adds the best. Moves then remove
//! effects that are no longer significant, exchange effects for better ones and merge them. The search ends when the
//! best remaining candidate is no better than the best on readings without structure and no move finds a better set, or
//! when additions do not lower the held-out error.

use abbe_model::Diagnostic;
use abbe_model::effect::Effect;

use super::constants::MAX_REJECTED_IN_A_ROW;
use super::judge::RefittedModel;
use super::moves::add::Add;
use super::moves::remove::Remove;
use super::moves::withdraw::Withdraw;
use super::moves::{self, Move};
use super::state::{ALL, SearchBranch, SearchState};
use super::{Progress, SearchStep};

/// The record of a search, and its progress.
pub(super) struct SearchRecord<'t> {
    /// The additions so far.
    pub steps: Vec<SearchStep>,
    /// Standard deviation of a reading, µm.
    pub noise_um: f64,
    /// The best candidate that was not significant when the search ended.
    pub strongest: Option<Effect>,
    /// Receives the progress. Returns whether to continue.
    pub progress: &'t (dyn Fn(Progress) -> bool + Sync),
}

impl SearchRecord<'_> {
    /// Records accepted additions.
    fn note(&mut self, search: &SearchState<'_>, added: impl Iterator<Item = usize>) {
        let held_out = search.selection.held_out.last().copied().unwrap_or(0.0);
        let heldout_um = (held_out / search.columns.rows().max(1) as f64).sqrt() * self.noise_um;
        let effects = search.selected().len();
        for candidate in added {
            let id = search.effect(candidate).id();
            self.steps.push(SearchStep { id: id.clone(), effects, heldout_um });
            (self.progress)(Progress::SelectedEffect(effects, id, heldout_um, search.columns.unit()));
        }
    }
}

/// The outcome of a round.
enum Round {
    /// A candidate was added.
    Added(usize),
    /// A move found a better set of effects.
    Changed,
    /// No remaining candidate is significant: the p-value of the best.
    Done(f64),
}

/// Searches and refits. If significant structure remains, the search continues with nonparametric curves. Effects that
/// explain nothing are withdrawn: those that curves replace, and all of them if together they do not lower the held-out
/// error. Returns the p-value at which the search ended ([`search_on`]) and the refitted model.
///
/// # Errors
/// `INTERRUPTED` if the caller stopped the trace. [`SearchState::roll_back`] then restores the
/// accepted effects.
pub(super) fn search_and_refit(
    search: &mut SearchState<'_>,
    record: &mut SearchRecord<'_>,
    judge: impl Fn(&SearchState<'_>) -> Result<RefittedModel, Diagnostic>,
) -> Result<(f64, RefittedModel), Diagnostic> {
    // A search that begins anew has not tuned anything yet.
    let mut start = search.clone();
    let (mut ended, mut judged) = search_to_curves(search, record, &judge)?;
    if let Some(smooth) = with_smooth_shapes(search, &mut start, record, &judge)? {
        (ended, judged) = smooth;
    }
    // An effect whose number has no value in these readings is no effect of its own.
    loop {
        let found = judged.estimated(search).iter();
        let beyond: Vec<String> = found.filter(|effect| search.is_beyond_library(effect)).map(Effect::id).collect();
        if beyond.is_empty() {
            break;
        }
        start.forbid(&beyond);
        search.clone_from(&start);
        record.steps.clear();
        (ended, judged) = search_to_curves(search, record, &judge)?;
    }
    if search.policy.withdraws {
        moves::on_every_branch(&Withdraw { structured: judged.is_structured() }, search)?;
        search.note_held_out()?;
        search.withdraw_all_unless_better();
        if !judged.is_of(search) {
            judged = judge(search)?;
        }
    }
    Ok((ended, judged))
}

/// Searches and refits, with nonparametric curves if structure remains without them.
fn search_to_curves(
    search: &mut SearchState<'_>,
    record: &mut SearchRecord<'_>,
    judge: &impl Fn(&SearchState<'_>) -> Result<RefittedModel, Diagnostic>,
) -> Result<(f64, RefittedModel), Diagnostic> {
    let mut ended = search_on(search, record)?;
    (record.progress)(Progress::Judging);
    let mut judged = judge(search)?;
    if judged.is_structured() && search.selected().len() < search.policy.max_effects {
        search.last_resort = true;
        ended = search_on(search, record)?;
        if !judged.is_of(search) {
            judged = judge(search)?;
        }
    }
    Ok((ended, judged))
}

/// Searches once more without the staircases that were found: with enough steps they approximate any shape. A staircase stays
/// if the objective of the whole model is higher than without it. Otherwise the model of the other shapes takes its place, and is
/// returned. `start` is the state before the first round.
fn with_smooth_shapes<'s>(
    search: &mut SearchState<'s>,
    start: &mut SearchState<'s>,
    record: &mut SearchRecord<'_>,
    judge: &impl Fn(&SearchState<'_>) -> Result<RefittedModel, Diagnostic>,
) -> Result<Option<(f64, RefittedModel)>, Diagnostic> {
    if !search.has_staircase() {
        return Ok(None);
    }
    let mut smooth = start.clone();
    smooth.forbid(&start.staircases());
    let found = std::mem::replace(search, smooth.clone());
    let (steps, strongest) = (std::mem::take(&mut record.steps), record.strongest.clone());
    // An interruption keeps what was found.
    let ended = search_on(search, record);
    if ended.is_err() || found.objective_of_selected()? > search.objective_of_selected()? {
        (*search, record.steps, record.strongest) = (found, steps, strongest);
        return ended.map(|_| None);
    }
    *start = smooth;
    search_to_curves(search, record, judge).map(Some)
}

/// Runs rounds until no candidate is significant, or until additions do not lower the held-out error. The accepted
/// effects remain. Returns the p-value of the best candidate that was not added.
fn search_on(search: &mut SearchState<'_>, record: &mut SearchRecord<'_>) -> Result<f64, Diagnostic> {
    // Additions since the last acceptance.
    let mut pending = Vec::new();
    let mut ended = None;
    // A merge of effects permits further additions. The limit on rounds guarantees termination.
    for _ in 0..search.policy.max_effects.saturating_add(search.policy.max_effects / 2).max(1) {
        match round(search, record)? {
            Round::Done(p_value) => ended = Some(p_value),
            Round::Changed => pending.push(None),
            Round::Added(candidate) => pending.push(Some(candidate)),
        }
        search.note_held_out()?;
        if search.accept() {
            record.note(search, pending.drain(..).flatten());
        }
        if ended.is_some() || pending.len() >= MAX_REJECTED_IN_A_ROW {
            break;
        }
    }
    search.withdraw_rejected();
    // Without an end by the evidence, no p-value is available for further additions.
    Ok(ended.unwrap_or(1.0))
}

/// Adds the best candidate if it is significant, and improves the selected effects.
fn round(search: &mut SearchState<'_>, record: &mut SearchRecord<'_>) -> Result<Round, Diagnostic> {
    let (p_value, added) = add_best(search, record)?;
    if let Some(candidate) = added {
        for name in search.policy.after_addition {
            moves::run(*name, search)?;
        }
        return Ok(Round::Added(candidate));
    }
    for name in search.policy.without_addition {
        if moves::run(*name, search)? {
            return Ok(Round::Changed);
        }
    }
    Ok(Round::Done(p_value))
}

/// Adds the best candidate if it is significant. Returns its p-value, and the candidate if it was added.
fn add_best(search: &mut SearchState<'_>, record: &mut SearchRecord<'_>) -> Result<(f64, Option<usize>), Diagnostic> {
    let Some((best, p_value, threshold)) = search.best_against_null()? else {
        return Ok((1.0, None));
    };
    search.thresholds.push(threshold);
    if p_value > search.policy.significance || search.selected().len() >= search.policy.max_effects {
        record.strongest = Some(search.effect(best).clone());
        return Ok((p_value, None));
    }
    record.strongest = None;
    let before = search.selection.branches.clone();
    if !moves::on_every_branch(&Add { p_value }, search)? {
        return Ok((p_value, None));
    }
    if search.policy.every_addition_lowers_heldout && !lowers_heldout(search, &before)? {
        search.selection.branches = before;
        return Ok((p_value, None));
    }
    let added = search.selected().last().map(|selected| selected.candidate);
    Remove { threshold }.try_on(search, ALL)?;
    search.follow_all_readings();
    Ok((p_value, added))
}

/// Whether an addition lowers the held-out error. If the policy tries several candidates, the significant ones of other
/// components and drivers are added in place of the first, each to the branches as they were before; the addition with the
/// lowest held-out error remains.
fn lowers_heldout(search: &mut SearchState<'_>, before: &[SearchBranch]) -> Result<bool, Diagnostic> {
    let before_heldout = search.selection.held_out.last().copied().unwrap_or(f64::INFINITY);
    let mut lowest = (search.held_out_now()?, search.selection.branches.clone());
    for _ in 1..search.policy.tried {
        search.pass_over_last();
        search.selection.branches = before.to_vec();
        let Some((_, p_value, _)) = search.best_against_null()? else { break };
        if p_value > search.policy.significance || !moves::on_every_branch(&Add { p_value }, search)? {
            break;
        }
        let held_out = search.held_out_now()?;
        if held_out < lowest.0 {
            lowest = (held_out, search.selection.branches.clone());
        }
    }
    search.passed_over.clear();
    search.selection.branches = lowest.1;
    Ok(lowest.0 < before_heldout)
}
