//! The search: project out what the model has, score every candidate, add the best, refit all together, let what has lost its place go, exchange
//! what something else explains better, until the best that is left is no better than the best on readings without structure.
//!
//! It runs on all readings, and beside that once for each fold on the readings outside that fold alone ([`SearchBranch`]): each chooses for itself, and uses
//! numbers and places only that it has tuned itself. So the error on held-out readings is that of a search that never saw them.

mod heldout;
mod models;
mod pool;

use std::ops::Range;

use super::alias::INDISTINGUISHABLE;
use super::columns::{Columns, Layout};
use super::compose::StepTable;
use super::interrupt::Interrupt;
use super::library::Candidate;
use super::moments::Moments;
use super::score::{Gain, PriorMoments, TrainedModel};
use crate::error::IdentifyError;
use heldout::HeldOutState;
pub use heldout::{Plain, RejectedByHeldOut};

/// When the search stops.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// Probability that the search claims anything on readings without structure.
    pub significance: f64,
    /// The most effects.
    pub most: usize,
    /// Whether residual variance, not noise, is what gains are measured in: for poses, whose structure never ends.
    pub in_residual_variance: bool,
}

/// An effect that a search has added.
#[derive(Clone, Copy, Debug)]
pub struct SelectedEffect {
    /// Index of the candidate.
    pub candidate: usize,
    /// Probability that the search finds as good on readings without structure.
    pub p_value: f64,
}

/// One of the searches: on all readings, or on all but one fold.
#[derive(Clone, Debug)]
pub struct SearchBranch {
    /// The folds that it sees, ascending.
    pub folds: Vec<usize>,
    /// What it has added.
    pub taken: Vec<SelectedEffect>,
}

impl SearchBranch {
    /// The candidates that it has added.
    pub fn chosen(&self) -> Vec<usize> {
        self.taken.iter().map(|taken| taken.candidate).collect()
    }
}

/// Place of the search on all readings among the tracks; that which leaves out fold `k` is at `k + 1`.
pub(super) const ALL: usize = 0;

/// Where the search stands.
pub struct Search<'s> {
    /// The columns.
    pub columns: &'s Columns<'s, 's>,
    /// What is looked for.
    pub candidates: Vec<Candidate>,
    /// The candidates laid over the tests.
    layouts: Vec<Layout>,
    /// All products.
    pub moments: Moments,
    /// What is known beforehand.
    prior: PriorMoments,
    /// Number of base columns that the fitted model has.
    pub rank: usize,
    /// The search on all readings, then that of each fold.
    pub tracks: Vec<SearchBranch>,
    /// For each candidate the folds whose readings its numbers and places were tuned on; none for an entry of the library.
    tuned_on: Vec<Vec<usize>>,
    /// Where the columns of every candidate that was ever added stand in the base.
    materialised: Vec<(usize, Range<usize>)>,
    /// Sum of squares of held-out residuals over the variance of the noise, before and after each addition.
    pub held_out: Vec<f64>,
    /// The best score on readings without structure that is exceeded with the probability of the stop, by round.
    pub thresholds: Vec<f64>,
    /// Whether candidates of last resort are tried.
    pub last_resort: bool,
    /// Candidates of last resort whose products are not made yet.
    pub reserve: Vec<(Candidate, Layout)>,
    /// What held-out errors are of.
    plain: Plain,
    /// Sums of squares of held-out residuals over the variance of the noise, by unit: now, and under the declared model.
    units_now: Vec<f64>,
    declared_units: Vec<f64>,
    /// What is claimed: additions that lowered the held-out error by more than the standard error of the fall.
    claimed: HeldOutState,
    /// What scored better than readings without structure and was not claimed, in the order in which it was added.
    pub unclaimed: Vec<RejectedByHeldOut>,
    /// Entries of the library that would not stand out however large they plausibly were.
    unseen: Vec<bool>,
    /// Asked before each model that is trained; `None` where the search is not to be interrupted.
    pub interrupt: Option<Interrupt<'s>>,
    pub(super) stop: Stop,
}

/// What a round came to.
pub enum Round {
    /// An effect was added.
    Added {
        /// Its candidate.
        candidate: usize,
    },
    /// No remaining candidate is significant; the best that there was, and its p-value.
    Done {
        /// The p-value of the best that was not taken.
        p_value: f64,
    },
}

impl<'s> Search<'s> {
    /// Before the first round.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn new(
        columns: &'s Columns<'s, 's>,
        candidates: Vec<Candidate>,
        layouts: Vec<Layout>,
        moments: Moments,
        prior: PriorMoments,
        plain: Plain,
        stop: Stop,
    ) -> Result<Search<'s>, IdentifyError> {
        let rank = moments.base();
        let folds = 0..columns.fold_rows.len();
        let without = |left_out: Option<usize>| SearchBranch {
            folds: folds.clone().filter(|fold| Some(*fold) != left_out).collect(),
            taken: Vec::new(),
        };
        let mut search = Search {
            columns,
            tuned_on: vec![Vec::new(); candidates.len()],
            candidates,
            layouts,
            moments,
            prior,
            rank,
            tracks: std::iter::once(None)
                .chain(folds.clone().map(Some))
                .map(without)
                .collect(),
            materialised: Vec::new(),
            held_out: Vec::new(),
            thresholds: Vec::new(),
            last_resort: false,
            reserve: Vec::new(),
            plain,
            units_now: Vec::new(),
            declared_units: Vec::new(),
            claimed: HeldOutState::default(),
            unclaimed: Vec::new(),
            unseen: Vec::new(),
            interrupt: None,
            stop,
        };
        search.unseen = search.not_detectable()?;
        search.note_held_out()?;
        search.declared_units = search.units_now.clone();
        search.claimed = search.standing();
        Ok(search)
    }

    /// What the search on all readings has added.
    pub fn taken(&self) -> &[SelectedEffect] {
        &self.tracks[ALL].taken
    }

    /// Whether folds are all that there are.
    pub(super) fn identifies_all(&self, folds: &[usize]) -> bool {
        folds.len() == self.tracks[ALL].folds.len()
    }

    /// Enough for every effect that may be added, and some that were attributed to one.
    pub fn most_rounds(&self) -> usize {
        self.stop.most.saturating_add(self.stop.most / 2).max(1)
    }

    /// The best beside a model of what has been chosen, of what each would gain there.
    pub(super) fn best_of(
        &self,
        model: &TrainedModel<'_>,
        gains: &[Gain],
        chosen: &[usize],
    ) -> Option<(usize, f64)> {
        let variance = self.variance(model);
        let mut best: Option<(usize, f64)> = None;
        for (candidate, gain) in gains.iter().enumerate() {
            if chosen.contains(&candidate) || !self.is_open(candidate, &model.folds) {
                continue;
            }
            let score = self.score(candidate, gain, variance);
            if best.is_none_or(|(_, most)| score > most) {
                best = Some((candidate, score));
            }
        }
        best.filter(|(_, score)| score.is_finite())
    }

    /// The simplest of the candidates that the readings cannot tell from the best one.
    pub(super) fn named_first(
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
            let passed_over = chosen.contains(&candidate) || !self.is_open(candidate, &model.folds);
            if passed_over || gain.freedom == 0 || self.evidence_for(candidate, gain, variance) < least {
                continue;
            }
            let length = self.candidates[candidate].length();
            let present = self.candidates[first].length();
            if length < present || (length == present && gain.gain > gains[first].gain * (1.0 + 1e-9)) {
                first = candidate;
            }
        }
        first
    }

    /// One round.
    pub fn round(&mut self) -> Result<Round, IdentifyError> {
        let Some((p_value, threshold)) = self.best_against_null()? else {
            return Ok(Round::Done { p_value: 1.0 });
        };
        self.thresholds.push(threshold);
        if p_value > self.stop.significance || self.taken().len() >= self.stop.most {
            return Ok(Round::Done { p_value });
        }
        let Some(candidate) = self.pick(ALL, f64::NEG_INFINITY)? else {
            return Ok(Round::Done { p_value });
        };
        let before = self.tracks.clone();
        self.add(ALL, SelectedEffect { candidate, p_value });
        for track in 1..self.tracks.len() {
            if let Some(candidate) = self.pick(track, threshold)? {
                self.add(track, SelectedEffect { candidate, p_value });
            }
        }
        let held_out = self.held_out_now()?;
        // For poses p-values say little; there an effect has to be significant on the readings that were held out.
        if self.stop.in_residual_variance
            && held_out >= self.held_out.last().copied().unwrap_or(f64::INFINITY)
        {
            self.tracks = before;
            return Ok(Round::Done { p_value });
        }
        self.remove_insignificant(threshold)?;
        self.note_held_out()?;
        Ok(Round::Added { candidate })
    }

    /// The p-value of the best beside what has been taken, among the best of draws without structure, and the score that those exceed with the probability
    /// of the stop.
    fn best_against_null(&self) -> Result<Option<(f64, f64)>, IdentifyError> {
        let chosen = self.tracks[ALL].chosen();
        let model = self.model_without(None)?;
        let Some((_, score)) = self.best_of(&model, &model.gains(), &chosen) else {
            return Ok(None);
        };
        let composed = self.composed(&model);
        let score = composed.iter().map(StepTable::score).fold(score, f64::max);
        let costs: Vec<f64> = (0..self.candidates.len())
            .map(|c| {
                if self.is_open(c, &model.folds) {
                    self.candidates[c].length()
                } else {
                    f64::INFINITY
                }
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

    /// What a search would add, if it reaches a score: on all readings the simplest among those that are indistinguishable from the best; where a fold is left out, which has to
    /// be predicted and not named, the best.
    fn pick(&mut self, track: usize, least: f64) -> Result<Option<usize>, IdentifyError> {
        let SearchBranch { folds, .. } = self.tracks[track].clone();
        let chosen = self.tracks[track].chosen();
        let known = self.refine(&chosen, &folds)?;
        let model = self.model_of(&chosen, &folds)?;
        let gains = model.more_gains(known);
        let Some((best, score)) = self.best_of(&model, &gains, &chosen) else {
            return Ok(None);
        };
        let first = || match track {
            ALL => self.named_first(&model, &gains, best, &chosen),
            _ => best,
        };
        Ok((score >= least).then(first))
    }

    fn add(&mut self, track: usize, taken: SelectedEffect) {
        self.materialise(&[taken.candidate]);
        self.tracks[track].taken.push(taken);
    }

    /// Drops what the later effects have made superfluous.
    fn remove_insignificant(&mut self, threshold: f64) -> Result<(), IdentifyError> {
        let folds = self.tracks[ALL].folds.clone();
        loop {
            let chosen = self.tracks[ALL].chosen();
            let scored = (0..chosen.len().saturating_sub(1)).map(|k| {
                let mut others = chosen.clone();
                let candidate = others.remove(k);
                let model = self.lean_model_of(&others, &folds)?;
                let score = self.score(candidate, &model.gain(candidate), self.variance(&model));
                Ok((k, score))
            });
            let scored: Vec<(usize, f64)> = scored.collect::<Result<_, IdentifyError>>()?;
            match scored.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)) {
                Some((k, score)) if score < threshold => {
                    self.tracks[ALL].taken.remove(k);
                }
                _ => return Ok(()),
            }
        }
    }
}
