//! Tunes shapes with numbers (a period, a time constant, a centre, a width) off the grid of the library.
//!
//! Candidates are tuned before they are compared. On the grid, a wrong component may have a larger gain than the true
//! one, which gains more at its own optimum. Every component near the best is therefore tuned first.

use std::collections::HashMap;
use std::sync::Arc;

use abbe_identify::numerics::golden_section::highest;
use abbe_identify::numerics::parallel;
use abbe_identify::numerics::tails::most_evidence;
use abbe_model::Diagnostic;
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

/// Relative difference of numbers that is rounding.
const ROUNDING: f64 = 1e-9;

/// Groups of candidates with their values, each group and all groups the best first: at most `most` groups that have a value
/// of at least `least`.
fn best_first(groups: impl Iterator<Item = Vec<(usize, f64)>>, least: f64, most: usize) -> Vec<Vec<(usize, f64)>> {
    let order = |a: &(usize, f64), b: &(usize, f64)| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0));
    let mut groups: Vec<Vec<(usize, f64)>> = groups
        .map(|mut members| {
            members.sort_by(order);
            members
        })
        .filter(|members| members[0].1 >= least)
        .collect();
    groups.sort_by(|a, b| order(&a[0], &b[0]));
    groups.truncate(most);
    groups
}

impl SearchState<'_> {
    /// Adds to the candidates those near the best, with their shape numbers tuned beside some candidates on some folds,
    /// and the step tables near the best. Returns the gains of the candidates that were present before.
    pub fn tune_near_best(&mut self, beside: &[usize], folds: &[usize]) -> Result<Vec<Gain>, Diagnostic> {
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

    fn tuned_near_best(&self, model: &TrainedModel<'_>, gains: &[Gain]) -> Result<Vec<Tuned>, Diagnostic> {
        let variance = self.variance(model);
        let most = self.effort(&model.folds).tuned;
        let mut nearest: HashMap<String, Vec<(usize, f64)>> = HashMap::new();
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
            if !self.candidates[candidate].brackets().is_empty() {
                nearest.entry(self.effect(candidate).id()).or_default().push((candidate, evidence));
            }
        }
        let near = best_first(nearest.into_values(), MIN_EVIDENCE_SHARE * best, most);
        let tuning = model.tuning();
        let mut fresh = self.with_best_numbers_of_each(&tuning, model, &near, gains);
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
    ) -> Result<Vec<Tuned>, Diagnostic> {
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
    ) -> Result<Option<usize>, Diagnostic> {
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
    fn step_table_of(&self, model: &TrainedModel<'_>, id: &str) -> Result<Option<StepTable>, Diagnostic> {
        let has_positions = |candidate: &Arc<Candidate>| !candidate.effect.shape.positions().is_empty();
        let own = |candidate: &Arc<Candidate>| {
            candidate.dictionary && has_positions(candidate) && candidate.effect.id() == id
        };
        let Some(dictionary) = self.candidates.iter().position(own) else { return Ok(None) };
        best_step_table(model, dictionary, &self.candidates[dictionary], self.variance(model))
    }

    /// Tunes what may stand in the place of each selected effect: on the grid of the library an alias can explain much less
    /// than with its own best numbers.
    pub fn tune_aliases(&mut self) -> Result<(), Diagnostic> {
        let folds = self.selection.branches[ALL].folds.clone();
        for k in 0..self.selected().len() {
            let fresh = self.tuned_in_place_of(k)?;
            self.add_tuned(fresh, &folds);
        }
        Ok(())
    }

    fn tuned_in_place_of(&self, k: usize) -> Result<Vec<Tuned>, Diagnostic> {
        let model = self.model_without(Some(k))?;
        let least = MIN_SHARE_ON_GRID * model.gain(self.selected()[k].candidate)?.gain;
        let gains = self.gains(&model)?;
        let mut tunable: HashMap<String, Vec<(usize, f64)>> = HashMap::new();
        for (candidate, gain) in gains.iter().enumerate() {
            let is_tunable = !self.candidates[candidate].brackets().is_empty();
            if is_tunable && gain.gain >= least && self.may_be_added(candidate, &model.folds) {
                tunable.entry(self.effect(candidate).id()).or_default().push((candidate, gain.gain));
            }
        }
        let near = best_first(tunable.into_values(), least, MAX_TUNED_ALIASES);
        let fresh = self.with_best_numbers_of_each(&model.tuning(), &model, &near, &gains).into_iter();
        Ok(fresh.filter(|tuned| !self.candidates.iter().any(|present| present.effect == tuned.effect)).collect())
    }

    /// The effect with the largest gain of each group of candidates with one identifier, the best first, with its numbers
    /// tuned: from the best on the grid, and from those that are no neighbours of a better one. The gain of a wave over few
    /// periods has several maxima, and between two points of the grid the highest of them loses up to half.
    fn with_best_numbers_of_each(
        &self,
        tuning: &Tuning<'_>,
        model: &TrainedModel<'_>,
        groups: &[Vec<(usize, f64)>],
        gains: &[Gain],
    ) -> Vec<Tuned> {
        let most = self.effort(&model.folds).starts;
        let starts: Vec<(usize, usize)> = groups
            .iter()
            .enumerate()
            .flat_map(|(group, members)| self.starts(members, most).into_iter().map(move |start| (group, start)))
            .collect();
        let tuned = |k: usize| {
            let (group, start) = starts[k];
            let (tuned, gain) = self.with_best_numbers(tuning, model, start, gains[start].gain)?;
            let on_grid = gains[groups[group][0].0].gain;
            (gain > on_grid).then_some((group, tuned, gain))
        };
        let mut of_group: Vec<Option<(Tuned, f64)>> = groups.iter().map(|_| None).collect();
        for (group, tuned, gain) in parallel::map(starts.len(), &tuned).into_iter().flatten() {
            if of_group[group].as_ref().is_none_or(|(_, best)| gain > *best) {
                of_group[group] = Some((tuned, gain));
            }
        }
        of_group.into_iter().flatten().map(|(tuned, _)| tuned).collect()
    }

    /// The candidates of one identifier from which its numbers are tuned, at most `most`. The members come best first, each
    /// with its gain or evidence.
    fn starts(&self, members: &[(usize, f64)], most: usize) -> Vec<usize> {
        let is_neighbour = |candidate: usize, better: usize| {
            let shape = &self.effect(candidate).shape;
            let brackets = self.candidates[better].brackets();
            let within = |(which, [low, high]): (usize, &[f64; 2])| {
                let slack = ROUNDING * (high - low);
                (low - slack..=high + slack).contains(&shape.number(which))
            };
            brackets.iter().enumerate().all(within)
        };
        let mut starts: Vec<usize> = Vec::new();
        for (candidate, value) in members {
            if starts.len() == most || *value < MIN_SHARE_ON_GRID * members[0].1 {
                break;
            }
            if !starts.iter().any(|better| is_neighbour(*candidate, *better)) {
                starts.push(*candidate);
            }
        }
        starts
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
