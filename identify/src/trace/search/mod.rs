//! The search. Each round projects out the present model, scores every candidate, adds the best and refits. It removes
//! effects that are no longer significant, and exchanges effects for better candidates. The search ends when the best
//! remaining candidate is no better than the best on readings without structure.
//!
//! One branch searches on all readings. One further branch for each fold searches on the readings outside that fold
//! ([`SearchBranch`]). Each branch selects for itself, and uses only shape numbers and positions that it has tuned
//! itself. The held-out error therefore belongs to a search without access to the held-out readings.

mod heldout;
mod models;
mod pool;

use std::ops::Range;

use super::compose::StepTable;
use super::constants::INDISTINGUISHABLE;
use super::interrupt::Interrupt;
use crate::candidates::columns::{Columns, EffectColumns};
use crate::candidates::gain::{Gain, PriorMoments, TrainedModel};
use crate::candidates::library::Candidate;
use crate::candidates::moments::Moments;
use crate::error::IdentifyError;
use heldout::HeldOutState;
pub use heldout::{RejectedByHeldOut, UnwhitenedModel};

/// The stopping rule of the search.
#[derive(Clone, Copy, Debug)]
pub struct StoppingRule {
    /// Probability that the search accepts an effect on readings without structure.
    pub significance: f64,
    /// Maximum number of effects.
    pub max_effects: usize,
    /// Whether gains are divided by the residual variance instead of the noise variance. This applies to poses, whose
    /// residual always has structure.
    pub in_residual_variance: bool,
}

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

/// The state of the search.
pub struct Search<'s> {
    /// The columns.
    pub columns: &'s Columns<'s>,
    /// The candidates.
    pub candidates: Vec<Candidate>,
    /// The basis columns of the candidates.
    column_sets: Vec<EffectColumns>,
    /// All products.
    pub moments: Moments,
    /// The priors.
    prior: PriorMoments,
    /// Number of base columns that the fitted model has.
    pub rank: usize,
    /// The branch on all readings, then one for each fold.
    pub branches: Vec<SearchBranch>,
    /// For each candidate the folds on which its shape numbers and positions were tuned. Empty for an effect of the
    /// library.
    tuned_on: Vec<Vec<usize>>,
    /// For each candidate that was ever added, the range of its columns in the base.
    added_to_base: Vec<(usize, Range<usize>)>,
    /// Sum of squares of held-out residuals over the noise variance, for each number of effects.
    pub held_out: Vec<f64>,
    /// For each round, the best score that readings without structure exceed with the probability of the significance
    /// level.
    pub thresholds: Vec<f64>,
    /// Whether candidates of last resort are searched.
    pub last_resort: bool,
    /// Candidates of last resort whose products are not computed yet.
    pub reserve: Vec<(Candidate, EffectColumns)>,
    /// The unwhitened base and residual for the held-out error.
    unwhitened: UnwhitenedModel,
    /// Sums of squares of held-out residuals over the noise variance, by unit: at present, and under the declared
    /// model.
    units_now: Vec<f64>,
    declared_units: Vec<f64>,
    /// The accepted effects: additions that lowered the held-out error by more than the standard error of the decrease.
    accepted: HeldOutState,
    /// Effects that scored better than readings without structure but were not accepted, in order of addition.
    pub rejected: Vec<RejectedByHeldOut>,
    /// For each effect of the library whether it is undetectable at its largest plausible size.
    undetectable: Vec<bool>,
    /// Checked before each model is trained. `None` if the search must not be interrupted.
    pub interrupt: Option<Interrupt<'s>>,
    pub(super) stop: StoppingRule,
}

/// The outcome of a round.
pub enum Round {
    /// An effect was added.
    Added {
        /// Index of the candidate.
        candidate: usize,
    },
    /// No remaining candidate is significant.
    Done {
        /// The p-value of the best candidate that was not added.
        p_value: f64,
    },
}

impl<'s> Search<'s> {
    /// The state before the first round.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn new(
        columns: &'s Columns<'s>,
        candidates: Vec<Candidate>,
        column_sets: Vec<EffectColumns>,
        moments: Moments,
        prior: PriorMoments,
        unwhitened: UnwhitenedModel,
        stop: StoppingRule,
    ) -> Result<Search<'s>, IdentifyError> {
        let rank = moments.base();
        let folds = 0..columns.fold_rows.len();
        let without = |left_out: Option<usize>| SearchBranch {
            folds: folds.clone().filter(|fold| Some(*fold) != left_out).collect(),
            selected: Vec::new(),
        };
        let mut search = Search {
            columns,
            tuned_on: vec![Vec::new(); candidates.len()],
            candidates,
            column_sets,
            moments,
            prior,
            rank,
            branches: std::iter::once(None).chain(folds.clone().map(Some)).map(without).collect(),
            added_to_base: Vec::new(),
            held_out: Vec::new(),
            thresholds: Vec::new(),
            last_resort: false,
            reserve: Vec::new(),
            unwhitened,
            units_now: Vec::new(),
            declared_units: Vec::new(),
            accepted: HeldOutState::default(),
            rejected: Vec::new(),
            undetectable: Vec::new(),
            interrupt: None,
            stop,
        };
        search.undetectable = search.undetectable_candidates()?;
        search.note_held_out()?;
        search.declared_units = search.units_now.clone();
        search.accepted = search.state();
        Ok(search)
    }

    /// The selected effects of the branch on all readings.
    pub fn selected(&self) -> &[SelectedEffect] {
        &self.branches[ALL].selected
    }

    /// Whether these folds are all folds.
    pub(super) fn has_all_folds(&self, folds: &[usize]) -> bool {
        folds.len() == self.branches[ALL].folds.len()
    }

    /// A limit on rounds: enough for the maximum number of effects and some merges.
    pub fn max_rounds(&self) -> usize {
        self.stop.max_effects.saturating_add(self.stop.max_effects / 2).max(1)
    }

    /// The best candidate for addition to a model with the chosen candidates, and its score.
    pub(super) fn best_of(&self, model: &TrainedModel<'_>, gains: &[Gain], chosen: &[usize]) -> Option<(usize, f64)> {
        let variance = self.variance(model);
        let mut best: Option<(usize, f64)> = None;
        for (candidate, gain) in gains.iter().enumerate() {
            if chosen.contains(&candidate) || !self.may_be_added(candidate, &model.folds) {
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
    pub(super) fn simplest_confounded(
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
            let passed_over = chosen.contains(&candidate) || !self.may_be_added(candidate, &model.folds);
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

    /// Runs one round.
    pub fn round(&mut self) -> Result<Round, IdentifyError> {
        let Some((p_value, threshold)) = self.best_against_null()? else {
            return Ok(Round::Done { p_value: 1.0 });
        };
        self.thresholds.push(threshold);
        if p_value > self.stop.significance || self.selected().len() >= self.stop.max_effects {
            return Ok(Round::Done { p_value });
        }
        let Some(candidate) = self.select(ALL, f64::NEG_INFINITY)? else {
            return Ok(Round::Done { p_value });
        };
        let before = self.branches.clone();
        self.add(ALL, SelectedEffect { candidate, p_value });
        for branch in 1..self.branches.len() {
            if let Some(candidate) = self.select(branch, threshold)? {
                self.add(branch, SelectedEffect { candidate, p_value });
            }
        }
        let held_out = self.held_out_now()?;
        // P-values are unreliable for poses. There an addition also has to lower the held-out error.
        if self.stop.in_residual_variance && held_out >= self.held_out.last().copied().unwrap_or(f64::INFINITY) {
            self.branches = before;
            return Ok(Round::Done { p_value });
        }
        self.remove_insignificant(threshold)?;
        self.note_held_out()?;
        Ok(Round::Added { candidate })
    }

    /// The p-value of the best candidate with respect to the best scores of the null draws, and the score that these
    /// exceed with the probability of the significance level.
    fn best_against_null(&self) -> Result<Option<(f64, f64)>, IdentifyError> {
        let chosen = self.branches[ALL].chosen();
        let model = self.model_without(None)?;
        let Some((_, score)) = self.best_of(&model, &model.gains(), &chosen) else {
            return Ok(None);
        };
        let composed = self.step_tables(&model);
        let score = composed.iter().map(StepTable::score).fold(score, f64::max);
        let costs: Vec<f64> = (0..self.candidates.len())
            .map(|c| {
                if self.may_be_added(c, &model.folds) { self.candidates[c].description_length() } else { f64::INFINITY }
            })
            .collect();
        let mut null = model.null_best(&costs, self.null_variance()?);
        null.sort_by(f64::total_cmp);
        let above = null.iter().filter(|best| **best >= score).count();
        let p_value = (above + 1) as f64 / (null.len() + 1) as f64;
        let rank = ((1.0 - self.stop.significance) * null.len() as f64).ceil() as usize;
        let threshold = null.get(rank.min(null.len().saturating_sub(1)));
        Ok(Some((p_value, threshold.copied().unwrap_or(0.0))))
    }

    /// The candidate that a branch adds, if it reaches a score. On all readings it is the candidate with the shortest
    /// description among those confounded with the best. With one fold left out, prediction matters and not the name,
    /// so it is the best.
    fn select(&mut self, branch: usize, least: f64) -> Result<Option<usize>, IdentifyError> {
        let SearchBranch { folds, .. } = self.branches[branch].clone();
        let chosen = self.branches[branch].chosen();
        let known = self.refine(&chosen, &folds)?;
        let model = self.model_of(&chosen, &folds)?;
        let gains = model.remaining_gains(known);
        let Some((best, score)) = self.best_of(&model, &gains, &chosen) else {
            return Ok(None);
        };
        let first = || match branch {
            ALL => self.simplest_confounded(&model, &gains, best, &chosen),
            _ => best,
        };
        Ok((score >= least).then(first))
    }

    fn add(&mut self, branch: usize, selected: SelectedEffect) {
        self.add_to_base(&[selected.candidate]);
        self.branches[branch].selected.push(selected);
    }

    /// Removes effects that later additions have made insignificant.
    fn remove_insignificant(&mut self, threshold: f64) -> Result<(), IdentifyError> {
        let folds = self.branches[ALL].folds.clone();
        loop {
            let chosen = self.branches[ALL].chosen();
            let scored = (0..chosen.len().saturating_sub(1)).map(|k| {
                let mut others = chosen.clone();
                let candidate = others.remove(k);
                let model = self.projection_of(&others, &folds)?;
                let score = self.score(candidate, &model.gain(candidate), self.variance(&model));
                Ok((k, score))
            });
            let scored: Vec<(usize, f64)> = scored.collect::<Result<_, IdentifyError>>()?;
            match scored.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)) {
                Some((k, score)) if score < threshold => {
                    self.branches[ALL].selected.remove(k);
                }
                _ => return Ok(()),
            }
        }
    }
}
