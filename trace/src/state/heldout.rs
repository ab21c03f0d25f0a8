//! The held-out error: each fold is predicted, unwhitened, by the model of the search that excludes it. Effects are
//! accepted only if this error decreases by more than the standard error of the decrease. Where the branches without a fold
//! follow the one on all readings ([`Policy::folds_follow`](super::super::policy::Policy)), they predict by its effects.
//!
//! Near the threshold, the readings of the other folds hardly distinguish the best explanation from the next ones. The
//! prediction is therefore an average over them, weighted by `exp(score)`, in analogy to Bayesian model averaging (Hoeting
//! et al., Statistical Science 14 (1999) 382). Each coefficient is multiplied by the shrinkage factor `1 − freedom/χ²` (van
//! Houwelingen & le Cessie, Statistics in Medicine 9 (1990) 1303), so that an effect that the other folds hardly show
//! predicts little.

use std::sync::Arc;

use abbe_identify::numerics::parallel;
use abbe_model::Diagnostic;
use abbe_model::driver::Driver;
use abbe_model::effect::Component;
use faer::Mat;

use super::{ALL, SearchBranch, SearchState, SelectedEffect};
use crate::candidates::gain::{Gain, TrainedModel};
use crate::constants::{EQUIVALENT, MAX_AVERAGED, MAX_SCORE_DEFICIT};
use crate::paired::{HeldOutDecrease, Units};

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
#[derive(Default)]
struct Prediction {
    of_model: Vec<f64>,
    of_candidates: Vec<(usize, Vec<f64>)>,
}

/// All that the averaged prediction of a branch depends on.
#[derive(Clone, PartialEq)]
struct AveragedOver {
    chosen: Vec<usize>,
    /// The number of candidates that the branch may add. Candidates are only appended, so that their number tells which.
    addable: usize,
    last_resort: bool,
    passed_over: Vec<(Component, Driver)>,
}

/// The last averaged prediction of a branch. An average needs the gain of every candidate on the branch, once for each of
/// its effects, and many rounds leave a branch as it was.
#[derive(Clone)]
pub(super) struct Averaged {
    over: AveragedOver,
    prediction: Arc<Prediction>,
}

/// An explanation of the readings of the training folds in place of an effect.
struct Explanation {
    candidate: usize,
    /// Decrease of the sum of squares over the variance.
    chi_square: f64,
    /// Degrees of freedom of this decrease.
    freedom: usize,
    score: f64,
}

/// The weight of each explanation in an average. They add up to less than 1, because the coefficients are reduced.
fn weights(explanations: &[Explanation]) -> Vec<f64> {
    let best = explanations.iter().map(|one| one.score).fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = explanations.iter().map(|one| (one.score - best).exp()).sum();
    let shrinkage = |one: &Explanation| (1.0 - one.freedom as f64 / one.chi_square).max(0.0);
    explanations.iter().map(|one| shrinkage(one) * (one.score - best).exp() / total).collect()
}

impl Prediction {
    /// From the coefficients of the model columns and of the columns of some candidates, one after another.
    fn of(of_model: Vec<f64>, candidates: impl Iterator<Item = (usize, usize)>, mut rest: &[f64]) -> Prediction {
        let own = |(candidate, count): (usize, usize)| {
            let (own, others) = rest.split_at(count);
            rest = others;
            (candidate, own.to_vec())
        };
        Prediction { of_candidates: candidates.map(own).collect(), of_model }
    }

    /// Adds a multiple of another prediction.
    fn add(&mut self, weight: f64, other: &Prediction) {
        let add = |to: &mut Vec<f64>, from: &[f64]| {
            to.resize(from.len(), 0.0);
            to.iter_mut().zip(from).for_each(|(to, from)| *to += weight * from);
        };
        add(&mut self.of_model, &other.of_model);
        for (candidate, from) in &other.of_candidates {
            let place = self.of_candidates.iter().position(|(present, _)| present == candidate);
            let place = place.unwrap_or_else(|| {
                self.of_candidates.push((*candidate, Vec::new()));
                self.of_candidates.len() - 1
            });
            add(&mut self.of_candidates[place].1, from);
        }
    }
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
    fn residuals(&mut self) -> Result<HeldOutResiduals, Diagnostic> {
        let branches = &self.selection.branches;
        let of_all = self.prediction_of(&branches[ALL].chosen(), &branches[ALL].folds)?;
        let by_fold = parallel::map(branches.len() - 1, &|fold| {
            let averaged = self.averaged(ALL + 1 + fold)?;
            let residuals = [&averaged.prediction, &of_all].map(|predicted| self.residuals_of_fold(fold, predicted));
            Ok((residuals, averaged))
        });
        let by_fold: Vec<([Vec<f64>; 2], Averaged)> = by_fold.into_iter().collect::<Result<_, Diagnostic>>()?;
        let (by_fold, averaged): (Vec<[Vec<f64>; 2]>, Vec<Averaged>) = by_fold.into_iter().unzip();
        self.averaged = averaged;
        let mut next = vec![0; by_fold.len()];
        let mut residuals = HeldOutResiduals::default();
        for fold in &self.unwhitened.folds {
            let [held_out, of_all] = &by_fold[*fold];
            residuals.held_out.push(held_out[next[*fold]]);
            residuals.of_all.push(of_all[next[*fold]]);
            next[*fold] += 1;
        }
        Ok(residuals)
    }

    /// The prediction of the model with some effects, trained on some folds.
    fn prediction_of(&self, chosen: &[usize], folds: &[usize]) -> Result<Prediction, Diagnostic> {
        let trained = self.model_of(chosen, folds)?;
        let (of_model, of_chosen) = trained.coefficients();
        Ok(Prediction::of(of_model, self.with_counts(chosen), of_chosen))
    }

    /// Candidates with their numbers of columns.
    fn with_counts(&self, candidates: &[usize]) -> impl Iterator<Item = (usize, usize)> {
        candidates.iter().map(|candidate| (*candidate, self.gram.count(*candidate)))
    }

    /// The averaged prediction of a branch: the last one, if nothing has changed since.
    fn averaged(&self, branch: usize) -> Result<Averaged, Diagnostic> {
        let own = &self.selection.branches[branch];
        let addable = (0..self.candidates.len()).filter(|candidate| self.may_be_added(*candidate, &own.folds)).count();
        let over = AveragedOver {
            chosen: own.chosen(),
            addable,
            last_resort: self.last_resort,
            passed_over: self.passed_over.clone(),
        };
        let last = self.averaged.get(branch - ALL - 1).filter(|last| last.over == over);
        let prediction = match last {
            Some(last) => Arc::clone(&last.prediction),
            None => Arc::new(self.averaged_prediction(own)?),
        };
        self.forget_unselected(branch);
        Ok(Averaged { over, prediction })
    }

    /// The prediction of a branch. For each effect it is averaged over the candidates that explain about as much in its
    /// place beside the others; the changes by the averages add up.
    fn averaged_prediction(&self, branch: &SearchBranch) -> Result<Prediction, Diagnostic> {
        let chosen = branch.chosen();
        let mut averaged = Prediction::default();
        averaged.add(1.0 - chosen.len() as f64, &self.prediction_of(&chosen, &branch.folds)?);
        for effect in &chosen {
            let others: Vec<usize> = chosen.iter().copied().filter(|other| other != effect).collect();
            let without = self.model_of(&others, &branch.folds)?;
            let explanations = self.explanations(*effect, &others, &without)?;
            let weights = weights(&explanations);
            for (weight, Explanation { candidate, .. }) in weights.iter().zip(&explanations) {
                let (of_others, of_candidate) = without.with_candidate(*candidate)?;
                let (of_model, of_others) = of_others.split_at(self.gram.rank());
                let mut with = Prediction::of(of_model.to_vec(), self.with_counts(&others), of_others);
                with.of_candidates.push((*candidate, of_candidate));
                averaged.add(*weight, &with);
            }
            let of_none = 1.0 - weights.iter().sum::<f64>();
            averaged.add(of_none, &self.prediction_of(&others, &branch.folds)?);
        }
        Ok(averaged)
    }

    /// An effect and the candidates that explain about as much in its place beside others. Candidates of one name, or
    /// with the same score, are one explanation. Without any if the training folds do not determine the effect.
    fn explanations(
        &self,
        effect: usize,
        others: &[usize],
        without: &TrainedModel<'_>,
    ) -> Result<Vec<Explanation>, Diagnostic> {
        let variance = self.variance(without);
        let explanation = |candidate: usize, Gain { gain, freedom }: &Gain| Explanation {
            candidate,
            chi_square: gain / variance,
            freedom: *freedom,
            score: self.score(candidate, &Gain { gain: *gain, freedom: *freedom }, variance),
        };
        let own = without.gain(effect)?;
        if own.freedom == 0 {
            return Ok(Vec::new());
        }
        let own = explanation(effect, &own);
        // Branches that follow the one on all readings choose nothing, so that there is no other choice to average over.
        if self.policy.folds_follow {
            return Ok(vec![own]);
        }
        let least = own.score - MAX_SCORE_DEFICIT;
        let mut found: Vec<Explanation> = (self.gains(without)?.iter().enumerate())
            .filter(|(candidate, gain)| {
                let passed_over = *candidate == effect || others.contains(candidate) || gain.freedom == 0;
                !passed_over && self.most_score(*candidate, gain, variance) > least
            })
            .map(|(candidate, gain)| explanation(candidate, gain))
            .filter(|one| one.score > least)
            .collect();
        found.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.candidate.cmp(&b.candidate)));
        let mut names = vec![self.effect(effect).id()];
        let mut distinct = vec![own];
        for one in found {
            let name = self.effect(one.candidate).id();
            let is_equal = |other: &Explanation| {
                (one.score - other.score).abs() < EQUIVALENT * one.score.abs() && one.freedom == other.freedom
            };
            if distinct.len() < MAX_AVERAGED && !names.contains(&name) && !distinct.iter().any(is_equal) {
                names.push(name);
                distinct.push(one);
            }
        }
        Ok(distinct)
    }

    /// The residuals of the readings of one fold, in their order.
    fn residuals_of_fold(&self, fold: usize, predicted: &Prediction) -> Vec<f64> {
        let UnwhitenedModel { model, residual, folds, sigma_mm, .. } = &*self.unwhitened;
        let rows = (0..folds.len()).filter(|row| folds[*row] == fold);
        let by_model =
            |row: usize| predicted.of_model.iter().enumerate().map(|(j, c)| model[(row, j)] * c).sum::<f64>();
        let mut residuals: Vec<f64> = rows.map(|row| residual[row] - by_model(row)).collect();
        for (candidate, coefficients) in &predicted.of_candidates {
            let columns = self.columns.unwhitened_rows_of_fold(self.gram.set(*candidate), fold);
            for (i, residual) in residuals.iter_mut().enumerate() {
                *residual -= coefficients.iter().enumerate().map(|(j, c)| columns[(i, j)] * c).sum::<f64>() / sigma_mm;
            }
        }
        residuals
    }

    /// Sum of squares of held-out residuals over the noise variance.
    pub fn held_out_now(&mut self) -> Result<f64, Diagnostic> {
        Ok(self.residuals()?.held_out.iter().map(|r| r * r).sum())
    }

    /// Records the held-out error for the present number of effects.
    pub fn note_held_out(&mut self) -> Result<(), Diagnostic> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn explanation(chi_square: f64, freedom: usize, score: f64) -> Explanation {
        Explanation { candidate: 0, chi_square, freedom, score }
    }

    /// A strong explanation predicts nearly alone and nearly unreduced, two equal ones share, and one no stronger than
    /// noise predicts nothing.
    #[test]
    fn weights_follow_from_scores_and_shrinkage() {
        let [strong, weak] = weights(&[explanation(400.0, 2, 190.0), explanation(380.0, 2, 180.0)])[..] else {
            panic!()
        };
        assert!((strong / (1.0 - 2.0 / 400.0) - 1.0).abs() < 1e-4 && weak < 1e-4, "{strong} {weak}");
        assert_eq!(weights(&[explanation(20.0, 5, 8.0), explanation(20.0, 5, 8.0)]), [0.375, 0.375]);
        assert_eq!(weights(&[explanation(2.0, 2, -1.0)]), [0.0]);
        assert!(weights(&[]).is_empty());
    }

    #[test]
    fn predictions_of_one_candidate_add_up() {
        let one = Prediction::of(vec![1.0, 2.0], [(3, 1), (5, 2)].into_iter(), &[10.0, 20.0, 30.0]);
        let other = Prediction::of(vec![4.0, 4.0], [(5, 2)].into_iter(), &[1.0, 1.0]);
        let mut sum = Prediction::default();
        sum.add(0.5, &one);
        sum.add(2.0, &other);
        assert_eq!(sum.of_model, [8.5, 9.0]);
        assert_eq!(sum.of_candidates, [(3, vec![5.0]), (5, vec![12.0, 17.0])]);
    }
}
