//! What a search that only adds would miss: an effect that took the place of another, and a pair that hid behind one.
//!
//! Each effect is exchanged for what explains clearly better beside the others. When nothing more is to be added, effects with numbers or places of
//! their own are fitted anew beside each of the next best: steps with many places, or a warm-up with its own time constant, can swallow most of a second
//! effect, which shows only when both are there.

use std::collections::HashSet;

use abbe_model::effect::Shape;

use super::alias::INDISTINGUISHABLE;
use super::compose;
use super::library::Candidate;
use super::score::Trained;
use super::search::{MOST_SHARPENED, Search, Taken};
use super::sharpen;

/// How many are tried beside an effect that is fitted anew.
const MOST_TRIED: usize = 6;
/// The most effects that are fitted anew beside others.
const MOST_ANEW: usize = 3;
/// Relative difference of scores below which two candidates do the same.
const SAME: f64 = 1e-6;

impl Search<'_> {
    /// Exchanges effects for candidates that explain clearly better what they stand for, in the search on all readings and in that of each fold.
    pub fn exchange(&mut self) {
        if (2..=MOST_SHARPENED).contains(&self.taken.len()) && !self.stop.in_residual_variance {
            let chosen: Vec<usize> = self.taken.iter().map(|taken| taken.candidate).collect();
            for k in 0..chosen.len() {
                let mut others = chosen.clone();
                others.remove(k);
                self.sharpen(&others);
            }
        }
        let mut of_all: Vec<usize> = self.taken.iter().map(|taken| taken.candidate).collect();
        self.exchange_in(&mut of_all, &self.all_folds(), None);
        for (k, candidate) in of_all.into_iter().enumerate() {
            if self.taken[k].candidate != candidate {
                let places = self.places(candidate);
                self.taken[k] = Taken {
                    candidate,
                    places,
                    p_value: self.taken[k].p_value,
                };
            }
        }
        // Along runs, what any of the searches has taken up before is enough to choose from.
        let known: Vec<usize> = self
            .materialised
            .iter()
            .map(|(candidate, _)| *candidate)
            .collect();
        let pool = (!self.stop.in_residual_variance).then_some(known.as_slice());
        for fold in self.all_folds() {
            let mut chosen = std::mem::take(&mut self.of_fold[fold]);
            self.exchange_in(&mut chosen, &self.others(fold), pool);
            self.of_fold[fold] = chosen;
        }
        let held_out = self.held_out_now();
        if let Some(last) = self.held_out.last_mut() {
            *last = held_out;
        }
    }

    /// One sweep of exchanges over what a search on some of the folds has chosen. A change has to be worth more than what cannot be told apart, so
    /// that the sweeps end.
    fn exchange_in(&mut self, chosen: &mut [usize], folds: &[usize], pool: Option<&[usize]>) {
        for k in 0..chosen.len() {
            let others: Vec<usize> = chosen
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != k)
                .map(|(_, candidate)| *candidate)
                .collect();
            let better = {
                let base = self.base_with(&others);
                let model = match pool {
                    None => Trained::new(&self.moments, &self.prior, base, folds.to_vec()),
                    Some(_) => Trained::lean(&self.moments, &self.prior, base, folds.to_vec()),
                };
                let variance = self.variance(&model);
                let score = self.score(chosen[k], &model.gain(chosen[k]), variance);
                let clearly = |(best, most): &(usize, f64)| {
                    *best != chosen[k] && *most > score + super::alias::INDISTINGUISHABLE
                };
                match pool {
                    None => self
                        .best_of(&model, &others)
                        .filter(clearly)
                        .map(|(best, _)| self.named_first(&model, best, &others)),
                    Some(pool) => pool
                        .iter()
                        .filter(|c| !others.contains(c))
                        .map(|c| (*c, self.score(*c, &model.gain(*c), variance)))
                        .max_by(|a, b| a.1.total_cmp(&b.1))
                        .filter(clearly)
                        .map(|(best, _)| best),
                }
            };
            let Some(better) = better.filter(|better| *better != chosen[k]) else {
                continue;
            };
            self.materialise(&[better]);
            chosen[k] = better;
        }
    }

    /// Fits effects with numbers or places of their own anew beside each of the next best, in addition to the others or in the place of one, and takes the
    /// best of these sets if it says clearly more than the present one. Returns whether it did.
    pub fn retune(&mut self) -> bool {
        let chosen: Vec<usize> = self.taken.iter().map(|taken| taken.candidate).collect();
        if self.stop.in_residual_variance || !(1..=MOST_ANEW).contains(&chosen.len()) {
            return false;
        }
        let folds = self.all_folds();
        let threshold = self.thresholds.last().copied().unwrap_or(f64::INFINITY);
        let mut most = self.evidence_of(&chosen, &[], &folds) - self.words_of(&chosen) + INDISTINGUISHABLE;
        let mut best: Option<Vec<usize>> = None;
        let flexible: Vec<usize> = chosen.iter().copied().filter(|c| self.is_flexible(*c)).collect();
        for flexible in flexible {
            let given_up = chosen.iter().copied().filter(|c| *c != flexible).map(Some);
            for given_up in given_up.chain([None]) {
                let kept = |c: &&usize| **c != flexible && Some(**c) != given_up;
                let base: Vec<usize> = chosen.iter().filter(kept).copied().collect();
                if given_up.is_none() && chosen.len() >= self.stop.most {
                    continue;
                }
                let tried = self.next_best(&base, &[flexible]);
                self.materialise(&tried);
                for other in tried {
                    let beside: Vec<usize> = base.iter().copied().chain([other]).collect();
                    let Some(anew) = self.anew(flexible, &beside) else {
                        continue;
                    };
                    self.materialise(&[anew]);
                    let set: Vec<usize> = beside.iter().copied().chain([anew]).collect();
                    let value = self.evidence_of(&set, &[], &folds) - self.words_of(&set);
                    if value <= most {
                        continue;
                    }
                    // What is added has to hold its own against readings without structure.
                    let without: Vec<usize> = base.iter().copied().chain([anew]).collect();
                    let model = Trained::lean(
                        &self.moments,
                        &self.prior,
                        self.base_with(&without),
                        folds.clone(),
                    );
                    if self.score(other, &model.gain(other), self.variance(&model)) < threshold {
                        continue;
                    }
                    most = value;
                    best = Some(set);
                }
            }
        }
        let Some(set) = best else { return false };
        let p_value = self.taken.iter().map(|taken| taken.p_value).fold(0.0, f64::max);
        self.taken = set
            .iter()
            .map(|candidate| Taken {
                candidate: *candidate,
                places: self.places(*candidate),
                p_value,
            })
            .collect();
        for fold in folds {
            self.of_fold[fold] = self.better_on_others(fold, &set);
        }
        let held_out = self.held_out_now();
        self.held_out.truncate(self.taken.len());
        self.held_out.resize(self.taken.len() + 1, held_out);
        true
    }

    /// A set for a fold, if it says more on the other folds than what the fold's own search has chosen; else that.
    fn better_on_others(&self, fold: usize, set: &[usize]) -> Vec<usize> {
        let others = self.others(fold);
        let value = |set: &[usize]| self.evidence_of(set, &[], &others) - self.words_of(set);
        let own = &self.of_fold[fold];
        if value(set) > value(own) {
            set.to_vec()
        } else {
            own.clone()
        }
    }

    fn is_flexible(&self, candidate: usize) -> bool {
        self.moments.numbers[candidate] > 0 || self.has_places(candidate)
    }

    fn has_places(&self, candidate: usize) -> bool {
        matches!(self.candidates[candidate].effect.shape, Shape::Steps { .. })
    }

    /// The best beside some effects, each component, driver and shape once, and what does the very same to the readings once.
    fn next_best(&self, base: &[usize], but: &[usize]) -> Vec<usize> {
        let model = self.model_of(base, &self.all_folds());
        let variance = self.variance(&model);
        let gains = model.gains();
        let mut scored: Vec<(usize, f64)> = (0..self.candidates.len())
            .filter(|c| !self.is_held_back(*c) && !base.contains(c))
            .map(|c| (c, self.score(c, &gains[c], variance)))
            .filter(|(_, score)| *score > 0.0)
            .collect();
        scored.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut seen: HashSet<String> = but.iter().map(|c| self.candidates[*c].effect.id()).collect();
        scored.retain(|(c, _)| seen.insert(self.candidates[*c].effect.id()));
        scored.dedup_by(|a, b| {
            (a.1 - b.1).abs() < SAME * b.1.abs() && gains[a.0].freedom == gains[b.0].freedom
        });
        scored.into_iter().take(MOST_TRIED).map(|(c, _)| c).collect()
    }

    /// An effect with the numbers or places that are best beside others.
    fn anew(&mut self, flexible: usize, beside: &[usize]) -> Option<usize> {
        let fresh: Candidate = {
            let model = Trained::lean(
                &self.moments,
                &self.prior,
                self.base_with(beside),
                self.all_folds(),
            );
            let original = &self.candidates[flexible];
            if self.has_places(flexible) {
                let id = original.effect.id();
                let dictionary = self.candidates.iter().position(|candidate| {
                    candidate.dictionary
                        && candidate.effect.id() == id
                        && matches!(candidate.effect.shape, Shape::Steps { .. })
                })?;
                let variance = self.variance(&model);
                compose::composed(&model, dictionary, &self.candidates[dictionary], variance)?.candidate
            } else {
                let before = model.gain(flexible).gain;
                match sharpen::sharpen(self, &model, original, before) {
                    Some(effect) => Candidate {
                        effect,
                        ..original.clone()
                    },
                    None => return Some(flexible),
                }
            }
        };
        let layout = self.columns.layout(&fresh.effect)?;
        self.append(vec![(fresh, layout)]);
        Some(self.candidates.len() - 1)
    }
}
