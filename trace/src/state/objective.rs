//! The objective of the search, and the comparison of candidates with each other and with readings without structure.
//!
//! The evidence for a group of effects is `−ln P(χ²)` of their joint gain. The description length of an effect is its
//! cost, its penalty for selected positions, and `ln n` for the choice among the `n` detectable effects of the library.
//! The objective is the evidence less the description length. The score of one candidate lacks `ln n`: where scores are
//! compared with the best of readings without structure, the null distribution accounts for the choice.

use abbe_identify::numerics::tails::{ln_chi_square_tail, most_evidence};
use abbe_model::Diagnostic;

use super::{ALL, SearchState};
use crate::candidates::gain::{Gain, TrainedModel};
use crate::candidates::step_table::StepTable;
use crate::constants::{EQUIVALENT, INDISTINGUISHABLE};

impl SearchState<'_> {
    /// The variance by which gains are divided.
    pub fn variance(&self, model: &TrainedModel<'_>) -> f64 {
        if !self.policy.in_residual_variance {
            return 1.0;
        }
        let (sum, freedom) = model.residual_square();
        (sum / freedom as f64).max(f64::MIN_POSITIVE)
    }

    /// `−ln P` of a gain.
    pub fn evidence(&self, gain: &Gain, variance: f64) -> f64 {
        if gain.freedom == 0 {
            return f64::NEG_INFINITY;
        }
        -ln_chi_square_tail(gain.gain / variance, gain.freedom)
    }

    /// The evidence for a candidate: `−ln P` of its gain, less its selection penalty.
    pub fn evidence_for(&self, candidate: usize, gain: &Gain, variance: f64) -> f64 {
        self.evidence(gain, variance) - self.candidates[candidate].selection_penalty
    }

    /// An upper bound of the evidence for a candidate, which takes no evaluation of the tail.
    pub fn most_evidence_for(&self, candidate: usize, gain: &Gain, variance: f64) -> f64 {
        most_evidence(gain.gain / variance, gain.freedom) - self.candidates[candidate].selection_penalty
    }

    /// An upper bound of the score of a candidate.
    pub fn most_score(&self, candidate: usize, gain: &Gain, variance: f64) -> f64 {
        self.most_evidence_for(candidate, gain, variance) - self.candidates[candidate].cost
    }

    /// The evidence for a candidate, less its cost.
    pub fn score(&self, candidate: usize, gain: &Gain, variance: f64) -> f64 {
        self.evidence_for(candidate, gain, variance) - self.candidates[candidate].cost
    }

    /// The score of a candidate beside others.
    pub fn score_beside(&self, candidate: usize, others: &[usize], folds: &[usize]) -> Result<f64, Diagnostic> {
        let model = self.model_of(others, folds)?;
        Ok(self.score(candidate, &model.gain(candidate)?, self.variance(&model)))
    }

    /// Description length of the choice of one effect in the library.
    pub fn choice(&self) -> f64 {
        (self.detectable_effects.max(1) as f64).ln()
    }

    /// The objective of a group beside other effects.
    pub fn objective(&self, group: &[usize], rest: &[usize], folds: &[usize]) -> Result<f64, Diagnostic> {
        Ok(self.evidence_of(group, rest, folds)? - self.description_length(group))
    }

    /// The objective of the selected effects.
    pub fn objective_of_selected(&self) -> Result<f64, Diagnostic> {
        let chosen = self.selection.branches[ALL].chosen();
        if chosen.is_empty() { Ok(0.0) } else { self.objective(&chosen, &[], &self.selection.branches[ALL].folds) }
    }

    /// The objective of some candidates and one more, which need not be in the base.
    pub fn objective_with(&self, some: &[usize], one: usize, folds: &[usize]) -> Result<f64, Diagnostic> {
        let model = self.model_of(some, folds)?;
        let all: Vec<usize> = some.iter().copied().chain([one]).collect();
        let explained = model.explained() + model.gain(one)?.gain;
        Ok(self.evidence_of_gain(explained, &all, &[], folds)? - self.description_length(&all))
    }

    /// `−ln P` of the joint gain of a group beside other effects.
    pub fn evidence_of(&self, group: &[usize], rest: &[usize], folds: &[usize]) -> Result<f64, Diagnostic> {
        let all: Vec<usize> = rest.iter().chain(group).copied().collect();
        self.evidence_of_gain(self.model_of(&all, folds)?.explained(), group, rest, folds)
    }

    fn evidence_of_gain(
        &self,
        explained: f64,
        group: &[usize],
        rest: &[usize],
        folds: &[usize],
    ) -> Result<f64, Diagnostic> {
        let without = self.model_of(rest, folds)?;
        let gain = Gain {
            gain: explained - without.explained(),
            freedom: group.iter().map(|c| self.gram.count(*c) + self.gram.numbers(*c)).sum(),
        };
        Ok(self.evidence(&gain, self.variance(&without)))
    }

    fn description_length(&self, group: &[usize]) -> f64 {
        group.iter().map(|c| self.candidates[*c].description_length() + self.choice()).sum()
    }

    /// The best candidate for addition to a model with the chosen candidates, and its score.
    pub fn best_of(&self, model: &TrainedModel<'_>, gains: &[Gain], chosen: &[usize]) -> Option<(usize, f64)> {
        let variance = self.variance(model);
        let mut best: Option<(usize, f64)> = None;
        for (candidate, gain) in gains.iter().enumerate() {
            if chosen.contains(&candidate) || !self.may_be_added(candidate, &model.folds) {
                continue;
            }
            if best.is_some_and(|(_, most)| self.most_score(candidate, gain, variance) <= most) {
                continue;
            }
            let score = self.score(candidate, gain, variance);
            if best.is_none_or(|(_, most)| score > most) {
                best = Some((candidate, score));
            }
        }
        best.filter(|(_, score)| score.is_finite())
    }

    /// The candidate with the shortest description among those that are confounded with the best one.
    pub fn simplest_confounded(
        &self,
        model: &TrainedModel<'_>,
        gains: &[Gain],
        best: usize,
        chosen: &[usize],
    ) -> usize {
        let variance = self.variance(model);
        let least = self.evidence_for(best, &gains[best], variance) - INDISTINGUISHABLE;
        let mut first = best;
        for (candidate, gain) in gains.iter().enumerate() {
            let passed_over = chosen.contains(&candidate)
                || !self.may_be_added(candidate, &model.folds)
                || self.most_evidence_for(candidate, gain, variance) < least;
            if passed_over || gain.freedom == 0 || self.evidence_for(candidate, gain, variance) < least {
                continue;
            }
            let length = self.candidates[candidate].description_length();
            let present = self.candidates[first].description_length();
            if length < present || (length == present && gain.gain > gains[first].gain * (1.0 + 1e-9)) {
                first = candidate;
            }
        }
        first
    }

    /// The candidates with a positive score beside some effects, restricted to those that `accepts` accepts, best
    /// first. Of equivalent candidates one is kept. `accepts` is called in order of decreasing score.
    pub fn ranked(
        &self,
        base: &[usize],
        folds: &[usize],
        mut accepts: impl FnMut(usize) -> bool,
    ) -> Result<Vec<usize>, Diagnostic> {
        let model = self.model_of(base, folds)?;
        let variance = self.variance(&model);
        let gains = self.gains(&model)?;
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

    /// The best candidate, its p-value with respect to the best scores of the null draws, and the score that these exceed
    /// with the probability of the significance level. `None` if no candidate can be added.
    pub fn best_against_null(&self) -> Result<Option<(usize, f64, f64)>, Diagnostic> {
        let chosen = self.selection.branches[ALL].chosen();
        let model = self.model_without(None)?;
        let Some((best, score)) = self.best_of(&model, &self.gains(&model)?, &chosen) else {
            return Ok(None);
        };
        let score = self.step_tables(&model)?.iter().map(StepTable::score).fold(score, f64::max);
        let costs: Vec<f64> = (0..self.candidates.len())
            .map(|c| {
                if self.may_be_added(c, &model.folds) { self.candidates[c].description_length() } else { f64::INFINITY }
            })
            .collect();
        let null_variance = self.variance(&self.model_of(&[], &self.selection.branches[ALL].folds)?);
        let mut null = model.null_best(&chosen, &costs, null_variance)?;
        null.sort_by(f64::total_cmp);
        let above = null.iter().filter(|best| **best >= score).count();
        let p_value = (above + 1) as f64 / (null.len() + 1) as f64;
        let rank = ((1.0 - self.policy.significance) * null.len() as f64).ceil() as usize;
        let threshold = null.get(rank.min(null.len().saturating_sub(1)));
        Ok(Some((best, p_value, threshold.copied().unwrap_or(0.0))))
    }
}
