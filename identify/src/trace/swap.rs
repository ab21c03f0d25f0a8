//! Exchanges that a purely additive search misses: a wrong effect in place of the true one, and one effect in place of
//! a pair.
//!
//! Each effect is exchanged for a candidate that explains clearly more together with the others. When no addition is
//! significant, effects with tunable shape numbers or positions are tuned again together with each of the next best
//! candidates. A step table or a warm-up with a free time constant can absorb most of a second effect. The second
//! effect becomes significant only when both are in the model.
//!
//! Pairs of effects are also searched jointly as replacements of two effects or of one. If two effects partly cancel
//! each other, neither is significant alone, and the search finds a single effect that approximates both.

use std::collections::HashSet;

use abbe_model::effect::Shape;

use super::compose;
use super::constants::INDISTINGUISHABLE;
use super::refine;
use super::search::{ALL, Search, SearchBranch, SelectedEffect};
use crate::candidates::gain::TrainedModel;
use crate::candidates::library::Candidate;
use crate::error::IdentifyError;

/// Maximum number of effects whose positions and periods are tuned again after an addition.
const MAX_REFINED: usize = 4;
/// Candidates tried together with an effect that is tuned again: on all readings, and with one fold left out.
const MAX_TRIED: usize = 6;
const MAX_TRIED_WITHOUT_A_FOLD: usize = 2;
/// Candidates tried as the first of a pair: in place of two effects, and in place of one or with one fold left out.
const MAX_FIRST_MEMBERS: usize = 32;
const FEW_FIRST_MEMBERS: usize = 8;
/// Maximum number of selected effects for which effects are tuned again.
const MAX_RETUNED: usize = 3;
/// Relative difference of scores below which two candidates count as equivalent.
const EQUIVALENT: f64 = 1e-6;

/// A comparison of sets of effects with the selected set.
#[derive(Clone)]
struct SetComparison {
    /// The training folds of the search.
    folds: Vec<usize>,
    /// The selected effects.
    chosen: Vec<usize>,
    /// The score that readings without structure exceed with the probability of the significance level.
    threshold: f64,
    /// The value that a set has to exceed: the best value so far, at first that of the selected set plus the
    /// confounding margin.
    most: f64,
    /// The best set that exceeds it.
    best: Option<Vec<usize>>,
}

impl SetComparison {
    fn accept_set(&mut self, set: Vec<usize>, value: f64) {
        self.most = value;
        self.best = Some(set);
    }
}

impl Search<'_> {
    /// Exchanges effects for candidates that explain clearly more.
    pub fn exchange(&mut self) -> Result<(), IdentifyError> {
        for branch in 0..self.branches.len() {
            for k in 0..self.branches[branch].selected.len() {
                self.exchange_one(branch, k)?;
            }
        }
        self.note_held_out()
    }

    /// Exchanges one effect for a candidate that explains clearly more together with the others. The improvement has to
    /// exceed the confounding margin, so that exchanges end.
    fn exchange_one(&mut self, branch: usize, k: usize) -> Result<(), IdentifyError> {
        let SearchBranch { folds, .. } = self.branches[branch].clone();
        let mut others = self.branches[branch].chosen();
        let present = others.remove(k);
        let known = if (1..MAX_REFINED).contains(&others.len()) && !self.stop.in_residual_variance {
            self.refine(&others, &folds)?
        } else {
            Vec::new()
        };
        let model = self.model_of(&others, &folds)?;
        let gains = model.remaining_gains(known);
        let score = self.score(present, &gains[present], self.variance(&model));
        let better = self
            .best_of(&model, &gains, &others)
            .filter(|(best, most)| *best != present && *most > score + INDISTINGUISHABLE)
            .map(|(best, _)| self.simplest_confounded(&model, &gains, best, &others));
        if let Some(better) = better {
            self.add_to_base(&[better]);
            self.branches[branch].selected[k].candidate = better;
        }
        Ok(())
    }

    /// Tunes effects with shape numbers or positions again together with each of the next best candidates, in addition
    /// to the others or in place of one. Selects the best of these sets if it has clearly more evidence than the
    /// present one. Returns whether the search on all readings changed.
    pub fn retune_all(&mut self) -> Result<bool, IdentifyError> {
        if self.stop.in_residual_variance {
            return Ok(false);
        }
        let changed: Vec<bool> =
            (0..self.branches.len()).map(|branch| self.retune_one(branch)).collect::<Result<_, _>>()?;
        self.note_held_out()?;
        Ok(changed[ALL])
    }

    fn retune_one(&mut self, branch: usize) -> Result<bool, IdentifyError> {
        let Some(mut comparison) = self.comparison(branch)? else {
            return Ok(false);
        };
        let SetComparison { folds, chosen, .. } = comparison.clone();
        let tunable: Vec<usize> = chosen.iter().copied().filter(|c| self.is_tunable(*c)).collect();
        for tunable in tunable {
            let removed = chosen.iter().copied().filter(|c| *c != tunable).map(Some);
            for removed in removed.chain([None]) {
                let kept = |c: &&usize| **c != tunable && Some(**c) != removed;
                let base: Vec<usize> = chosen.iter().filter(kept).copied().collect();
                if removed.is_none() && chosen.len() >= self.stop.max_effects {
                    continue;
                }
                let tried = self.next_best(&base, tunable, &folds)?;
                self.add_to_base(&tried);
                for other in tried {
                    let beside: Vec<usize> = base.iter().copied().chain([other]).collect();
                    let Some(retuned) = self.retuned(tunable, &beside, &folds)? else {
                        continue;
                    };
                    let set: Vec<usize> = beside.iter().copied().chain([retuned]).collect();
                    let value = self.evidence_with(&beside, retuned, &folds)? - self.description_length(&set);
                    if value <= comparison.most {
                        continue;
                    }
                    self.add_to_base(&[retuned]);
                    // The added effect has to be significant against readings without structure.
                    if self.is_significant_in(other, &set, &comparison)? {
                        comparison.accept_set(set, value);
                    }
                }
            }
        }
        Ok(self.replace(branch, comparison.best))
    }

    /// Searches two effects jointly in place of one or two, and selects the best pair if it has clearly more evidence.
    /// Returns whether the search on all readings changed.
    pub fn exchange_pairs(&mut self) -> Result<bool, IdentifyError> {
        if self.stop.in_residual_variance {
            return Ok(false);
        }
        // If all readings do not prefer another pair, the folds are not searched.
        if !self.exchange_pair(ALL)? {
            return Ok(false);
        }
        for branch in ALL + 1..self.branches.len() {
            self.exchange_pair(branch)?;
        }
        self.note_held_out()?;
        Ok(true)
    }

    fn exchange_pair(&mut self, branch: usize) -> Result<bool, IdentifyError> {
        let Some(mut comparison) = self.comparison(branch)? else {
            return Ok(false);
        };
        let SetComparison { folds, chosen, .. } = comparison.clone();
        let places = 0..chosen.len();
        let removed = places.clone().flat_map(|i| places.clone().filter(move |j| i <= *j).map(move |j| (i, j)));
        for (i, j) in removed {
            if i == j && chosen.len() >= self.stop.max_effects {
                continue;
            }
            let base: Vec<usize> = places.clone().filter(|k| *k != i && *k != j).map(|k| chosen[k]).collect();
            let in_place_of_two = i != j && branch == ALL;
            let count = if in_place_of_two { MAX_FIRST_MEMBERS } else { FEW_FIRST_MEMBERS };
            let firsts = self.untunable_candidates(&base, &folds, count)?;
            self.add_to_base(&firsts);
            for first in firsts {
                let beside: Vec<usize> = base.iter().copied().chain([first]).collect();
                let second = {
                    let model = self.model_of(&beside, &folds)?;
                    let gains = model.gains();
                    self.best_of(&model, &gains, &beside)
                        .map(|(best, _)| self.simplest_confounded(&model, &gains, best, &beside))
                };
                let Some(second) = second else { continue };
                let set: Vec<usize> = beside.iter().copied().chain([second]).collect();
                let value = self.evidence_with(&beside, second, &folds)? - self.description_length(&set);
                if value <= comparison.most {
                    continue;
                }
                self.add_to_base(&[second]);
                if self.is_significant_in(first, &set, &comparison)?
                    && self.is_significant_in(second, &set, &comparison)?
                {
                    comparison.accept_set(set, value);
                }
            }
        }
        Ok(self.replace(branch, comparison.best))
    }

    /// Replaces the selected effects by a set, if there is one. The largest p-value of the replaced effects applies to
    /// all of the set. Returns whether the effects were replaced.
    fn replace(&mut self, branch: usize, set: Option<Vec<usize>>) -> bool {
        let Some(set) = set else { return false };
        let selected = &mut self.branches[branch].selected;
        let p_value = selected.iter().map(|selected| selected.p_value).fold(0.0, f64::max);
        let retuned = |candidate: usize| SelectedEffect { candidate, p_value };
        *selected = set.into_iter().map(retuned).collect();
        true
    }

    /// Starts a comparison with the selected set. `None` if the set is empty or too large to be tuned again.
    fn comparison(&self, branch: usize) -> Result<Option<SetComparison>, IdentifyError> {
        let SearchBranch { folds, .. } = self.branches[branch].clone();
        let chosen = self.branches[branch].chosen();
        if !(1..=MAX_RETUNED).contains(&chosen.len()) {
            return Ok(None);
        }
        Ok(Some(SetComparison {
            threshold: self.thresholds.last().copied().unwrap_or(f64::INFINITY),
            most: self.evidence_of(&chosen, &[], &folds)? - self.description_length(&chosen) + INDISTINGUISHABLE,
            best: None,
            folds,
            chosen,
        }))
    }

    /// Whether one effect of a set scores at least the null threshold in addition to the others.
    fn is_significant_in(&self, one: usize, set: &[usize], comparison: &SetComparison) -> Result<bool, IdentifyError> {
        let others: Vec<usize> = set.iter().copied().filter(|c| *c != one).collect();
        let model = self.projection_of(&others, &comparison.folds)?;
        Ok(self.score(one, &model.gain(one), self.variance(&model)) >= comparison.threshold)
    }

    /// Effects without tunable shape numbers or positions that have a positive score in addition to some others, best
    /// first. Of equivalent effects one is kept.
    fn untunable_candidates(&self, base: &[usize], folds: &[usize], most: usize) -> Result<Vec<usize>, IdentifyError> {
        let mut ranked = self.ranked(base, folds, |candidate| !self.is_tunable(candidate))?;
        ranked.truncate(most);
        Ok(ranked)
    }

    /// The candidates with a positive score in addition to some effects, restricted to those that `accepts` accepts,
    /// best first. Of equivalent candidates one is kept. `accepts` is called in order of decreasing score.
    fn ranked(
        &self,
        base: &[usize],
        folds: &[usize],
        mut accepts: impl FnMut(usize) -> bool,
    ) -> Result<Vec<usize>, IdentifyError> {
        let model = self.model_of(base, folds)?;
        let variance = self.variance(&model);
        let gains = model.gains();
        let mut scored: Vec<(usize, f64)> = (0..self.candidates.len())
            .filter(|c| self.may_be_added(*c, folds) && !base.contains(c))
            .map(|c| (c, self.score(c, &gains[c], variance)))
            .filter(|(_, score)| *score > 0.0)
            .collect();
        scored.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        scored.retain(|(c, _)| accepts(*c));
        scored.dedup_by(|a, b| (a.1 - b.1).abs() < EQUIVALENT * b.1.abs() && gains[a.0].freedom == gains[b.0].freedom);
        Ok(scored.into_iter().map(|(c, _)| c).collect())
    }

    fn is_tunable(&self, candidate: usize) -> bool {
        self.moments.numbers[candidate] > 0 || self.has_positions(candidate)
    }

    fn has_positions(&self, candidate: usize) -> bool {
        matches!(self.candidates[candidate].effect.shape, Shape::Steps { .. })
    }

    /// The best candidates in addition to some effects: one for each identifier, and one of equivalent candidates.
    fn next_best(&self, base: &[usize], but: usize, folds: &[usize]) -> Result<Vec<usize>, IdentifyError> {
        let mut ids: HashSet<String> = HashSet::from([self.candidates[but].effect.id()]);
        let mut ranked = self.ranked(base, folds, |candidate| ids.insert(self.candidates[candidate].effect.id()))?;
        let most = if self.has_all_folds(folds) { MAX_TRIED } else { MAX_TRIED_WITHOUT_A_FOLD };
        ranked.truncate(most);
        Ok(ranked)
    }

    /// An effect with the shape numbers or positions that are best together with others.
    fn retuned(&mut self, tunable: usize, beside: &[usize], folds: &[usize]) -> Result<Option<usize>, IdentifyError> {
        let fresh = {
            let model = self.projection_of(beside, folds)?;
            let original = &self.candidates[tunable];
            if self.has_positions(tunable) {
                self.best_step_table(&model, &original.effect.id())
            } else {
                let before = model.gain(tunable).gain;
                match refine::refine(self, &model, original, before) {
                    Some(effect) => Some(Candidate { effect, ..original.clone() }),
                    None => return Ok(Some(tunable)),
                }
            }
        };
        Ok(fresh.and_then(|fresh| self.add_tuned(fresh, folds)))
    }

    /// The best step table of an effect's dictionary for addition to a model.
    fn best_step_table(&self, model: &TrainedModel<'_>, id: &str) -> Option<Candidate> {
        let dictionary = self.candidates.iter().position(|candidate| {
            candidate.dictionary && candidate.effect.id() == id && matches!(candidate.effect.shape, Shape::Steps { .. })
        })?;
        let variance = self.variance(model);
        let composed = compose::best_step_table(model, dictionary, &self.candidates[dictionary], variance)?;
        Some(composed.candidate)
    }
}
