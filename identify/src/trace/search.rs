//! The search: project out what the model has, score every candidate, add the best, refit all together, let what has lost its place go, exchange
//! what something else explains better, until the best that is left is no better than the best on readings without structure.
//!
//! It runs on all readings, and beside that once for each fold on the readings outside that fold alone, so that the error on held-out readings
//! is that of a search that never saw them.

use std::collections::BTreeSet;

use abbe_model::effect::{Driver, Shape};
use faer::Mat;
use rayon::prelude::*;

use super::columns::{Columns, Layout};
use super::compose::{self, Composed};
use super::library::Candidate;
use super::moments::Moments;
use super::score::{Gain, PriorMoments, Trained, ln_chi_square_tail};
use super::sharpen;

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

/// An effect that the search has taken up.
#[derive(Clone, Debug)]
pub struct Taken {
    /// Index of the candidate.
    pub candidate: usize,
    /// Its columns in the base.
    pub places: std::ops::Range<usize>,
    /// Probability that the search finds as good on readings without structure.
    pub p_value: f64,
}

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
    /// What has been taken up.
    pub taken: Vec<Taken>,
    /// What each fold's own search has taken up: candidates.
    pub of_fold: Vec<Vec<usize>>,
    /// Where the columns of every candidate that was ever taken up stand in the base.
    pub(super) materialised: Vec<(usize, std::ops::Range<usize>)>,
    /// Sum of squares of held-out residuals over the variance of the noise, before and after each addition.
    pub held_out: Vec<f64>,
    /// The best score on readings without structure that is exceeded with the probability of the stop, by round.
    pub thresholds: Vec<f64>,
    /// Whether candidates of last resort are tried.
    pub last_resort: bool,
    /// Candidates of last resort that are not laid over the readings yet.
    pub reserve: Vec<(Candidate, Layout)>,
    pub(super) plain: Plain,
    /// Entries of the library that would not stand out however large they plausibly were.
    pub(super) unseen: Vec<bool>,
    pub(super) stop: Stop,
}

/// The most effects whose places and periods are looked at again whenever one is added.
pub(super) const MOST_SHARPENED: usize = 4;

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
        let folds = columns.fold_rows.len();
        let mut search = Search {
            columns,
            candidates,
            layouts,
            moments,
            prior,
            rank,
            taken: Vec::new(),
            of_fold: vec![Vec::new(); folds],
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
        let before = search.held_out_now();
        search.held_out.push(before);
        search
    }

    /// Whether a candidate is not to be taken up now.
    pub fn is_held_back(&self, candidate: usize) -> bool {
        let unseen = self.unseen.get(candidate).is_some_and(|unseen| *unseen);
        let candidate = &self.candidates[candidate];
        unseen || candidate.dictionary || candidate.last_resort && !self.last_resort
    }

    pub(super) fn all_folds(&self) -> Vec<usize> {
        (0..self.columns.fold_rows.len()).collect()
    }

    pub(super) fn places(&self, candidate: usize) -> std::ops::Range<usize> {
        self.materialised
            .iter()
            .find(|(c, _)| *c == candidate)
            .map_or(0..0, |(_, places)| places.clone())
    }

    pub(super) fn base_with(&self, candidates: &[usize]) -> Vec<usize> {
        (0..self.rank)
            .chain(candidates.iter().flat_map(|candidate| self.places(*candidate)))
            .collect()
    }

    /// The model with what has been taken, less one of it, on all readings.
    pub fn model_without(&self, left_out: Option<usize>) -> Trained<'_> {
        let chosen: Vec<usize> = self
            .taken
            .iter()
            .enumerate()
            .filter(|(k, _)| Some(*k) != left_out)
            .map(|(_, taken)| taken.candidate)
            .collect();
        Trained::new(
            &self.moments,
            &self.prior,
            self.base_with(&chosen),
            self.all_folds(),
        )
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
        if !self.stop.in_residual_variance {
            return 1.0;
        }
        let model = Trained::new(
            &self.moments,
            &self.prior,
            (0..self.rank).collect(),
            self.all_folds(),
        );
        self.variance(&model)
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
    pub fn composed(&self, model: &Trained<'_>) -> Vec<Composed> {
        let variance = self.variance(model);
        (0..self.candidates.len())
            .into_par_iter()
            .filter(|candidate| self.candidates[*candidate].dictionary)
            .filter_map(|candidate| {
                compose::composed(model, candidate, &self.candidates[candidate], variance)
            })
            .collect()
    }

    /// Adds what comes near the best, with the best numbers that it can have beside a model of some candidates.
    pub(super) fn sharpen(&mut self, beside: &[usize]) {
        let fresh = {
            let model = self.model_of(beside, &self.all_folds());
            sharpen::sharpened(self, &model, &self.composed(&model))
        };
        let fresh = fresh
            .into_iter()
            .filter_map(|candidate| Some((candidate.clone(), self.columns.layout(&candidate.effect)?)))
            .collect();
        self.append(fresh);
    }

    pub(super) fn append(&mut self, fresh: Vec<(Candidate, Layout)>) {
        if fresh.is_empty() {
            return;
        }
        let (candidates, layouts): (Vec<Candidate>, Vec<Layout>) = fresh.into_iter().unzip();
        self.candidates.extend(candidates);
        self.layouts.extend(layouts);
        self.moments.append(self.columns, &self.layouts);
    }

    /// Lays the candidates of last resort over the readings.
    pub fn bring_reserve(&mut self) {
        let reserve = std::mem::take(&mut self.reserve);
        self.append(reserve);
    }

    pub(super) fn model_of(&self, chosen: &[usize], folds: &[usize]) -> Trained<'_> {
        Trained::new(&self.moments, &self.prior, self.base_with(chosen), folds.to_vec())
    }

    /// Puts several effects that follow one axis down to one, where that one says as much in fewer words: what they explain together is compared, each
    /// effect being charged its cost and the number of entries of the library that it was chosen from. From three effects or places on, a free curve may
    /// be that one.
    pub fn merge(&mut self) {
        if self.stop.in_residual_variance {
            return;
        }
        let mut drivers: Vec<Driver> = Vec::new();
        for taken in &self.taken {
            let driver = &self.candidates[taken.candidate].effect.driver;
            if matches!(driver, Driver::Axis(_)) && !drivers.contains(driver) {
                drivers.push(driver.clone());
            }
        }
        let mut merged = false;
        for driver in drivers {
            let chosen: Vec<usize> = self.taken.iter().map(|taken| taken.candidate).collect();
            let whole = self.following(&driver, &chosen).0;
            let mut groups = vec![whole.clone()];
            if whole.len() > 2 {
                let without = |left_out: &usize| whole.iter().copied().filter(|c| c != left_out).collect();
                groups.extend(whole.iter().map(without));
            }
            merged |= groups.into_iter().any(|group| self.merge_group(&driver, &group));
        }
        if merged {
            let held_out = self.held_out_now();
            if let Some(last) = self.held_out.last_mut() {
                *last = held_out;
            }
        }
    }

    /// Puts a group of effects down to one, if one says as much in fewer words. Returns whether it did.
    fn merge_group(&mut self, driver: &Driver, group: &[usize]) -> bool {
        let columns: usize = group.iter().map(|c| self.moments.count[*c]).sum();
        let curves = group.len() > 2 || columns > 2 && self.is_composed(group);
        if group.len() < 2 && !curves {
            return false;
        }
        let chosen = self.taken.iter().map(|taken| taken.candidate);
        let rest: Vec<usize> = chosen.filter(|c| !group.contains(c)).collect();
        if group.len() > 1 {
            self.sharpen(&rest);
        }
        if curves {
            self.bring_reserve();
        }
        let pool: Vec<usize> = (0..self.candidates.len())
            .filter(|c| !self.is_held_back(*c) || curves && self.candidates[*c].last_resort)
            .filter(|c| !rest.contains(c))
            .collect();
        let Some(one) = self.in_fewer_words(group, &rest, &pool, &self.all_folds()) else {
            return false;
        };
        self.materialise(&[one]);
        let of_group = self.taken.iter().filter(|taken| group.contains(&taken.candidate));
        let p_value = of_group.map(|taken| taken.p_value).fold(1.0, f64::min);
        let places = self.places(one);
        self.taken.retain(|taken| !group.contains(&taken.candidate));
        self.taken.push(Taken {
            candidate: one,
            places,
            p_value,
        });
        for fold in self.all_folds() {
            let (group, rest) = self.following(driver, &self.of_fold[fold]);
            let others = self.others(fold);
            if !group.is_empty() && self.in_fewer_words(&group, &rest, &[one], &others).is_some() {
                self.of_fold[fold] = rest;
                self.of_fold[fold].push(one);
            }
        }
        true
    }

    pub(super) fn is_composed(&self, group: &[usize]) -> bool {
        let composed =
            |c: &usize| matches!(&self.candidates[*c].effect.shape, Shape::Steps { at } if at.len() > 2);
        group.iter().any(composed)
    }

    /// Enough for every effect that may be taken up, and some that were put down to one.
    pub fn most_rounds(&self) -> usize {
        self.stop.most.saturating_add(self.stop.most / 2).max(1)
    }

    /// Gives back effects that follow one axis where they are no explanation: where curves over that axis, another in every test and in no component's name,
    /// say as much in fewer words. One simple effect is asked only where structure remains beside it. Returns whether any were.
    pub fn disown(&mut self, structured: bool) -> bool {
        let chosen: Vec<usize> = self.taken.iter().map(|taken| taken.candidate).collect();
        let mut drivers: Vec<Driver> = Vec::new();
        for candidate in &chosen {
            let driver = &self.candidates[*candidate].effect.driver;
            if matches!(driver, Driver::Axis(_)) && !drivers.contains(driver) {
                drivers.push(driver.clone());
            }
        }
        let mut any = false;
        for driver in drivers {
            let chosen: Vec<usize> = self.taken.iter().map(|taken| taken.candidate).collect();
            let (group, rest) = self.following(&driver, &chosen);
            let curve = |c: &usize| matches!(self.candidates[*c].effect.shape, Shape::Curve { .. });
            let few = group.len() < 2 && !self.is_composed(&group) && !structured;
            if few || group.iter().all(curve) {
                continue;
            }
            let words = self.words_of(&group);
            let of_group = self.evidence_of(&group, &rest, &self.all_folds()) - words;
            for intervals in [8, 16, 32] {
                let layouts = self.columns.curves_of_tests(&driver, intervals);
                let first = self.candidates.len();
                let pattern = &self.candidates[group[0]];
                let nameless: Vec<(Candidate, Layout)> = layouts
                    .into_iter()
                    .map(|layout| {
                        let candidate = Candidate {
                            dictionary: true,
                            ..pattern.clone()
                        };
                        (candidate, layout)
                    })
                    .collect();
                if nameless.is_empty() {
                    continue;
                }
                self.append(nameless);
                let curves: Vec<usize> = (first..self.candidates.len()).collect();
                self.materialise(&curves);
                // One choice: the axis and how fine.
                let of_curves = self.evidence_of(&curves, &rest, &self.all_folds()) - self.choice();
                if of_curves > of_group {
                    self.taken.retain(|taken| !group.contains(&taken.candidate));
                    for fold in self.all_folds() {
                        self.of_fold[fold] = self.following(&driver, &self.of_fold[fold]).1;
                    }
                    any = true;
                    break;
                }
            }
        }
        if any {
            let held_out = self.held_out_now();
            self.held_out.truncate(self.taken.len());
            self.held_out.push(held_out);
        }
        any
    }

    /// What it costs to have chosen one entry of the library.
    pub(super) fn choice(&self) -> f64 {
        (self.unseen.iter().filter(|unseen| !**unseen).count().max(1) as f64).ln()
    }

    pub(super) fn words_of(&self, group: &[usize]) -> f64 {
        group
            .iter()
            .map(|c| self.candidates[*c].length() + self.choice())
            .sum()
    }

    /// `−ln P` of what candidates gain together.
    pub(super) fn evidence_of(&self, group: &[usize], rest: &[usize], folds: &[usize]) -> f64 {
        let lean = |chosen: &[usize]| {
            Trained::lean(&self.moments, &self.prior, self.base_with(chosen), folds.to_vec())
        };
        let without = lean(rest);
        let all: Vec<usize> = rest.iter().chain(group).copied().collect();
        let gain = Gain {
            gain: lean(&all).explained() - without.explained(),
            freedom: group
                .iter()
                .map(|c| self.moments.count[*c] + self.moments.numbers[*c])
                .sum(),
            visible: 1.0,
        };
        self.evidence(&gain, self.variance(&without))
    }

    /// Which of the chosen follow a driver, and which do not.
    fn following(&self, driver: &Driver, chosen: &[usize]) -> (Vec<usize>, Vec<usize>) {
        chosen
            .iter()
            .partition(|candidate| self.candidates[**candidate].effect.driver == *driver)
    }

    /// The one of a pool that says more than a group, if there is one.
    fn in_fewer_words(
        &self,
        group: &[usize],
        rest: &[usize],
        pool: &[usize],
        folds: &[usize],
    ) -> Option<usize> {
        let without = if pool.len() > 1 {
            self.model_of(rest, folds)
        } else {
            Trained::lean(&self.moments, &self.prior, self.base_with(rest), folds.to_vec())
        };
        let variance = self.variance(&without);
        let choice = self.choice();
        let of_group = self.evidence_of(group, rest, folds) - self.words_of(group);
        pool.par_iter()
            .filter(|c| !group.contains(c))
            .map(|c| (*c, self.score(*c, &without.gain(*c), variance) - choice))
            .filter(|(_, one)| *one > of_group)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(c, _)| c)
    }

    pub(super) fn best_of(&self, model: &Trained<'_>, taken: &[usize]) -> Option<(usize, f64)> {
        let variance = self.variance(model);
        let gains = model.gains();
        let mut best: Option<(usize, f64)> = None;
        for (candidate, gain) in gains.iter().enumerate() {
            if taken.contains(&candidate) || self.is_held_back(candidate) {
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
    pub(super) fn named_first(&self, model: &Trained<'_>, best: usize, taken: &[usize]) -> usize {
        let variance = self.variance(model);
        let of_best = model.gain(best);
        let least = self.evidence_for(best, &of_best, variance) - super::alias::INDISTINGUISHABLE;
        let mut first = best;
        let mut first_gain = of_best.clone();
        for (candidate, gain) in model.gains().iter().enumerate() {
            let passed_over = taken.contains(&candidate) || self.is_held_back(candidate);
            if passed_over || gain.freedom == 0 || self.evidence_for(candidate, gain, variance) < least {
                continue;
            }
            let length = self.candidates[candidate].length();
            let present = self.candidates[first].length();
            if length < present || (length == present && gain.gain > first_gain.gain * (1.0 + 1e-9)) {
                first = candidate;
                first_gain = gain.clone();
            }
        }
        first
    }

    /// One round.
    pub fn round(&mut self) -> Round {
        let taken: Vec<usize> = self.taken.iter().map(|t| t.candidate).collect();
        let (score, null) = {
            let model = self.model_without(None);
            let Some((_, score)) = self.best_of(&model, &taken) else {
                return Round::Done { p_value: 1.0 };
            };
            let score = self
                .composed(&model)
                .iter()
                .map(Composed::score)
                .fold(score, f64::max);
            let costs: Vec<f64> = (0..self.candidates.len())
                .map(|c| {
                    if self.is_held_back(c) {
                        f64::INFINITY
                    } else {
                        self.candidates[c].length()
                    }
                })
                .collect();
            (score, model.null_best(&costs, self.null_variance()))
        };
        let above = null.iter().filter(|best| **best >= score).count();
        let p_value = (above + 1) as f64 / (null.len() + 1) as f64;
        let mut sorted = null;
        sorted.sort_by(f64::total_cmp);
        let rank = ((1.0 - self.stop.significance) * sorted.len() as f64).ceil() as usize;
        let threshold = sorted
            .get(rank.min(sorted.len().saturating_sub(1)))
            .copied()
            .unwrap_or(0.0);
        self.thresholds.push(threshold);
        if p_value > self.stop.significance || self.taken.len() >= self.stop.most {
            return Round::Done { p_value };
        }
        self.sharpen(&taken);
        let candidate = {
            let model = self.model_without(None);
            let Some((best, _)) = self.best_of(&model, &taken) else {
                return Round::Done { p_value };
            };
            self.named_first(&model, best, &taken)
        };
        // Each fold searches for itself, by the same rule.
        let picks: Vec<Option<usize>> = self
            .all_folds()
            .into_iter()
            .map(|fold| {
                let model = self.model_of_fold(fold);
                self.best_of(&model, &self.of_fold[fold])
                    .filter(|(_, score)| *score >= threshold)
                    .map(|(best, _)| best)
            })
            .collect();
        let mut wanted: BTreeSet<usize> = picks.iter().flatten().copied().collect();
        wanted.insert(candidate);
        self.materialise(&wanted.into_iter().collect::<Vec<_>>());
        for (fold, pick) in picks.into_iter().enumerate() {
            self.of_fold[fold].extend(pick);
        }
        let places = self.places(candidate);
        self.taken.push(Taken {
            candidate,
            places,
            p_value,
        });
        let held_out = self.held_out_now();
        // For poses p-values say little; there an effect has to earn its place on the readings that were held out.
        if self.stop.in_residual_variance
            && held_out >= self.held_out.last().copied().unwrap_or(f64::INFINITY)
        {
            self.taken.pop();
            return Round::Done { p_value };
        }
        self.held_out.push(held_out);
        self.let_go(threshold);
        Round::Added { candidate }
    }

    /// Drops what the later effects have made superfluous.
    fn let_go(&mut self, threshold: f64) {
        while self.taken.len() > 1 {
            let mut weakest: Option<(usize, f64)> = None;
            for k in 0..self.taken.len() - 1 {
                let model = self.model_without(Some(k));
                let candidate = self.taken[k].candidate;
                let score = self.score(candidate, &model.gain(candidate), self.variance(&model));
                if weakest.is_none_or(|(_, least)| score < least) {
                    weakest = Some((k, score));
                }
            }
            match weakest {
                Some((k, score)) if score < threshold => {
                    self.taken.remove(k);
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
        let (before, old) = (&self.plain.base, self.plain.base.ncols());
        self.plain.base = Mat::from_fn(rows.nrows(), old + rows.ncols(), |i, j| {
            match j.checked_sub(old) {
                None => before[(i, j)],
                Some(k) if norms[k] > 0.0 => rows[(i, k)] / (norms[k] * self.plain.sigma_mm),
                Some(_) => 0.0,
            }
        });
        self.materialised.extend(fresh.into_iter().zip(places));
    }

    pub(super) fn others(&self, fold: usize) -> Vec<usize> {
        self.all_folds()
            .into_iter()
            .filter(|other| *other != fold)
            .collect()
    }

    /// The model that a fold's own search has built, trained on the other folds.
    pub fn model_of_fold(&self, fold: usize) -> Trained<'_> {
        let others = self.others(fold);
        let base = self.base_with(&self.of_fold[fold]);
        Trained::new(&self.moments, &self.prior, base, others)
    }

    /// The same, for its coefficients alone.
    fn lean_model_of_fold(&self, fold: usize) -> Trained<'_> {
        let base = self.base_with(&self.of_fold[fold]);
        Trained::lean(&self.moments, &self.prior, base, self.others(fold))
    }

    pub(super) fn held_out_now(&self) -> f64 {
        let models: Vec<Trained<'_>> = self
            .all_folds()
            .into_par_iter()
            .map(|fold| self.lean_model_of_fold(fold))
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

    /// What any effect would gain beside a model on all readings; `None` where the data lack what it follows.
    pub fn gain_beside(&self, model: &Trained<'_>, effect: &abbe_model::effect::Effect) -> Option<f64> {
        let layout = self.columns.layout_uncached(effect)?;
        Some(self.moments.gain_of(self.columns, &layout, model))
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
