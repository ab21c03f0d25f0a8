//! Tunes shapes with numbers (a period, a time constant, a centre, a width) off the grid of the library.
//!
//! Candidates are tuned before they are compared. On the grid, a wrong component may have a larger gain than the true
//! one, which gains more at its own optimum. Every component near the best is therefore tuned first.

use std::collections::HashMap;
use std::sync::Arc;

use abbe_identify::error::IdentifyError;
use abbe_identify::numerics::golden_section::highest;
use abbe_identify::numerics::parallel;
use abbe_identify::numerics::tails::most_evidence;
use abbe_model::effect::Effect;

use super::{ALL, SearchState};
use crate::candidates::candidate::Candidate;
use crate::candidates::gain::{Gain, TrainedModel};
use crate::candidates::step_table::{StepTable, best_step_table};
use crate::candidates::tuned::{TunedChannel, Tuning};
use crate::constants::{MAX_EVIDENCE_DEFICIT, MAX_TUNED_ALIASES, MIN_EVIDENCE_SHARE, MIN_SHARE_ON_GRID};

/// An effect with tuned numbers or positions.
pub(super) struct Tuned {
    /// Index of the candidate that it was tuned from, or of its dictionary.
    pub original: usize,
    /// The effect.
    pub effect: Effect,
    /// Penalty for the selection of its positions.
    pub selection_penalty: f64,
}

impl Tuned {
    fn of(StepTable { dictionary, effect, selection_penalty, .. }: StepTable) -> Tuned {
        Tuned { original: dictionary, effect, selection_penalty }
    }
}

impl SearchState<'_> {
    /// Adds to the candidates those near the best, with their shape numbers tuned beside some candidates on some folds,
    /// and the step tables near the best. Returns the gains of the candidates that were present before.
    pub fn tune_near_best(&mut self, beside: &[usize], folds: &[usize]) -> Result<Vec<Gain>, IdentifyError> {
        let can_be_tuned = |candidate: &Arc<Candidate>| candidate.dictionary || !candidate.brackets().is_empty();
        if !self.candidates.iter().any(can_be_tuned) {
            return Ok(Vec::new());
        }
        let (gains, fresh) = {
            let model = self.model_of(beside, folds)?;
            let gains = self.gains(&model)?;
            let fresh = self.tuned_near_best(&model, &gains)?;
            (gains, fresh)
        };
        self.add_tuned(fresh, folds);
        Ok(gains)
    }

    fn tuned_near_best(&self, model: &TrainedModel<'_>, gains: &[Gain]) -> Result<Vec<Tuned>, IdentifyError> {
        let variance = self.variance(model);
        let most = self.effort(&model.folds).tuned;
        let mut nearest: HashMap<String, (usize, f64)> = HashMap::new();
        let mut best = 0.0_f64;
        for (candidate, gain) in gains.iter().enumerate() {
            if gain.freedom == 0 || !self.may_be_added(candidate, &model.folds) {
                continue;
            }
            if most_evidence(gain.gain / variance, gain.freedom) < MIN_EVIDENCE_SHARE * best {
                continue;
            }
            let evidence = self.evidence(gain, variance);
            best = best.max(evidence);
            if self.candidates[candidate].brackets().is_empty() {
                continue;
            }
            let best_of_id = nearest.entry(self.effect(candidate).id()).or_insert((candidate, evidence));
            if evidence > best_of_id.1 {
                *best_of_id = (candidate, evidence);
            }
        }
        let mut near: Vec<(usize, f64)> =
            nearest.into_values().filter(|(_, evidence)| *evidence >= MIN_EVIDENCE_SHARE * best).collect();
        near.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        near.truncate(most);
        let tuning = model.tuning();
        let tuned = |k: usize| Some(self.with_best_numbers(&tuning, model, near[k].0, gains[near[k].0].gain)?.0);
        let mut fresh: Vec<Tuned> = parallel::map(near.len(), &tuned).into_iter().flatten().collect();
        fresh.extend(self.step_tables_near_best(&tuning, model, best, most)?);
        fresh.retain(|tuned| {
            let present = |c: usize| *self.effect(c) == tuned.effect && self.may_be_used(c, &model.folds);
            !(0..self.candidates.len()).any(present)
        });
        Ok(fresh)
    }

    /// The step tables near the best evidence, with their positions tuned.
    fn step_tables_near_best(
        &self,
        tuning: &Tuning<'_>,
        model: &TrainedModel<'_>,
        best: f64,
        most: usize,
    ) -> Result<Vec<Tuned>, IdentifyError> {
        let variance = self.variance(model);
        let mut nearest = self.step_tables(model)?;
        nearest.retain(|table| table.evidence >= MIN_EVIDENCE_SHARE * best);
        nearest.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        nearest.truncate(most);
        let moved = |k: usize| {
            let table = self.with_best_positions(tuning, nearest[k].clone(), variance);
            let evidence = table.evidence + table.selection_penalty;
            let near = evidence >= best - MAX_EVIDENCE_DEFICIT || evidence - table.cost >= MIN_EVIDENCE_SHARE * best;
            near.then(|| Tuned::of(table))
        };
        Ok(parallel::map(nearest.len(), &moved).into_iter().flatten().collect())
    }

    /// A step table with its best positions.
    fn with_best_positions(&self, tuning: &Tuning<'_>, table: StepTable, variance: f64) -> StepTable {
        let dictionary = &self.candidates[table.dictionary];
        let channel = TunedChannel::of(self.columns, tuning, &dictionary.columns);
        table.with_best_positions(&channel, dictionary, variance)
    }

    /// Adds an effect with the shape numbers or positions that are best beside others. Returns its index: the effect
    /// itself if its numbers are the best already, `None` if no step table is better than a single step.
    pub fn tuned_again(
        &mut self,
        tunable: usize,
        beside: &[usize],
        folds: &[usize],
    ) -> Result<Option<usize>, IdentifyError> {
        let model = self.model_of(beside, folds)?;
        let fresh = if !self.effect(tunable).shape.positions().is_empty() {
            let table = self.step_table_of(&model, &self.effect(tunable).id())?;
            let variance = self.variance(&model);
            table.map(|table| Tuned::of(self.with_best_positions(&model.tuning(), table, variance)))
        } else {
            match self.with_best_numbers(&model.tuning(), &model, tunable, model.gain(tunable)?.gain) {
                None => return Ok(Some(tunable)),
                Some((fresh, _)) => Some(fresh),
            }
        };
        drop(model);
        Ok(fresh.map(|fresh| self.add_tuned(vec![fresh], folds)))
    }

    /// The best step table of the dictionary of an identifier for addition to a model.
    fn step_table_of(&self, model: &TrainedModel<'_>, id: &str) -> Result<Option<StepTable>, IdentifyError> {
        let has_positions = |candidate: &Arc<Candidate>| !candidate.effect.shape.positions().is_empty();
        let own = |candidate: &Arc<Candidate>| {
            candidate.dictionary && has_positions(candidate) && candidate.effect.id() == id
        };
        let Some(dictionary) = self.candidates.iter().position(own) else { return Ok(None) };
        best_step_table(model, dictionary, &self.candidates[dictionary], self.variance(model))
    }

    /// Tunes what may stand in the place of each selected effect: on the grid of the library an alias can explain much less
    /// than with its own best numbers.
    pub fn tune_aliases(&mut self) -> Result<(), IdentifyError> {
        let folds = self.selection.branches[ALL].folds.clone();
        for k in 0..self.selected().len() {
            let fresh = self.tuned_in_place_of(k)?;
            self.add_tuned(fresh, &folds);
        }
        Ok(())
    }

    fn tuned_in_place_of(&self, k: usize) -> Result<Vec<Tuned>, IdentifyError> {
        let model = self.model_without(Some(k))?;
        let least = MIN_SHARE_ON_GRID * model.gain(self.selected()[k].candidate)?.gain;
        let mut best: HashMap<String, (usize, f64)> = HashMap::new();
        for (candidate, gain) in self.gains(&model)?.iter().enumerate() {
            let is_tunable = !self.candidates[candidate].brackets().is_empty();
            if is_tunable && gain.gain >= least && self.may_be_added(candidate, &model.folds) {
                let of_id = best.entry(self.effect(candidate).id()).or_insert((candidate, gain.gain));
                if gain.gain > of_id.1 {
                    *of_id = (candidate, gain.gain);
                }
            }
        }
        let mut near: Vec<(usize, f64)> = best.into_values().collect();
        near.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        near.truncate(MAX_TUNED_ALIASES);
        let tuning = model.tuning();
        let tuned = |i: usize| Some(self.with_best_numbers(&tuning, &model, near[i].0, near[i].1)?.0);
        let fresh = parallel::map(near.len(), &tuned).into_iter().flatten();
        Ok(fresh.filter(|tuned| !self.candidates.iter().any(|present| present.effect == tuned.effect)).collect())
    }

    /// Tunes the shape numbers of an effect for the largest gain. Returns it with its gain; `None` if the gain does not
    /// increase.
    fn with_best_numbers(
        &self,
        tuning: &Tuning<'_>,
        model: &TrainedModel<'_>,
        original: usize,
        before: f64,
    ) -> Option<(Tuned, f64)> {
        let Candidate { selection_penalty, ref effect, ref columns, .. } = *self.candidates[original];
        let mut effect = effect.clone();
        let channel = TunedChannel::of(self.columns, tuning, columns);
        let brackets = self.candidates[original].brackets();
        let mut best = before;
        let steps = self.effort(&model.folds).line_search;
        // The numbers of one shape are tuned in turn.
        for _ in 0..brackets.len() {
            for (which, [low, high]) in brackets.iter().enumerate() {
                let value_at = |share: f64| low + (high - low) * share;
                let gain_at = |share: f64| {
                    let shape = effect.shape.with_number(which, value_at(share));
                    (channel.gain(&channel.effect(&shape)), Effect { shape, ..effect.clone() })
                };
                let (gain, tuned) = highest(gain_at, steps);
                if gain > best {
                    best = gain;
                    effect = tuned;
                }
            }
        }
        (best > before * (1.0 + 1e-6)).then_some((Tuned { original, effect, selection_penalty }, best))
    }
}
