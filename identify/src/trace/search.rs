//! The search: project out what the model has, score every candidate, add the best, refit all together, let what has lost its place go, exchange
//! what something else explains better, until the best that is left is no better than the best on readings without structure.
//!
//! It runs on all readings, and beside that once for each fold on the readings outside that fold alone ([`Track`]): each chooses for itself, and uses
//! numbers and places only that it has tuned itself. So the error on held-out readings is that of a search that never saw them.

use faer::Mat;
use rayon::prelude::*;

use super::columns::{Columns, Layout};
use super::compose::{self, Composed};
use super::library::Candidate;
use super::moments::{self, Moments};
use super::score::{Gain, PriorMoments, Trained};
use super::sharpen;
use super::tail::ln_chi_square_tail;
use super::trial::Trial;

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

/// An effect that a search has taken up.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    /// Index of the candidate.
    pub candidate: usize,
    /// Probability that the search finds as good on readings without structure.
    pub p_value: f64,
}

/// One of the searches: on all readings, or on all but one fold.
#[derive(Clone, Debug)]
pub struct Track {
    /// The folds that it sees, ascending.
    pub folds: Vec<usize>,
    /// What it has taken up.
    pub taken: Vec<Taken>,
}

impl Track {
    /// The candidates that it has taken up.
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
    pub layouts: Vec<Layout>,
    /// All products.
    pub moments: Moments,
    /// What is known beforehand.
    pub prior: PriorMoments,
    /// Number of base columns that the fitted model has.
    pub rank: usize,
    /// The search on all readings, then that of each fold.
    pub tracks: Vec<Track>,
    /// For each candidate the folds whose readings its numbers and places were tuned on; none for an entry of the library.
    tuned_on: Vec<Vec<usize>>,
    /// Where the columns of every candidate that was ever taken up stand in the base.
    materialised: Vec<(usize, std::ops::Range<usize>)>,
    /// Sum of squares of held-out residuals over the variance of the noise, before and after each addition.
    pub held_out: Vec<f64>,
    /// The best score on readings without structure that is exceeded with the probability of the stop, by round.
    pub thresholds: Vec<f64>,
    /// Whether candidates of last resort are tried.
    pub last_resort: bool,
    /// Candidates of last resort that are not laid over the readings yet.
    pub reserve: Vec<(Candidate, Layout)>,
    plain: Plain,
    /// Entries of the library that would not stand out however large they plausibly were.
    unseen: Vec<bool>,
    pub(super) stop: Stop,
}

/// By how many standard deviations an effect as large as is plausible has to change the readings, all together and beyond what the model absorbs, to be
/// looked for.
const LEAST_PLAUSIBLE_SIGMA: f64 = 3.0;

/// Readings as they are, not whitened: what held-out errors are of. In units of the noise.
pub struct Plain {
    /// The base: rows × columns, extended as candidates are taken up.
    pub base: Mat<f64>,
    /// The residual.
    pub residual: Vec<f64>,
    /// The fold of each row.
    pub folds: Vec<usize>,
    /// Standard deviation of a reading, mm.
    pub sigma_mm: f64,
}

/// What a round came to.
pub enum Round {
    /// An effect was added.
    Added {
        /// Its candidate.
        candidate: usize,
    },
    /// Nothing that is left earns its place; the best that there was, and its p-value.
    Done {
        /// The p-value of the best that was not taken.
        p_value: f64,
    },
}

impl<'s> Search<'s> {
    /// Before the first round.
    pub fn new(
        columns: &'s Columns<'s, 's>,
        candidates: Vec<Candidate>,
        layouts: Vec<Layout>,
        moments: Moments,
        prior: PriorMoments,
        plain: Plain,
        stop: Stop,
    ) -> Search<'s> {
        let rank = moments.base();
        let folds = 0..columns.fold_rows.len();
        let without = |left_out: Option<usize>| Track {
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
            unseen: Vec::new(),
            stop,
        };
        search.unseen = {
            let model = search.model_without(None);
            (0..search.candidates.len())
                .into_par_iter()
                .map(|candidate| {
                    let (d, _, _) = model.projected(candidate);
                    let effect = &search.candidates[candidate].effect;
                    let plausible = columns.plausible(effect, &search.layouts[candidate]);
                    let largest = (0..d.nrows()).map(|k| d[(k, k)]).fold(0.0, f64::max);
                    plausible * largest.max(0.0).sqrt() < LEAST_PLAUSIBLE_SIGMA
                })
                .collect()
        };
        search.note_held_out();
        search
    }

    /// What the search on all readings has taken up.
    pub fn taken(&self) -> &[Taken] {
        &self.tracks[ALL].taken
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
    pub(super) fn is_own(&self, candidate: usize, folds: &[usize]) -> bool {
        let tuned_on = &self.tuned_on[candidate];
        tuned_on.is_empty() || tuned_on == folds
    }

    /// Whether folds are all that there are.
    pub(super) fn sees_all(&self, folds: &[usize]) -> bool {
        folds.len() == self.tracks[ALL].folds.len()
    }

    /// Where a candidate's columns stand in the base; nowhere before it was ever taken up.
    pub fn places(&self, candidate: usize) -> std::ops::Range<usize> {
        self.materialised
            .iter()
            .find(|(c, _)| *c == candidate)
            .map_or(0..0, |(_, places)| places.clone())
    }

    fn base_with(&self, chosen: &[usize]) -> Vec<usize> {
        (0..self.rank)
            .chain(chosen.iter().flat_map(|candidate| self.places(*candidate)))
            .collect()
    }

    /// The model with some candidates, trained on some folds.
    pub(super) fn model_of(&self, chosen: &[usize], folds: &[usize]) -> Trained<'_> {
        Trained::new(&self.moments, &self.prior, self.base_with(chosen), folds.to_vec())
    }

    /// The same, to be asked for few candidates.
    pub(super) fn lean_model_of(&self, chosen: &[usize], folds: &[usize]) -> Trained<'_> {
        Trained::lean(&self.moments, &self.prior, self.base_with(chosen), folds.to_vec())
    }

    /// The model with what has been taken, less one of it, on all readings.
    pub fn model_without(&self, left_out: Option<usize>) -> Trained<'_> {
        let mut chosen = self.tracks[ALL].chosen();
        if let Some(k) = left_out {
            chosen.remove(k);
        }
        self.model_of(&chosen, &self.tracks[ALL].folds)
    }

    /// The variance that gains are measured in.
    pub fn variance(&self, model: &Trained<'_>) -> f64 {
        if !self.stop.in_residual_variance {
            return 1.0;
        }
        let sum: f64 = model
            .folds
            .iter()
            .map(|fold| model.sum_of_squares_on(*fold))
            .sum();
        let rows: usize = model
            .folds
            .iter()
            .map(|fold| self.columns.fold_rows[*fold].len())
            .sum();
        let freedom = rows.saturating_sub(model.base.len()).max(1) as f64;
        (sum / freedom).max(f64::MIN_POSITIVE)
    }

    /// The variance of the null draws, in the same sense.
    fn null_variance(&self) -> f64 {
        self.variance(&self.lean_model_of(&[], &self.tracks[ALL].folds))
    }

    /// `−ln P` of a gain.
    pub fn evidence(&self, gain: &Gain, variance: f64) -> f64 {
        if gain.freedom == 0 {
            return f64::NEG_INFINITY;
        }
        -ln_chi_square_tail(gain.gain / variance, gain.freedom)
    }

    /// The evidence for a candidate: `−ln P` of its gain, less the price of its places.
    pub fn evidence_for(&self, candidate: usize, gain: &Gain, variance: f64) -> f64 {
        self.evidence(gain, variance) - self.candidates[candidate].price
    }

    /// The same, less the candidate's cost.
    pub fn score(&self, candidate: usize, gain: &Gain, variance: f64) -> f64 {
        self.evidence_for(candidate, gain, variance) - self.candidates[candidate].cost
    }

    /// What can be composed of the library's dictionaries beside a model.
    fn composed(&self, model: &Trained<'_>) -> Vec<Composed> {
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
    pub(super) fn sharpen(&mut self, beside: &[usize], folds: &[usize]) -> Vec<Gain> {
        if !self.candidates.iter().any(sharpen::can_be_tuned) {
            return Vec::new();
        }
        let (gains, fresh) = {
            let model = self.model_of(beside, folds);
            let gains = model.gains();
            let fresh = sharpen::sharpened(self, &model, &gains, &self.composed(&model));
            (gains, fresh)
        };
        for candidate in fresh {
            self.add_tuned(candidate, folds);
        }
        gains
    }

    /// Adds a candidate that was tuned on some folds; its number, if the data have what it follows.
    pub(super) fn add_tuned(&mut self, candidate: Candidate, folds: &[usize]) -> Option<usize> {
        let layout = self.columns.layout(&candidate.effect)?;
        self.append(vec![(candidate, layout)], folds);
        Some(self.candidates.len() - 1)
    }

    pub(super) fn append(&mut self, fresh: Vec<(Candidate, Layout)>, tuned_on: &[usize]) {
        if fresh.is_empty() {
            return;
        }
        let (candidates, layouts): (Vec<Candidate>, Vec<Layout>) = fresh.into_iter().unzip();
        self.candidates.extend(candidates);
        self.layouts.extend(layouts);
        self.tuned_on.resize(self.candidates.len(), tuned_on.to_vec());
        self.moments.append(self.columns, &self.layouts);
    }

    /// How many entries of the library would stand out if they were as large as is plausible.
    pub(super) fn seen_entries(&self) -> usize {
        self.unseen.iter().filter(|unseen| !**unseen).count()
    }

    /// Lays the candidates of last resort over the readings.
    pub fn bring_reserve(&mut self) {
        let reserve = std::mem::take(&mut self.reserve);
        self.append(reserve, &[]);
    }

    /// Enough for every effect that may be taken up, and some that were put down to one.
    pub fn most_rounds(&self) -> usize {
        self.stop.most.saturating_add(self.stop.most / 2).max(1)
    }

    /// The best beside a model of what has been chosen, of what each would gain there.
    pub(super) fn best_of(
        &self,
        model: &Trained<'_>,
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
        model: &Trained<'_>,
        gains: &[Gain],
        best: usize,
        chosen: &[usize],
    ) -> usize {
        let variance = self.variance(model);
        let least = self.evidence_for(best, &gains[best], variance) - super::alias::INDISTINGUISHABLE;
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
    pub fn round(&mut self) -> Round {
        let (p_value, threshold) = match self.best_against_null() {
            Some(found) => found,
            None => return Round::Done { p_value: 1.0 },
        };
        self.thresholds.push(threshold);
        if p_value > self.stop.significance || self.taken().len() >= self.stop.most {
            return Round::Done { p_value };
        }
        let Some(candidate) = self.pick(ALL, f64::NEG_INFINITY) else {
            return Round::Done { p_value };
        };
        let before = self.tracks.clone();
        self.take(ALL, Taken { candidate, p_value });
        for track in 1..self.tracks.len() {
            if let Some(candidate) = self.pick(track, threshold) {
                self.take(track, Taken { candidate, p_value });
            }
        }
        let held_out = self.held_out_now();
        // For poses p-values say little; there an effect has to earn its place on the readings that were held out.
        if self.stop.in_residual_variance
            && held_out >= self.held_out.last().copied().unwrap_or(f64::INFINITY)
        {
            self.tracks = before;
            return Round::Done { p_value };
        }
        self.let_go(threshold);
        self.note_held_out();
        Round::Added { candidate }
    }

    /// The p-value of the best beside what has been taken, among the best of draws without structure, and the score that those exceed with the probability
    /// of the stop.
    fn best_against_null(&self) -> Option<(f64, f64)> {
        let chosen = self.tracks[ALL].chosen();
        let model = self.model_without(None);
        let (_, score) = self.best_of(&model, &model.gains(), &chosen)?;
        let composed = self.composed(&model);
        let score = composed.iter().map(Composed::score).fold(score, f64::max);
        let costs: Vec<f64> = (0..self.candidates.len())
            .map(|c| {
                if self.is_open(c, &model.folds) {
                    self.candidates[c].length()
                } else {
                    f64::INFINITY
                }
            })
            .collect();
        let mut null = model.null_best(&costs, self.null_variance());
        null.sort_by(f64::total_cmp);
        let above = null.iter().filter(|best| **best >= score).count();
        let p_value = (above + 1) as f64 / (null.len() + 1) as f64;
        let rank = ((1.0 - self.stop.significance) * null.len() as f64).ceil() as usize;
        let threshold = null.get(rank.min(null.len().saturating_sub(1)));
        Some((p_value, threshold.copied().unwrap_or(0.0)))
    }

    /// What a search would add, if it reaches a score: on all readings the simplest that cannot be told from the best; where a fold is left out, which has to
    /// be predicted and not named, the best.
    fn pick(&mut self, track: usize, least: f64) -> Option<usize> {
        let Track { folds, .. } = self.tracks[track].clone();
        let chosen = self.tracks[track].chosen();
        let known = self.sharpen(&chosen, &folds);
        let model = self.model_of(&chosen, &folds);
        let gains = model.more_gains(known);
        let (best, score) = self.best_of(&model, &gains, &chosen)?;
        let first = || match track {
            ALL => self.named_first(&model, &gains, best, &chosen),
            _ => best,
        };
        (score >= least).then(first)
    }

    fn take(&mut self, track: usize, taken: Taken) {
        self.materialise(&[taken.candidate]);
        self.tracks[track].taken.push(taken);
    }

    /// Drops what the later effects have made superfluous.
    fn let_go(&mut self, threshold: f64) {
        let folds = self.tracks[ALL].folds.clone();
        loop {
            let chosen = self.tracks[ALL].chosen();
            let weakest = (0..chosen.len().saturating_sub(1))
                .map(|k| {
                    let mut others = chosen.clone();
                    let candidate = others.remove(k);
                    let model = self.lean_model_of(&others, &folds);
                    (
                        k,
                        self.score(candidate, &model.gain(candidate), self.variance(&model)),
                    )
                })
                .min_by(|a, b| a.1.total_cmp(&b.1));
            match weakest {
                Some((k, score)) if score < threshold => {
                    self.tracks[ALL].taken.remove(k);
                }
                _ => return,
            }
        }
    }

    /// Puts the columns of candidates into the base, where they are not there yet.
    pub(super) fn materialise(&mut self, candidates: &[usize]) {
        let fresh: Vec<usize> = candidates
            .iter()
            .copied()
            .filter(|c| !self.materialised.iter().any(|(present, _)| present == c))
            .collect();
        if fresh.is_empty() {
            return;
        }
        let places = self.moments.materialise(self.columns, &self.layouts, &fresh);
        let chosen: Vec<&Layout> = fresh.iter().map(|c| &self.layouts[*c]).collect();
        let rows = self.columns.plain_rows(&chosen);
        let norms: Vec<f64> = fresh.iter().flat_map(|c| self.norms(*c)).collect();
        let old = self.plain.base.ncols();
        let sigma_mm = self.plain.sigma_mm;
        moments::grow(&mut self.plain.base, rows.nrows(), old + rows.ncols(), |i, j| {
            let norm = norms[j - old];
            if norm > 0.0 {
                rows[(i, j - old)] / (norm * sigma_mm)
            } else {
                0.0
            }
        });
        self.materialised.extend(fresh.into_iter().zip(places));
    }

    /// Sum of squares of held-out residuals over the variance of the noise: each fold under the model of the search that did not see it.
    fn held_out_now(&self) -> f64 {
        let models: Vec<Trained<'_>> = self.tracks[ALL + 1..]
            .par_iter()
            .map(|track| self.lean_model_of(&track.chosen(), &track.folds))
            .collect();
        let predicted = |model: &Trained<'_>, row: usize| -> f64 {
            let along = model.base.iter().zip(&model.coefficients);
            along.map(|(column, c)| self.plain.base[(row, *column)] * c).sum()
        };
        self.plain
            .folds
            .iter()
            .enumerate()
            .map(|(row, fold)| (self.plain.residual[row] - predicted(&models[*fold], row)).powi(2))
            .sum()
    }

    /// Writes down the held-out error with as many effects as there are now.
    pub(super) fn note_held_out(&mut self) {
        let held_out = self.held_out_now();
        let taken = self.taken().len();
        self.held_out.truncate(taken);
        self.held_out.resize(taken + 1, held_out);
    }

    /// What any effect would gain beside a model, on the folds that it is trained on; `None` where the data lack what it follows.
    pub fn gain_beside(&self, model: &Trained<'_>, effect: &abbe_model::effect::Effect) -> Option<f64> {
        Some(self.trial(model, effect)?.gain(model))
    }

    /// Any effect on trial beside a model; `None` where the data lack what it follows.
    pub(super) fn trial(&self, model: &Trained<'_>, effect: &abbe_model::effect::Effect) -> Option<Trial> {
        let layout = self.columns.layout_uncached(effect)?;
        Some(Trial::new(self.columns, &self.moments, &layout, model))
    }

    /// The lengths of a candidate's columns over all readings.
    pub fn norms(&self, candidate: usize) -> Vec<f64> {
        (0..self.moments.count[candidate])
            .map(|k| {
                self.moments
                    .folds
                    .iter()
                    .map(|fold| fold.own[candidate][(k, k)])
                    .sum::<f64>()
                    .max(0.0)
                    .sqrt()
            })
            .collect()
    }
}
