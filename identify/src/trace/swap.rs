//! Exchanges that a purely additive search misses: a wrong effect in place of the true one, and one effect in place of a pair.
//!
//! Each effect is exchanged for a candidate that explains clearly more beside the others. When no addition is significant,
//! effects with tunable shape numbers or positions are tuned anew beside each of the next best candidates. A step table or a
//! warm-up with a free time constant can absorb most of a second effect. The second effect becomes significant only when both are
//! in the model.
//!
//! Pairs of effects are also searched jointly as replacements of two effects or of one. If two effects partly cancel each other,
//! neither is significant alone, and the search finds a single effect that approximates both.

use std::collections::HashSet;

use abbe_model::effect::Shape;

use super::alias::INDISTINGUISHABLE;
use super::compose;
use super::library::Candidate;
use super::refine;
use super::score::TrainedModel;
use super::search::{ALL, Search, SearchBranch, SelectedEffect};
use crate::error::IdentifyError;

/// Maximum number of effects whose positions and periods are tuned again after an addition.
const MAX_REFINED: usize = 4;
/// Candidates tried beside an effect that is tuned anew: on all readings, and with one fold left out.
const MAX_TRIED: usize = 6;
const MAX_TRIED_TO_PREDICT: usize = 2;
/// Candidates tried as the first of a pair: in place of two effects, and in place of one or with one fold left out.
const MAX_FIRST_MEMBERS: usize = 32;
const FEW_FIRST_MEMBERS: usize = 8;
/// Maximum number of selected effects for which effects are tuned anew beside others.
const MAX_RESTARTS: usize = 3;
/// Relative difference of scores below which two candidates count as equivalent.
const SAME: f64 = 1e-6;

/// A comparison of sets of effects with the selected set.
#[derive(Clone)]
struct Contest {
    /// The training folds of the search.
    folds: Vec<usize>,
    /// The selected effects.
    chosen: Vec<usize>,
    /// The score that readings without structure exceed with the probability of the significance level.
    threshold: f64,
    /// The value that a set has to exceed: the best value so far, at first that of the selected set plus the confounding margin.
    most: f64,
    /// The best set that exceeds it.
    best: Option<Vec<usize>>,
}

impl Contest {
    fn accept_set(&mut self, set: Vec<usize>, value: f64) {
        self.most = value;
        self.best = Some(set);
    }
}

impl Search<'_> {
    /// Exchanges effects for candidates that explain clearly more.
    pub fn exchange(&mut self) -> Result<(), IdentifyError> {
        for track in 0..self.tracks.len() {
            for k in 0..self.tracks[track].taken.len() {
                self.exchange_one(track, k)?;
            }
        }
        self.note_held_out()
    }

    /// Exchanges one effect for a candidate that explains clearly more beside the others. The improvement has to exceed the
    /// confounding margin, so that exchanges end.
    fn exchange_one(&mut self, track: usize, k: usize) -> Result<(), IdentifyError> {
        let SearchBranch { folds, .. } = self.tracks[track].clone();
        let mut others = self.tracks[track].chosen();
        let present = others.remove(k);
        let known = if (1..MAX_REFINED).contains(&others.len()) && !self.stop.in_residual_variance {
            self.refine(&others, &folds)?
        } else {
            Vec::new()
        };
        let model = self.model_of(&others, &folds)?;
        let gains = model.more_gains(known);
        let score = self.score(present, &gains[present], self.variance(&model));
        let better = self
            .best_of(&model, &gains, &others)
            .filter(|(best, most)| *best != present && *most > score + INDISTINGUISHABLE)
            .map(|(best, _)| self.named_first(&model, &gains, best, &others));
        if let Some(better) = better {
            self.materialise(&[better]);
            self.tracks[track].taken[k].candidate = better;
        }
        Ok(())
    }

    /// Tunes effects with shape numbers or positions anew beside each of the next best candidates, in addition to the others or
    /// in place of one. Selects the best of these sets if it has clearly more evidence than the present one. Returns whether the
    /// search on all readings changed.
    pub fn retune_all(&mut self) -> Result<bool, IdentifyError> {
        if self.stop.in_residual_variance {
            return Ok(false);
        }
        let changed: Vec<bool> = (0..self.tracks.len())
            .map(|track| self.retune_one(track))
            .collect::<Result<_, _>>()?;
        self.note_held_out()?;
        Ok(changed[ALL])
    }

    fn retune_one(&mut self, track: usize) -> Result<bool, IdentifyError> {
        let Some(mut contest) = self.contest(track)? else {
            return Ok(false);
        };
        let Contest { folds, chosen, .. } = contest.clone();
        let flexible: Vec<usize> = chosen.iter().copied().filter(|c| self.is_flexible(*c)).collect();
        for flexible in flexible {
            let given_up = chosen.iter().copied().filter(|c| *c != flexible).map(Some);
            for given_up in given_up.chain([None]) {
                let kept = |c: &&usize| **c != flexible && Some(**c) != given_up;
                let base: Vec<usize> = chosen.iter().filter(kept).copied().collect();
                if given_up.is_none() && chosen.len() >= self.stop.most {
                    continue;
                }
                let tried = self.next_best(&base, flexible, &folds)?;
                self.materialise(&tried);
                for other in tried {
                    let beside: Vec<usize> = base.iter().copied().chain([other]).collect();
                    let Some(restart) = self.restart(flexible, &beside, &folds)? else {
                        continue;
                    };
                    let set: Vec<usize> = beside.iter().copied().chain([restart]).collect();
                    let value = self.evidence_with(&beside, restart, &folds)? - self.description_length(&set);
                    if value <= contest.most {
                        continue;
                    }
                    self.materialise(&[restart]);
                    // The added effect has to be significant against readings without structure.
                    if self.is_significant_in(other, &set, &contest)? {
                        contest.accept_set(set, value);
                    }
                }
            }
        }
        Ok(self.replace(track, contest.best))
    }

    /// Searches two effects jointly in place of one or two, and selects the best pair if it has clearly more evidence. Returns
    /// whether the search on all readings changed.
    pub fn merge_groups(&mut self) -> Result<bool, IdentifyError> {
        if self.stop.in_residual_variance {
            return Ok(false);
        }
        // If all readings do not prefer another pair, the folds are not searched.
        if !self.merge_group_once(ALL)? {
            return Ok(false);
        }
        for track in ALL + 1..self.tracks.len() {
            self.merge_group_once(track)?;
        }
        self.note_held_out()?;
        Ok(true)
    }

    fn merge_group_once(&mut self, track: usize) -> Result<bool, IdentifyError> {
        let Some(mut contest) = self.contest(track)? else {
            return Ok(false);
        };
        let Contest { folds, chosen, .. } = contest.clone();
        let places = 0..chosen.len();
        let given_up = places
            .clone()
            .flat_map(|i| places.clone().filter(move |j| i <= *j).map(move |j| (i, j)));
        for (i, j) in given_up {
            if i == j && chosen.len() >= self.stop.most {
                continue;
            }
            let base: Vec<usize> = places
                .clone()
                .filter(|k| *k != i && *k != j)
                .map(|k| chosen[k])
                .collect();
            let in_place_of_two = i != j && track == ALL;
            let count = if in_place_of_two {
                MAX_FIRST_MEMBERS
            } else {
                FEW_FIRST_MEMBERS
            };
            let firsts = self.simple_firsts(&base, &folds, count)?;
            self.materialise(&firsts);
            for first in firsts {
                let beside: Vec<usize> = base.iter().copied().chain([first]).collect();
                let second = {
                    let model = self.model_of(&beside, &folds)?;
                    let gains = model.gains();
                    self.best_of(&model, &gains, &beside)
                        .map(|(best, _)| self.named_first(&model, &gains, best, &beside))
                };
                let Some(second) = second else { continue };
                let set: Vec<usize> = beside.iter().copied().chain([second]).collect();
                let value = self.evidence_with(&beside, second, &folds)? - self.description_length(&set);
                if value <= contest.most {
                    continue;
                }
                self.materialise(&[second]);
                if self.is_significant_in(first, &set, &contest)?
                    && self.is_significant_in(second, &set, &contest)?
                {
                    contest.accept_set(set, value);
                }
            }
        }
        Ok(self.replace(track, contest.best))
    }

    /// Replaces the selected effects by a set, if there is one. The largest p-value of the replaced effects applies to all of the
    /// set. Returns whether the effects were replaced.
    fn replace(&mut self, track: usize, set: Option<Vec<usize>>) -> bool {
        let Some(set) = set else { return false };
        let taken = &mut self.tracks[track].taken;
        let p_value = taken.iter().map(|taken| taken.p_value).fold(0.0, f64::max);
        let restart = |candidate: usize| SelectedEffect { candidate, p_value };
        *taken = set.into_iter().map(restart).collect();
        true
    }

    /// Starts a comparison with the selected set. `None` if the set is empty or too large to be tuned anew.
    fn contest(&self, track: usize) -> Result<Option<Contest>, IdentifyError> {
        let SearchBranch { folds, .. } = self.tracks[track].clone();
        let chosen = self.tracks[track].chosen();
        if !(1..=MAX_RESTARTS).contains(&chosen.len()) {
            return Ok(None);
        }
        Ok(Some(Contest {
            threshold: self.thresholds.last().copied().unwrap_or(f64::INFINITY),
            most: self.evidence_of(&chosen, &[], &folds)? - self.description_length(&chosen)
                + INDISTINGUISHABLE,
            best: None,
            folds,
            chosen,
        }))
    }

    /// Whether one effect of a set scores at least the null threshold beside the others.
    fn is_significant_in(&self, one: usize, set: &[usize], contest: &Contest) -> Result<bool, IdentifyError> {
        let others: Vec<usize> = set.iter().copied().filter(|c| *c != one).collect();
        let model = self.lean_model_of(&others, &contest.folds)?;
        Ok(self.score(one, &model.gain(one), self.variance(&model)) >= contest.threshold)
    }

    /// Effects without tunable shape numbers or positions that have a positive score beside some others, best first. Of
    /// equivalent effects one is kept.
    fn simple_firsts(
        &self,
        base: &[usize],
        folds: &[usize],
        most: usize,
    ) -> Result<Vec<usize>, IdentifyError> {
        let mut ranked = self.ranked(base, folds, |candidate| !self.is_flexible(candidate))?;
        ranked.truncate(most);
        Ok(ranked)
    }

    /// The candidates with a positive score beside some effects that `asked_for` accepts, best first. Of equivalent candidates
    /// one is kept. `asked_for` is called in order of decreasing score.
    fn ranked(
        &self,
        base: &[usize],
        folds: &[usize],
        mut asked_for: impl FnMut(usize) -> bool,
    ) -> Result<Vec<usize>, IdentifyError> {
        let model = self.model_of(base, folds)?;
        let variance = self.variance(&model);
        let gains = model.gains();
        let mut scored: Vec<(usize, f64)> = (0..self.candidates.len())
            .filter(|c| self.is_open(*c, folds) && !base.contains(c))
            .map(|c| (c, self.score(c, &gains[c], variance)))
            .filter(|(_, score)| *score > 0.0)
            .collect();
        scored.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        scored.retain(|(c, _)| asked_for(*c));
        scored.dedup_by(|a, b| {
            (a.1 - b.1).abs() < SAME * b.1.abs() && gains[a.0].freedom == gains[b.0].freedom
        });
        Ok(scored.into_iter().map(|(c, _)| c).collect())
    }

    fn is_flexible(&self, candidate: usize) -> bool {
        self.moments.numbers[candidate] > 0 || self.has_places(candidate)
    }

    fn has_places(&self, candidate: usize) -> bool {
        matches!(self.candidates[candidate].effect.shape, Shape::Steps { .. })
    }

    /// The best candidates beside some effects: one for each identifier, and one of equivalent candidates.
    fn next_best(&self, base: &[usize], but: usize, folds: &[usize]) -> Result<Vec<usize>, IdentifyError> {
        let mut seen: HashSet<String> = HashSet::from([self.candidates[but].effect.id()]);
        let mut ranked = self.ranked(base, folds, |candidate| {
            seen.insert(self.candidates[candidate].effect.id())
        })?;
        let most = if self.identifies_all(folds) {
            MAX_TRIED
        } else {
            MAX_TRIED_TO_PREDICT
        };
        ranked.truncate(most);
        Ok(ranked)
    }

    /// An effect with the shape numbers or positions that are best beside others.
    fn restart(
        &mut self,
        flexible: usize,
        beside: &[usize],
        folds: &[usize],
    ) -> Result<Option<usize>, IdentifyError> {
        let fresh = {
            let model = self.lean_model_of(beside, folds)?;
            let original = &self.candidates[flexible];
            if self.has_places(flexible) {
                self.composed_anew(&model, &original.effect.id())
            } else {
                let before = model.gain(flexible).gain;
                match refine::refine(self, &model, original, before) {
                    Some(effect) => Some(Candidate {
                        effect,
                        ..original.clone()
                    }),
                    None => return Ok(Some(flexible)),
                }
            }
        };
        Ok(fresh.and_then(|fresh| self.add_tuned(fresh, folds)))
    }

    /// The best step table of an effect's dictionary beside a model.
    fn composed_anew(&self, model: &TrainedModel<'_>, id: &str) -> Option<Candidate> {
        let dictionary = self.candidates.iter().position(|candidate| {
            candidate.dictionary
                && candidate.effect.id() == id
                && matches!(candidate.effect.shape, Shape::Steps { .. })
        })?;
        let variance = self.variance(model);
        let composed = compose::composed(model, dictionary, &self.candidates[dictionary], variance)?;
        Some(composed.candidate)
    }
}
