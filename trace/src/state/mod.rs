//! The state of the search: the candidates with their products, and the selected effects.
//!
//! One branch searches on all readings. One further branch for each fold searches on the readings outside that fold
//! ([`SearchBranch`]). Each branch selects for itself, and uses only shape numbers and positions that it has tuned
//! itself. The held-out error therefore belongs to a search without access to the held-out readings.

mod heldout;
mod objective;
mod pool;
mod tuning;

use std::collections::HashMap;
use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::driver::Driver;
use abbe_model::effect::{Component, Effect};
use heldout::Averaged;
pub use heldout::{RejectedByHeldOut, Selection, UnwhitenedModel};

use super::constants::{Effort, ON_ALL, ON_FOLDS};
use super::interrupt::Interrupt;
use super::policy::Policy;
use crate::candidates::candidate::Candidate;
use crate::candidates::columns::Columns;
use crate::candidates::gain::{Gain, TrainedModel};
use crate::candidates::gram::Gram;

/// An effect that a search has selected.
#[derive(Clone, Copy, Debug)]
pub struct SelectedEffect {
    /// Index of the candidate.
    pub candidate: usize,
    /// Probability that the search finds at least as high a score on readings without structure.
    pub p_value: f64,
}

/// One branch of the search: on all readings, or on all but one fold.
#[derive(Clone, Debug)]
pub struct SearchBranch {
    /// The training folds, ascending.
    pub folds: Vec<usize>,
    /// The selected effects.
    pub selected: Vec<SelectedEffect>,
}

impl SearchBranch {
    /// Indices of the selected candidates.
    pub fn chosen(&self) -> Vec<usize> {
        self.selected.iter().map(|selected| selected.candidate).collect()
    }
}

/// Index of the branch on all readings. The branch that excludes fold `k` has index `k + 1`.
pub(super) const ALL: usize = 0;

/// The state of the search. A clone shares the products with the original and searches on its own.
#[derive(Clone)]
pub struct SearchState<'s> {
    /// The policy for the readings.
    pub policy: Policy,
    /// The columns.
    pub columns: &'s Columns<'s>,
    /// The candidates.
    pub candidates: Vec<Arc<Candidate>>,
    /// All products.
    pub gram: Gram<'s>,
    /// The selected effects.
    pub selection: Selection,
    /// The accepted effects: additions that lowered the held-out error by more than the standard error of the decrease.
    accepted: Selection,
    /// The declared model: no effects.
    declared: Selection,
    /// For each round, the best score that readings without structure exceed with the probability of the significance
    /// level.
    pub thresholds: Vec<f64>,
    /// Whether candidates of last resort are searched.
    pub last_resort: bool,
    /// The unwhitened model and residual for the held-out error.
    unwhitened: Arc<UnwhitenedModel>,
    /// The last prediction of each fold, in their order.
    averaged: Vec<Averaged>,
    /// Components and drivers that were tried in this round.
    pub passed_over: Vec<(Component, Driver)>,
    /// Effects that scored better than readings without structure but were not accepted, in order of addition.
    pub rejected: Vec<RejectedByHeldOut>,
    /// Number of the library's detectable effects. A dictionary counts once: its step tables share its identifier, and
    /// their positions have a penalty of their own. Curves of last resort, some dozens compared with thousands, do not
    /// count.
    detectable_effects: usize,
    /// The range of each shape number over the library's members, by identifier.
    number_ranges: Arc<HashMap<String, Vec<[f64; 2]>>>,
    /// Checked before each model is trained. `None` if the search must not be interrupted.
    pub interrupt: Option<Interrupt<'s>>,
}

impl<'s> SearchState<'s> {
    /// The state before the first round. `gram` holds the products of the candidates without those of last resort,
    /// `reserve`.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn new(
        columns: &'s Columns<'s>,
        candidates: Vec<Candidate>,
        reserve: Vec<Candidate>,
        gram: Gram<'s>,
        unwhitened: UnwhitenedModel,
        policy: Policy,
    ) -> Result<SearchState<'s>, Diagnostic> {
        let none = Selection::none(columns.fold_rows.len());
        let number_ranges = Arc::new(pool::number_ranges(&candidates));
        let mut search = SearchState {
            policy,
            columns,
            candidates: candidates.into_iter().map(Arc::new).collect(),
            gram,
            selection: none.clone(),
            accepted: none.clone(),
            declared: none,
            thresholds: Vec::new(),
            last_resort: false,
            unwhitened: Arc::new(unwhitened),
            averaged: Vec::new(),
            passed_over: Vec::new(),
            rejected: Vec::new(),
            detectable_effects: 0,
            number_ranges,
            interrupt: None,
        };
        search.judge_detectability()?;
        search.append(reserve);
        search.note_held_out()?;
        search.declared = search.selection.clone();
        search.accepted = search.selection.clone();
        Ok(search)
    }

    /// The selected effects of the branch on all readings.
    pub fn selected(&self) -> &[SelectedEffect] {
        self.selection.effects()
    }

    /// The effect of a candidate.
    pub fn effect(&self, candidate: usize) -> &Effect {
        &self.candidates[candidate].effect
    }

    /// How many candidates the steps of a branch with some training folds try.
    pub fn effort(&self, folds: &[usize]) -> &'static Effort {
        if folds.len() == self.selection.branches[ALL].folds.len() { &ON_ALL } else { &ON_FOLDS }
    }
}

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
