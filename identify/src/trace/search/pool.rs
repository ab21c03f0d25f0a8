//! What a search may add: entries of the library that the readings would show, and what it has tuned itself.

use rayon::prelude::*;

use super::{Search, TrainedModel};
use crate::error::IdentifyError;
use crate::trace::columns::Layout;
use crate::trace::compose::{self, StepTable};
use crate::trace::library::Candidate;
use crate::trace::refine;
use crate::trace::score::Gain;

/// By how many standard deviations an effect as large as is plausible has to change the readings, all together and beyond what the model absorbs, to be
/// looked for.
const MIN_PLAUSIBLE_SIGMA: f64 = 3.0;

impl Search<'_> {
    /// For each candidate whether it would not stand out however large it plausibly was.
    pub(super) fn not_detectable(&self) -> Result<Vec<bool>, IdentifyError> {
        let model = self.model_without(None)?;
        let candidates = 0..self.candidates.len();
        let unseen = candidates
            .into_par_iter()
            .map(|candidate| {
                let (d, _, _) = model.projected(candidate);
                let effect = &self.candidates[candidate].effect;
                let plausible = self.columns.plausible(effect, &self.layouts[candidate]);
                let largest = (0..d.nrows()).map(|k| d[(k, k)]).fold(0.0, f64::max);
                plausible * largest.max(0.0).sqrt() < MIN_PLAUSIBLE_SIGMA
            })
            .collect();
        Ok(unseen)
    }

    /// Whether a search that sees some folds may take a candidate up now.
    pub fn is_open(&self, candidate: usize, folds: &[usize]) -> bool {
        let unseen = self.unseen.get(candidate).is_some_and(|unseen| *unseen);
        let entry = &self.candidates[candidate];
        !unseen
            && !entry.dictionary
            && (!entry.last_resort || self.last_resort)
            && self.is_own(candidate, folds)
    }

    /// Whether a candidate is an entry of the library, or was tuned on the very folds that a search sees.
    pub(in crate::trace) fn is_own(&self, candidate: usize, folds: &[usize]) -> bool {
        let tuned_on = &self.tuned_on[candidate];
        tuned_on.is_empty() || tuned_on == folds
    }

    /// What can be composed of the library's dictionaries beside a model.
    pub(super) fn composed(&self, model: &TrainedModel<'_>) -> Vec<StepTable> {
        let variance = self.variance(model);
        (0..self.candidates.len())
            .into_par_iter()
            .filter(|candidate| self.candidates[*candidate].dictionary)
            .filter_map(|candidate| {
                compose::composed(model, candidate, &self.candidates[candidate], variance)
            })
            .collect()
    }

    /// Adds what comes near the best, with the best numbers that it can have beside some candidates on some folds. Returns what each candidate that was there
    /// before gains beside them.
    pub(in crate::trace) fn refine(
        &mut self,
        beside: &[usize],
        folds: &[usize],
    ) -> Result<Vec<Gain>, IdentifyError> {
        if !self.candidates.iter().any(refine::can_be_tuned) {
            return Ok(Vec::new());
        }
        let (gains, fresh) = {
            let model = self.model_of(beside, folds)?;
            let gains = model.gains();
            let fresh = refine::refined(self, &model, &gains, &self.composed(&model));
            (gains, fresh)
        };
        for candidate in fresh {
            self.add_tuned(candidate, folds);
        }
        Ok(gains)
    }

    /// Adds a candidate that was tuned on some folds; its number, if the data have what it follows.
    pub(in crate::trace) fn add_tuned(&mut self, candidate: Candidate, folds: &[usize]) -> Option<usize> {
        let layout = self.columns.layout(&candidate.effect)?;
        self.append(vec![(candidate, layout)], folds);
        Some(self.candidates.len() - 1)
    }

    /// Adds candidates that were tuned on some folds; on none, if they are entries of the library.
    pub(in crate::trace) fn append(&mut self, fresh: Vec<(Candidate, Layout)>, tuned_on: &[usize]) {
        if fresh.is_empty() {
            return;
        }
        let (candidates, layouts): (Vec<Candidate>, Vec<Layout>) = fresh.into_iter().unzip();
        self.candidates.extend(candidates);
        self.layouts.extend(layouts);
        self.tuned_on.resize(self.candidates.len(), tuned_on.to_vec());
        self.moments.append(self.columns, &self.layouts);
    }

    /// How many entries of the library would stand out if they were as large as is plausible. A dictionary is one of them: what is composed of it bears its
    /// name, and its places have a price of their own. Curves of last resort, some dozens beside thousands, are not counted.
    pub(in crate::trace) fn seen_entries(&self) -> usize {
        self.unseen.iter().filter(|unseen| !**unseen).count()
    }

    /// Adds the candidates of last resort to those whose products are made.
    pub fn add_reserve_candidates(&mut self) {
        let reserve = std::mem::take(&mut self.reserve);
        self.append(reserve, &[]);
    }
}
