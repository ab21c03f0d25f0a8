//! Tunes shapes with numbers (a period, a time constant, a centre, a width) off the grid of the library.
//!
//! Candidates are tuned before they are compared. On the grid, a wrong component may have a larger gain than the true
//! one, which gains more at its own optimum. Every component near the best is therefore tuned first.

use std::collections::HashMap;
use std::ops::Range;

use abbe_model::effect::shape::Steps;
use abbe_model::effect::{Effect, Shape};

use super::compose::StepTable;
use super::search::Search;
use crate::candidates::gain::{Gain, TrainedModel};
use crate::candidates::library::Candidate;
use crate::numerics::parallel;

/// Iterations of a line search, each reducing the interval to 0.62: on all readings, and with one fold left out.
const STEPS: usize = 12;
const STEPS_WITHOUT_A_FOLD: usize = 6;
/// Share of the best evidence that a candidate needs on the grid to be tuned. A local feature between two grid points
/// loses a third of its evidence.
const MIN_EVIDENCE_SHARE: f64 = 0.5;
/// Maximum number of candidates that are tuned at a time: on all readings, and with one fold left out.
const MAX_TUNED: usize = 10;
const MAX_WITHOUT_A_FOLD: usize = 2;
/// Evidence by which a step table may fall short of the best and still be reported as an alternative.
const MAX_EVIDENCE_DEFICIT: f64 = 4.0;

/// Whether a candidate has shape numbers or positions that can be tuned off the library's grid.
pub(super) fn can_be_tuned(candidate: &Candidate) -> bool {
    candidate.dictionary || !brackets(candidate).is_empty()
}

/// The candidates near the best, each with its best shape numbers for addition to a model, and the step tables near the
/// best. `gains` are those of all candidates added to the model.
pub fn refined(
    search: &Search<'_>,
    model: &TrainedModel<'_>,
    gains: &[Gain],
    composed: &[StepTable],
) -> Vec<Candidate> {
    let variance = search.variance(model);
    let most = if search.has_all_folds(&model.folds) { MAX_TUNED } else { MAX_WITHOUT_A_FOLD };
    let mut nearest: HashMap<String, (usize, f64)> = HashMap::new();
    let mut best = 0.0_f64;
    for (candidate, gain) in gains.iter().enumerate() {
        if gain.freedom == 0 || !search.may_be_added(candidate, &model.folds) {
            continue;
        }
        let evidence = search.evidence(gain, variance);
        best = best.max(evidence);
        let effect = &search.candidates[candidate].effect;
        if brackets(&search.candidates[candidate]).is_empty() {
            continue;
        }
        let best_of_id = nearest.entry(effect.id()).or_insert((candidate, evidence));
        if evidence > best_of_id.1 {
            *best_of_id = (candidate, evidence);
        }
    }
    let mut near: Vec<(usize, f64)> =
        nearest.into_values().filter(|(_, evidence)| *evidence >= MIN_EVIDENCE_SHARE * best).collect();
    near.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    near.truncate(most);
    let refined = parallel::map(near.len(), &|k| {
        let candidate = near[k].0;
        let original = &search.candidates[candidate];
        let effect = refine(search, model, original, gains[candidate].gain)?;
        Some(Candidate { effect, ..original.clone() })
    });
    let mut fresh: Vec<Candidate> = refined.into_iter().flatten().collect();
    fresh.extend(moved(search, model, composed, best, most));
    fresh.retain(|candidate| {
        let is_same = |present: usize| {
            search.candidates[present].effect == candidate.effect && search.may_be_used(present, &model.folds)
        };
        !(0..search.candidates.len()).any(is_same)
    });
    fresh
}

/// The step tables near the best evidence, with their positions tuned.
fn moved(
    search: &Search<'_>,
    model: &TrainedModel<'_>,
    composed: &[StepTable],
    best: f64,
    most: usize,
) -> Vec<Candidate> {
    let variance = search.variance(model);
    let mut nearest: Vec<&StepTable> = composed.iter().filter(|c| c.evidence >= MIN_EVIDENCE_SHARE * best).collect();
    nearest.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    nearest.truncate(most);
    let moved = parallel::map(nearest.len(), &|k| {
        let composed = nearest[k];
        let (effect, gain) = moved_steps(search, model, &composed.candidate);
        let gain = Gain { gain, freedom: effect.shape.coefficients() + effect.shape.numbers() };
        let evidence = search.evidence(&gain, variance);
        let near =
            evidence >= best - MAX_EVIDENCE_DEFICIT || evidence - composed.candidate.cost >= MIN_EVIDENCE_SHARE * best;
        near.then(|| Candidate { effect, ..composed.candidate.clone() })
    });
    moved.into_iter().flatten().collect()
}

/// Tunes the shape numbers of an effect for the largest gain. `None` if the gain does not increase.
pub(super) fn refine(
    search: &Search<'_>,
    model: &TrainedModel<'_>,
    original: &Candidate,
    before: f64,
) -> Option<Effect> {
    let mut effect = original.effect.clone();
    let brackets = brackets(original);
    let mut best = before;
    let steps = if search.has_all_folds(&model.folds) { STEPS } else { STEPS_WITHOUT_A_FOLD };
    // The numbers of one shape are tuned in turn.
    for _ in 0..brackets.len() {
        for (which, [low, high]) in brackets.iter().enumerate() {
            let value_at = |share: f64| low + (high - low) * share;
            let gain_at = |share: f64| {
                let tuned = Effect { shape: effect.shape.with_number(which, value_at(share)), ..effect.clone() };
                (search.gain_beside(model, &tuned).unwrap_or(0.0), tuned)
            };
            let (gain, tuned) = highest(gain_at, steps);
            if gain > best {
                best = gain;
                effect = tuned;
            }
        }
    }
    (best > before * (1.0 + 1e-6)).then_some(effect)
}

/// The maximum of a line search between 0 and 1, and its argument, by golden section (Kiefer, Proc. Am. Math. Soc. 4
/// (1953) 502).
fn highest<T>(value_at: impl Fn(f64) -> (f64, T), steps: usize) -> (f64, T) {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut a, mut b) = (0.0, 1.0);
    let (mut c, mut d) = (b - golden * (b - a), a + golden * (b - a));
    let (mut at_c, mut at_d) = (value_at(c), value_at(d));
    for _ in 0..steps {
        if at_c.0 > at_d.0 {
            (b, d) = (d, c);
            at_d = at_c;
            c = b - golden * (b - a);
            at_c = value_at(c);
        } else {
            (a, c) = (c, d);
            at_c = at_d;
            d = a + golden * (b - a);
            at_d = value_at(d);
        }
    }
    if at_c.0 > at_d.0 { at_c } else { at_d }
}

/// Moves each step position by fractions of the grid for the largest joint gain. Returns the effect and its gain.
fn moved_steps(search: &Search<'_>, model: &TrainedModel<'_>, candidate: &Candidate) -> (Effect, f64) {
    let original = &candidate.effect;
    let (Shape::Steps(Steps { at }), Some(mut present)) = (&original.shape, search.tuned_effect(model, original))
    else {
        return (original.clone(), 0.0);
    };
    let mut best = present.gain(model);
    let mut positions = at.clone();
    let with = |positions: &[f64]| Effect { shape: Shape::Steps(Steps { at: positions.to_vec() }), ..original.clone() };
    let trained: Vec<Range<usize>> = (model.folds.iter()).map(|fold| search.columns.fold_rows[*fold].clone()).collect();
    for _ in 0..2 {
        for k in 0..positions.len() {
            let middle = positions[k];
            for part in -3..=3 {
                let position = middle + candidate.grid * f64::from(part) / 4.0;
                let Some(moved) = search.tuned_effect(model, &with(&[position])) else {
                    continue;
                };
                let gain = present.gain_with(k, &moved, &trained, model);
                if gain > best * (1.0 + 1e-9) {
                    best = gain;
                    positions[k] = position;
                    present.exchange(k, &moved, &trained);
                }
            }
        }
    }
    positions.sort_by(f64::total_cmp);
    (with(&positions), best)
}

/// The interval between its neighbours on the grid, for each shape number that can be tuned.
fn brackets(candidate: &Candidate) -> Vec<[f64; 2]> {
    candidate.effect.shape.brackets(candidate.grid)
}
