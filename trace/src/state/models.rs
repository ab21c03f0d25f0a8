//! The models that a search compares: the chosen effects, trained on the folds of a branch.

use abbe_model::Diagnostic;

use super::{ALL, SearchState};
use crate::candidates::gain::{Gain, TrainedModel};

impl SearchState<'_> {
    /// The model with some candidates, trained on some folds.
    pub fn model_of(&self, chosen: &[usize], folds: &[usize]) -> Result<TrainedModel<'_>, Diagnostic> {
        self.check()?;
        TrainedModel::new(&self.gram, chosen, folds)
    }

    /// The gains of the candidates that may be added to a model; those of the others are zero.
    pub fn gains(&self, model: &TrainedModel<'_>) -> Result<Vec<Gain>, Diagnostic> {
        self.remaining_gains(model, Vec::new())
    }

    /// The same. `known` are those of the first candidates with the same model.
    pub fn remaining_gains(&self, model: &TrainedModel<'_>, known: Vec<Gain>) -> Result<Vec<Gain>, Diagnostic> {
        model.remaining_gains(known, &|candidate| self.may_be_added(candidate, &model.folds))
    }

    /// The model with the selected effects, without the `k`-th if one is given, on all readings.
    pub fn model_without(&self, left_out: Option<usize>) -> Result<TrainedModel<'_>, Diagnostic> {
        let mut chosen = self.selection.branches[ALL].chosen();
        if let Some(k) = left_out {
            chosen.remove(k);
        }
        self.model_of(&chosen, &self.selection.branches[ALL].folds)
    }

    /// Forms the products of the library for every branch.
    pub fn prepare_branches(&self) -> Result<(), Diagnostic> {
        let folds: Vec<&[usize]> = self.selection.branches.iter().map(|branch| &branch.folds[..]).collect();
        self.gram.prepare(&folds, &|| self.should_continue())
    }

    /// Forgets the products of effects that were tried on a branch and are not selected.
    pub fn forget_unselected(&self, branch: usize) {
        let branch = &self.selection.branches[branch];
        self.gram.keep_chosen(&branch.folds, &branch.chosen());
    }

    /// Forgets the products of the selected effects of every branch. They are formed again where they are needed.
    pub fn forget_chosen(&self) {
        self.selection.branches.iter().for_each(|branch| self.gram.keep_chosen(&branch.folds, &[]));
    }

    /// Whether the caller has not stopped the trace.
    pub fn should_continue(&self) -> bool {
        self.check().is_ok()
    }

    fn check(&self) -> Result<(), Diagnostic> {
        self.interrupt.map_or(Ok(()), |interrupt| interrupt.check())
    }
}
