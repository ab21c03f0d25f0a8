//! The models that a search compares: the chosen effects, trained on the folds of a branch.

use std::ops::Range;

use abbe_model::effect::Effect;

use super::{ALL, SearchState};
use crate::candidates::columns::EffectColumns;
use crate::candidates::gain::TrainedModel;
use crate::candidates::tuned::TunedEffect;
use crate::error::IdentifyError;

impl SearchState<'_> {
    /// The range of a candidate's columns in the base. Empty if the candidate was never added.
    pub fn places(&self, candidate: usize) -> Range<usize> {
        self.added_to_base.iter().find(|(c, _)| *c == candidate).map_or(0..0, |(_, places)| places.clone())
    }

    fn base_with(&self, chosen: &[usize]) -> Vec<usize> {
        (0..self.rank).chain(chosen.iter().flat_map(|candidate| self.places(*candidate))).collect()
    }

    /// The model with some candidates, trained on some folds.
    pub fn model_of(&self, chosen: &[usize], folds: &[usize]) -> Result<TrainedModel<'_>, IdentifyError> {
        self.interrupt.map_or(Ok(()), |interrupt| interrupt.check())?;
        TrainedModel::new(&self.moments, &self.prior, self.base_with(chosen), folds.to_vec())
    }

    /// The model with some candidates, for the evaluation of few candidates.
    pub fn projection_of(&self, chosen: &[usize], folds: &[usize]) -> Result<TrainedModel<'_>, IdentifyError> {
        self.interrupt.map_or(Ok(()), |interrupt| interrupt.check())?;
        TrainedModel::projection(&self.moments, &self.prior, self.base_with(chosen), folds.to_vec())
    }

    /// The model with the selected effects, without the `k`-th if one is given, on all readings.
    pub fn model_without(&self, left_out: Option<usize>) -> Result<TrainedModel<'_>, IdentifyError> {
        let mut chosen = self.selection.branches[ALL].chosen();
        if let Some(k) = left_out {
            chosen.remove(k);
        }
        self.model_of(&chosen, &self.selection.branches[ALL].folds)
    }

    /// Adds the columns of candidates to the base, if they are not there yet.
    pub fn add_to_base(&mut self, candidates: &[usize]) {
        let fresh: Vec<usize> = candidates
            .iter()
            .copied()
            .filter(|c| !self.added_to_base.iter().any(|(present, _)| present == c))
            .collect();
        if fresh.is_empty() {
            return;
        }
        let column_sets: Vec<&EffectColumns> = self.candidates.iter().map(|candidate| &candidate.columns).collect();
        let places = self.moments.add_to_base(self.columns, &column_sets, &fresh);
        let chosen: Vec<&EffectColumns> = fresh.iter().map(|c| column_sets[*c]).collect();
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

    /// The products of any effect with a model. `None` if the data lack its driver.
    pub fn tuned_effect(&self, model: &TrainedModel<'_>, effect: &Effect) -> Option<TunedEffect> {
        let column_set = self.columns.effect_columns_uncached(effect)?;
        Some(TunedEffect::new(self.columns, &self.moments, &column_set, model))
    }
}
