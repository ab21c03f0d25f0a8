//! The held-out error: each fold is predicted, unwhitened, by the model of the search that excludes it. Effects are
//! accepted only if this error decreases by more than the standard error of the decrease.

use faer::Mat;

use super::{ALL, SearchBranch, SearchState, SelectedEffect};
use crate::candidates::columns::EffectColumns;
use crate::error::IdentifyError;
use crate::heldout::paired::{HeldOutDecrease, Units};
use crate::numerics::parallel;

/// The unwhitened model columns and residual, divided by the noise standard deviation. Held-out errors refer to these.
pub struct UnwhitenedModel {
    /// Rows × rank.
    pub model: Mat<f64>,
    /// The residual.
    pub residual: Vec<f64>,
    /// The fold of each row.
    pub folds: Vec<usize>,
    /// The independent units over which held-out errors are paired.
    pub units: Units,
    /// Standard deviation of a reading, mm.
    pub sigma_mm: f64,
}

/// The selected effects of every branch and their held-out error.
#[derive(Clone, Debug)]
pub struct Selection {
    /// The branch on all readings, then one for each fold.
    pub branches: Vec<SearchBranch>,
    /// Sum of squares of held-out residuals over the noise variance, for each number of effects.
    pub held_out: Vec<f64>,
    /// Sums of squares of held-out residuals over the noise variance, by unit.
    units: Vec<f64>,
}

impl Selection {
    /// No effects. The held-out error is not known yet.
    pub(super) fn none(folds: usize) -> Selection {
        let without = |left_out: Option<usize>| SearchBranch {
            folds: (0..folds).filter(|fold| Some(*fold) != left_out).collect(),
            selected: Vec::new(),
        };
        let branches = std::iter::once(None).chain((0..folds).map(Some)).map(without).collect();
        Selection { branches, held_out: Vec::new(), units: Vec::new() }
    }

    /// The selected effects of the branch on all readings.
    pub fn effects(&self) -> &[SelectedEffect] {
        &self.branches[ALL].selected
    }
}

/// An effect that scores better than readings without structure but is not accepted.
#[derive(Clone, Copy, Debug)]
pub struct RejectedByHeldOut {
    /// The effect.
    pub selected: SelectedEffect,
    /// The decrease of the held-out error that it causes.
    pub decrease: HeldOutDecrease,
}

impl SearchState<'_> {
    /// Sums of squares of held-out residuals over the noise variance, by unit. The model of the search that excludes a
    /// fold predicts it.
    fn held_out_by_unit(&self) -> Result<Vec<f64>, IdentifyError> {
        let branches = &self.selection.branches[ALL + 1..];
        let squares: Vec<Vec<f64>> = parallel::map(branches.len(), &|fold| self.squares_of_fold(fold, &branches[fold]))
            .into_iter()
            .collect::<Result<_, _>>()?;
        let mut next: Vec<_> = squares.iter().map(|squares| squares.iter()).collect();
        let in_order = self.unwhitened.folds.iter().map(|fold| next[*fold].next().copied().unwrap_or(0.0));
        Ok(self.unwhitened.units.sums(in_order))
    }

    /// The squares of the residuals of one fold as the branch without it predicts them.
    fn squares_of_fold(&self, fold: usize, branch: &SearchBranch) -> Result<Vec<f64>, IdentifyError> {
        let UnwhitenedModel { model, residual, folds, sigma_mm, .. } = &*self.unwhitened;
        let chosen = branch.chosen();
        let trained = self.model_of(&chosen, &branch.folds)?;
        let (of_model, of_chosen) = trained.coefficients();
        let sets: Vec<&EffectColumns> = chosen.iter().map(|candidate| self.moments.set(*candidate)).collect();
        let columns = if sets.is_empty() { Mat::zeros(folds.len(), 0) } else { self.columns.unwhitened_rows(&sets) };
        let rows = (0..folds.len()).filter(|row| folds[*row] == fold);
        let predicted = |row: usize| -> f64 {
            let by_model: f64 = of_model.iter().enumerate().map(|(j, c)| model[(row, j)] * c).sum();
            by_model + of_chosen.iter().enumerate().map(|(j, c)| columns[(row, j)] * c).sum::<f64>() / sigma_mm
        };
        Ok(rows.map(|row| (residual[row] - predicted(row)).powi(2)).collect())
    }

    /// Sum of squares of held-out residuals over the noise variance.
    pub fn held_out_now(&self) -> Result<f64, IdentifyError> {
        Ok(self.held_out_by_unit()?.iter().sum())
    }

    /// Records the held-out error for the present number of effects.
    pub fn note_held_out(&mut self) -> Result<(), IdentifyError> {
        self.selection.units = self.held_out_by_unit()?;
        let held_out = self.selection.units.iter().sum();
        let selected = self.selected().len();
        self.selection.held_out.truncate(selected);
        self.selection.held_out.resize(selected + 1, held_out);
        Ok(())
    }

    /// Accepts the selected effects if the held-out error permits it. With more effects than are accepted, it has to
    /// decrease by more than the standard error. With as many or fewer, it must not increase by more than the standard
    /// error. Returns whether all selected effects are accepted.
    pub fn accept(&mut self) -> bool {
        let decrease = self.decrease_since(&self.accepted);
        let added = self.selected().len() > self.accepted.effects().len();
        let accepted =
            if added { decrease.is_significant() } else { !decrease.is_increase() && self.lowers_heldout_error() };
        if accepted {
            self.accepted = self.selection.clone();
            let accepted = self.accepted.branches[ALL].chosen();
            self.rejected.retain(|rejected| !accepted.contains(&rejected.selected.candidate));
        }
        accepted
    }

    /// The decrease of the held-out error since another selection.
    fn decrease_since(&self, earlier: &Selection) -> HeldOutDecrease {
        self.unwhitened.units.decrease(&earlier.units, &self.selection.units)
    }

    /// Whether nothing is selected, or the held-out error is below that of the declared model by more than the standard
    /// error of the decrease.
    fn lowers_heldout_error(&self) -> bool {
        self.selected().is_empty() || self.decrease_since(&self.declared).is_significant()
    }

    /// Withdraws the effects added since the last acceptance, and records them as rejected.
    pub fn withdraw_rejected(&mut self) {
        let decrease = self.decrease_since(&self.accepted);
        let accepted = self.accepted.branches[ALL].chosen();
        for selected in self.selected().to_vec() {
            let known = self.rejected.iter().any(|u| u.selected.candidate == selected.candidate);
            if !accepted.contains(&selected.candidate) && !known {
                self.rejected.push(RejectedByHeldOut { selected, decrease });
            }
        }
        self.selection = self.accepted.clone();
    }

    /// Restores the accepted effects after an interruption within a round. The search is not interrupted again.
    pub fn roll_back(&mut self) {
        self.selection = self.accepted.clone();
        self.interrupt = None;
    }

    /// Withdraws all effects if together they do not lower the held-out error of the declared model by more than the
    /// standard error of the decrease.
    pub fn withdraw_all_unless_better(&mut self) {
        if !self.lowers_heldout_error() {
            self.accepted = self.declared.clone();
            self.withdraw_rejected();
        }
        self.accepted = self.selection.clone();
    }
}
