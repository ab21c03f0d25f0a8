//! The held-out error: each fold is predicted, unwhitened, by the model of the search that excludes it. Effects are
//! accepted only if this error decreases by more than the standard error of the decrease.
//!
//! Near the threshold, the readings of the other folds hardly distinguish the best explanation from the next ones. The
//! prediction is therefore an average over them, weighted by `exp(score)` (Bayesian model averaging: Hoeting et al.,
//! Statistical Science 14 (1999) 382). The gain of the best of many candidates is too large by chance. Each coefficient
//! is reduced by the factor `1 − freedom/gain` (James & Stein, Proc. 4th Berkeley Symp. 1 (1961) 361).

use std::sync::Arc;

use faer::Mat;

use super::{ALL, SearchBranch, SearchState, SelectedEffect};
use crate::candidates::gain::{Gain, TrainedModel};
use crate::error::IdentifyError;
use crate::heldout::paired::{HeldOutDecrease, Units};
use crate::numerics::parallel;
use crate::trace::constants::{MAX_AVERAGED, MAX_EVIDENCE_DEFICIT};

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
    residuals: Arc<HeldOutResiduals>,
}

/// Residuals over the noise standard deviation, unwhitened, by row.
#[derive(Debug, Default)]
struct HeldOutResiduals {
    /// Each fold as the branch without it predicts it.
    held_out: Vec<f64>,
    /// Of the model of all readings.
    of_all: Vec<f64>,
}

/// Coefficients of the model columns, and of the columns of some candidates.
struct Prediction {
    of_model: Vec<f64>,
    of_candidates: Vec<(usize, Vec<f64>)>,
}

impl Selection {
    /// No effects. The held-out error is not known yet.
    pub(super) fn none(folds: usize) -> Selection {
        let without = |left_out: Option<usize>| SearchBranch {
            folds: (0..folds).filter(|fold| Some(*fold) != left_out).collect(),
            selected: Vec::new(),
        };
        let branches = std::iter::once(None).chain((0..folds).map(Some)).map(without).collect();
        Selection { branches, held_out: Vec::new(), residuals: Arc::default() }
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
    /// The residuals of the selected effects.
    fn residuals(&self) -> Result<HeldOutResiduals, IdentifyError> {
        let branches = &self.selection.branches;
        let of_all = self.prediction_of(&branches[ALL].chosen(), &branches[ALL].folds)?;
        let by_fold = parallel::map(branches.len() - 1, &|fold| {
            let predicted = self.averaged_prediction(&branches[ALL + 1 + fold])?;
            self.moments.keep_chosen(&branches[ALL + 1 + fold].folds, &branches[ALL + 1 + fold].chosen());
            Ok((self.residuals_of_fold(fold, &predicted), self.residuals_of_fold(fold, &of_all)))
        });
        let by_fold: Vec<(Vec<f64>, Vec<f64>)> = by_fold.into_iter().collect::<Result<_, IdentifyError>>()?;
        let mut next = vec![0; by_fold.len()];
        let mut residuals = HeldOutResiduals::default();
        for fold in &self.unwhitened.folds {
            let (held_out, of_all) = &by_fold[*fold];
            residuals.held_out.push(held_out[next[*fold]]);
            residuals.of_all.push(of_all[next[*fold]]);
            next[*fold] += 1;
        }
        Ok(residuals)
    }

    /// The prediction of the model with some effects, trained on some folds.
    fn prediction_of(&self, chosen: &[usize], folds: &[usize]) -> Result<Prediction, IdentifyError> {
        Ok(self.prediction(chosen, &self.model_of(chosen, folds)?))
    }

    fn prediction(&self, chosen: &[usize], trained: &TrainedModel<'_>) -> Prediction {
        let (of_model, mut rest) = trained.coefficients();
        let own = |candidate: &usize| {
            let (own, others) = rest.split_at(self.moments.count(*candidate));
            rest = others;
            (*candidate, own.to_vec())
        };
        Prediction { of_model, of_candidates: chosen.iter().map(own).collect() }
    }

    /// The prediction of a branch, averaged over the last effect and the candidates that explain about as much in its
    /// place.
    fn averaged_prediction(&self, branch: &SearchBranch) -> Result<Prediction, IdentifyError> {
        let chosen = branch.chosen();
        let Some((last, others)) = chosen.split_last() else { return self.prediction_of(&[], &branch.folds) };
        let trained = self.model_of(others, &branch.folds)?;
        let mut average = self.prediction(others, &trained);
        let without = (average.of_model.clone(), average.of_candidates.clone());
        let averaged = self.explanations(*last, others, &trained)?;
        let best = averaged.iter().map(|(_, _, score)| *score).fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = averaged.iter().map(|(_, _, score)| (score - best).exp()).sum();
        for (candidate, gain, score) in averaged {
            let reduction = (1.0 - gain.freedom as f64 / gain.gain).max(0.0);
            let weight = reduction * (score - best).exp() / total;
            let (with, of_candidate) = trained.with_candidate(candidate)?;
            let (of_model, mut rest) = with.split_at(without.0.len());
            for (average, (with, without)) in average.of_model.iter_mut().zip(of_model.iter().zip(&without.0)) {
                *average += weight * (with - without);
            }
            for ((_, average), (_, without)) in average.of_candidates.iter_mut().zip(&without.1) {
                let (own, others) = rest.split_at(average.len());
                rest = others;
                for (average, (with, without)) in average.iter_mut().zip(own.iter().zip(without)) {
                    *average += weight * (with - without);
                }
            }
            average.of_candidates.push((candidate, of_candidate.iter().map(|c| weight * c).collect()));
        }
        Ok(average)
    }

    /// An effect and the candidates that explain about as much in its place beside others, with gains and scores. Those
    /// that the training folds do not determine are left out: they predict nothing.
    fn explanations(
        &self,
        effect: usize,
        others: &[usize],
        trained: &TrainedModel<'_>,
    ) -> Result<Vec<(usize, Gain, f64)>, IdentifyError> {
        let variance = self.variance(trained);
        let own = trained.gain(effect)?;
        let least = self.score(effect, &own, variance) - MAX_EVIDENCE_DEFICIT;
        let gains = self.gains(trained)?;
        let mut found: Vec<(usize, Gain, f64)> = Vec::new();
        for (candidate, gain) in gains.into_iter().enumerate().filter(|(_, gain)| gain.freedom > 0) {
            let passed_over = candidate == effect || others.contains(&candidate);
            if !passed_over && self.most_score(candidate, &gain, variance) > least {
                let score = self.score(candidate, &gain, variance);
                found.push((candidate, gain, score));
            }
        }
        found.retain(|(_, _, score)| *score > least);
        found.sort_by(|a, b| b.2.total_cmp(&a.2).then(a.0.cmp(&b.0)));
        found.truncate(MAX_AVERAGED - 1);
        if own.freedom > 0 {
            found.push((effect, own, least + MAX_EVIDENCE_DEFICIT));
        }
        Ok(found)
    }

    /// The residuals of the readings of one fold, in their order.
    fn residuals_of_fold(&self, fold: usize, predicted: &Prediction) -> Vec<f64> {
        let UnwhitenedModel { model, residual, folds, sigma_mm, .. } = &*self.unwhitened;
        let rows = (0..folds.len()).filter(|row| folds[*row] == fold);
        let by_model =
            |row: usize| predicted.of_model.iter().enumerate().map(|(j, c)| model[(row, j)] * c).sum::<f64>();
        let mut residuals: Vec<f64> = rows.map(|row| residual[row] - by_model(row)).collect();
        for (candidate, coefficients) in &predicted.of_candidates {
            let columns = self.columns.unwhitened_rows_of_fold(self.moments.set(*candidate), fold);
            for (i, residual) in residuals.iter_mut().enumerate() {
                *residual -= coefficients.iter().enumerate().map(|(j, c)| columns[(i, j)] * c).sum::<f64>() / sigma_mm;
            }
        }
        residuals
    }

    /// Sum of squares of held-out residuals over the noise variance.
    pub fn held_out_now(&self) -> Result<f64, IdentifyError> {
        Ok(self.residuals()?.held_out.iter().map(|r| r * r).sum())
    }

    /// Records the held-out error for the present number of effects.
    pub fn note_held_out(&mut self) -> Result<(), IdentifyError> {
        let residuals = self.residuals()?;
        let held_out = residuals.held_out.iter().map(|r| r * r).sum();
        self.selection.residuals = Arc::new(residuals);
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
        let (before, after) = (&earlier.residuals.held_out, &self.selection.residuals);
        self.unwhitened.units.decrease(before, &after.held_out, &after.of_all)
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
