//! The models that a search compares: the chosen effects, trained on the folds of a branch, and the score of a
//! candidate in addition to them.

use std::ops::Range;

use abbe_model::effect::Effect;

use super::{ALL, Search};
use crate::candidates::columns::EffectColumns;
use crate::candidates::gain::{Gain, TrainedModel};
use crate::candidates::tuned::TunedEffect;
use crate::error::IdentifyError;
use crate::numerics::tails::ln_chi_square_tail;

impl Search<'_> {
    /// The range of a candidate's columns in the base. Empty if the candidate was never added.
    pub fn places(&self, candidate: usize) -> Range<usize> {
        self.added_to_base.iter().find(|(c, _)| *c == candidate).map_or(0..0, |(_, places)| places.clone())
    }

    fn base_with(&self, chosen: &[usize]) -> Vec<usize> {
        (0..self.rank).chain(chosen.iter().flat_map(|candidate| self.places(*candidate))).collect()
    }

    /// The model with some candidates, trained on some folds.
    pub(in crate::trace) fn model_of(
        &self,
        chosen: &[usize],
        folds: &[usize],
    ) -> Result<TrainedModel<'_>, IdentifyError> {
        self.interrupt.map_or(Ok(()), |interrupt| interrupt.check())?;
        TrainedModel::new(&self.moments, &self.prior, self.base_with(chosen), folds.to_vec())
    }

    /// The model with some candidates, for the evaluation of few candidates.
    pub(in crate::trace) fn projection_of(
        &self,
        chosen: &[usize],
        folds: &[usize],
    ) -> Result<TrainedModel<'_>, IdentifyError> {
        self.interrupt.map_or(Ok(()), |interrupt| interrupt.check())?;
        TrainedModel::projection(&self.moments, &self.prior, self.base_with(chosen), folds.to_vec())
    }

    /// The model with the selected effects, without the `k`-th if one is given, on all readings.
    pub fn model_without(&self, left_out: Option<usize>) -> Result<TrainedModel<'_>, IdentifyError> {
        let mut chosen = self.branches[ALL].chosen();
        if let Some(k) = left_out {
            chosen.remove(k);
        }
        self.model_of(&chosen, &self.branches[ALL].folds)
    }

    /// Adds the columns of candidates to the base, if they are not there yet.
    pub(in crate::trace) fn add_to_base(&mut self, candidates: &[usize]) {
        let fresh: Vec<usize> = candidates
            .iter()
            .copied()
            .filter(|c| !self.added_to_base.iter().any(|(present, _)| present == c))
            .collect();
        if fresh.is_empty() {
            return;
        }
        let places = self.moments.add_to_base(self.columns, &self.column_sets, &fresh);
        let chosen: Vec<&EffectColumns> = fresh.iter().map(|c| &self.column_sets[*c]).collect();
        let rows = self.columns.unwhitened_rows(&chosen);
        let norms: Vec<f64> = fresh.iter().flat_map(|c| self.norms(*c)).collect();
        self.unwhitened.extend(&rows, &norms);
        self.added_to_base.extend(fresh.into_iter().zip(places));
    }

    /// The lengths of a candidate's columns over all readings.
    pub fn norms(&self, candidate: usize) -> Vec<f64> {
        (0..self.moments.count[candidate])
            .map(|k| self.moments.folds.iter().map(|fold| fold.own[candidate][(k, k)]).sum::<f64>().max(0.0).sqrt())
            .collect()
    }

    /// The variance by which gains are divided.
    pub fn variance(&self, model: &TrainedModel<'_>) -> f64 {
        if !self.stop.in_residual_variance {
            return 1.0;
        }
        let sum: f64 = model.folds.iter().map(|fold| model.sum_of_squares_on(*fold)).sum();
        let rows: usize = model.folds.iter().map(|fold| self.columns.fold_rows[*fold].len()).sum();
        let freedom = rows.saturating_sub(model.base.len()).max(1) as f64;
        (sum / freedom).max(f64::MIN_POSITIVE)
    }

    /// The variance by which the gains of the null draws are divided.
    pub(super) fn null_variance(&self) -> Result<f64, IdentifyError> {
        Ok(self.variance(&self.projection_of(&[], &self.branches[ALL].folds)?))
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

    /// The evidence for a candidate, less its cost.
    pub fn score(&self, candidate: usize, gain: &Gain, variance: f64) -> f64 {
        self.evidence_for(candidate, gain, variance) - self.candidates[candidate].cost
    }

    /// The products of any effect with a model. `None` if the data lack its driver.
    pub(in crate::trace) fn tuned_effect(&self, model: &TrainedModel<'_>, effect: &Effect) -> Option<TunedEffect> {
        let column_set = self.columns.effect_columns_uncached(effect)?;
        Some(TunedEffect::new(self.columns, &self.moments, &column_set, model))
    }

    /// The gain of any effect added to a model, on the training folds of the model. `None` if the data lack its driver.
    pub fn gain_beside(&self, model: &TrainedModel<'_>, effect: &Effect) -> Option<f64> {
        Some(self.tuned_effect(model, effect)?.gain(model))
    }
}
