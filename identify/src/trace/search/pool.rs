//! The candidates that a search may add: the library's detectable effects, and the effects that it has tuned itself.

use super::{Search, TrainedModel};
use crate::candidates::columns::EffectColumns;
use crate::candidates::gain::Gain;
use crate::candidates::library::Candidate;
use crate::error::IdentifyError;
use crate::numerics::parallel;
use crate::trace::compose::{self, StepTable};
use crate::trace::refine;

/// Least detectability of a searched effect. An effect of the largest plausible size has to change the readings by this
/// many standard deviations in total, beyond what the model absorbs.
const MIN_PLAUSIBLE_SIGMA: f64 = 3.0;

impl Search<'_> {
    /// For each candidate whether it is undetectable at its largest plausible size.
    pub(super) fn undetectable_candidates(&self) -> Result<Vec<bool>, IdentifyError> {
        let model = self.model_without(None)?;
        Ok(parallel::map(self.candidates.len(), &|candidate| {
            let (d, _, _) = model.projected(candidate);
            let effect = &self.candidates[candidate].effect;
            let plausible = self.columns.plausible(effect, &self.column_sets[candidate]);
            let largest = (0..d.nrows()).map(|k| d[(k, k)]).fold(0.0, f64::max);
            plausible * largest.max(0.0).sqrt() < MIN_PLAUSIBLE_SIGMA
        }))
    }

    /// Whether a branch with some training folds may add a candidate now.
    pub fn may_be_added(&self, candidate: usize, folds: &[usize]) -> bool {
        let undetectable = self.undetectable.get(candidate).is_some_and(|undetectable| *undetectable);
        let effect = &self.candidates[candidate];
        !undetectable
            && !effect.dictionary
            && (!effect.last_resort || self.last_resort)
            && self.may_be_used(candidate, folds)
    }

    /// Whether a candidate is an effect of the library or was tuned on exactly these folds.
    pub(in crate::trace) fn may_be_used(&self, candidate: usize, folds: &[usize]) -> bool {
        let tuned_on = &self.tuned_on[candidate];
        tuned_on.is_empty() || tuned_on == folds
    }

    /// The step tables from the library's dictionaries for addition to a model.
    pub(super) fn step_tables(&self, model: &TrainedModel<'_>) -> Vec<StepTable> {
        let variance = self.variance(model);
        let dictionaries: Vec<usize> =
            (0..self.candidates.len()).filter(|candidate| self.candidates[*candidate].dictionary).collect();
        let best = |k: usize| {
            let candidate = dictionaries[k];
            compose::best_step_table(model, candidate, &self.candidates[candidate], variance)
        };
        parallel::map(dictionaries.len(), &best).into_iter().flatten().collect()
    }

    /// Adds the candidates near the best, with their shape numbers tuned in addition to some candidates on some folds.
    /// Returns the gains of the candidates that were present before.
    pub(in crate::trace) fn refine(&mut self, beside: &[usize], folds: &[usize]) -> Result<Vec<Gain>, IdentifyError> {
        if !self.candidates.iter().any(refine::can_be_tuned) {
            return Ok(Vec::new());
        }
        let (gains, fresh) = {
            let model = self.model_of(beside, folds)?;
            let gains = model.gains();
            let fresh = refine::refined(self, &model, &gains, &self.step_tables(&model));
            (gains, fresh)
        };
        for candidate in fresh {
            self.add_tuned(candidate, folds);
        }
        Ok(gains)
    }

    /// Adds a candidate that was tuned on some folds. Returns its index, or `None` if the data lack its driver.
    pub(in crate::trace) fn add_tuned(&mut self, candidate: Candidate, folds: &[usize]) -> Option<usize> {
        let column_set = self.columns.effect_columns(&candidate.effect)?;
        self.append(vec![(candidate, column_set)], folds);
        Some(self.candidates.len() - 1)
    }

    /// Adds candidates that were tuned on some folds, or effects of the library if `tuned_on` is empty.
    pub(in crate::trace) fn append(&mut self, fresh: Vec<(Candidate, EffectColumns)>, tuned_on: &[usize]) {
        if fresh.is_empty() {
            return;
        }
        let (candidates, column_sets): (Vec<Candidate>, Vec<EffectColumns>) = fresh.into_iter().unzip();
        self.candidates.extend(candidates);
        self.column_sets.extend(column_sets);
        self.tuned_on.resize(self.candidates.len(), tuned_on.to_vec());
        self.moments.append(self.columns, &self.column_sets);
    }

    /// The number of the library's effects that are detectable at their largest plausible size. A dictionary counts
    /// once: its step tables share its identifier, and their positions have a penalty of their own. Curves of last
    /// resort, some dozens compared with thousands, do not count.
    pub(in crate::trace) fn detectable_effects(&self) -> usize {
        self.undetectable.iter().filter(|undetectable| !**undetectable).count()
    }

    /// Computes the products of the candidates of last resort, and adds them to the candidates.
    pub fn add_reserve_candidates(&mut self) {
        let reserve = std::mem::take(&mut self.reserve);
        self.append(reserve, &[]);
    }
}
