//! What else would look the same.
//!
//! Two candidates are aliases where the readings cannot tell them apart: in place of the named effect, beside the same model, the other explains
//! the residual as well within 2 of log-likelihood, whether or not the numbers and places that were chosen in its shape are held against it, and it does
//! at least half of what the named effect did to the readings. The search names the one that is the shortest to say; the others are told, nearest first.

use std::cmp::Ordering;
use std::collections::HashSet;

use abbe_model::effect::Shape;

use super::score::{Gain, TrainedModel};
use super::search::{ALL, Search};

/// Difference in `−ln P` below which two candidates are confounded: 2 σ for one column.
pub(super) const INDISTINGUISHABLE: f64 = 2.0;
/// Least cosine between the named effect's signature and what an alias can do: at least half of it. What is nearer than the evidence can tell is an
/// alias however small the angle; what explains as much of something else is none.
const MIN_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// An alias of a taken effect.
#[derive(Clone, Debug)]
pub(super) struct Alias {
    /// Its candidate.
    pub candidate: usize,
    /// Cosine of the angle between the named effect's signature and what the alias can do, beside the model.
    pub cosine: f64,
    /// Coefficients of the model's base columns if the alias stands in the effect's place.
    pub model_coefficients: Vec<f64>,
}

/// A candidate in a named effect's place.
#[derive(Clone, Debug, PartialEq)]
pub struct CompetingEffect {
    /// Its identifier; one member stands for all of a name.
    pub id: String,
    /// `−ln P` of its gain in that place, less the price of its places.
    pub evidence: f64,
    /// Whether it is the named effect itself.
    pub named: bool,
    /// Whether the readings cannot tell it from the named effect.
    pub alias: bool,
}

/// How many rivals are kept.
const MAX_COMPETING: usize = 16;

/// To six decimals: lists are in the order of these, so that rounding decides no tie.
fn to_six_decimals(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// The order of two candidates that are equally good: by what they cost, then by name, then by their place in the library.
fn simplest_first(search: &Search<'_>, a: usize, b: usize) -> Ordering {
    let [first, second] = [a, b].map(|candidate| &search.candidates[candidate]);
    first
        .length()
        .total_cmp(&second.length())
        .then_with(|| first.effect.id().cmp(&second.effect.id()))
        .then(a.cmp(&b))
}

/// What stands highest in the place of the `k`-th taken effect, the best first: that effect, its aliases, and what loses.
fn competing_effects(
    search: &Search<'_>,
    k: usize,
    gains: &[Gain],
    variance: f64,
    aliases: &[Alias],
) -> Vec<CompetingEffect> {
    let taken = search.taken()[k].candidate;
    let named = search.candidates[taken].effect.id();
    let alike: HashSet<String> = aliases
        .iter()
        .map(|alias| search.candidates[alias.candidate].effect.id())
        .collect();
    let others: Vec<usize> = search.taken().iter().map(|t| t.candidate).collect();
    let mut standing: Vec<(f64, usize)> = gains
        .iter()
        .enumerate()
        .filter(|(candidate, gain)| {
            gain.freedom > 0
                && (*candidate == taken || !others.contains(candidate))
                && !search.candidates[*candidate].last_resort
                && search.is_open(*candidate, &search.tracks[ALL].folds)
        })
        .map(|(candidate, gain)| {
            let evidence = search.evidence_for(candidate, gain, variance);
            (to_six_decimals(evidence), candidate)
        })
        .collect();
    standing.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| simplest_first(search, a.1, b.1)));
    let mut competing_effects: Vec<CompetingEffect> = Vec::new();
    for (evidence, candidate) in standing {
        let id = search.candidates[candidate].effect.id();
        if competing_effects.iter().any(|rival| rival.id == id) {
            continue;
        }
        if competing_effects.len() == MAX_COMPETING {
            break;
        }
        competing_effects.push(CompetingEffect {
            named: id == named,
            alias: alike.contains(&id),
            id,
            evidence,
        });
    }
    competing_effects
}

/// The aliases of the `k`-th taken effect, nearest first, and what stands highest in its place, beside the model without it.
pub(super) fn aliases(
    search: &Search<'_>,
    k: usize,
    model: &TrainedModel<'_>,
    variance: f64,
) -> (Vec<Alias>, Vec<CompetingEffect>) {
    let taken = &search.taken()[k];
    let of_named = model.gain(taken.candidate);
    let least = search.evidence_for(taken.candidate, &of_named, variance) - INDISTINGUISHABLE;
    let least_unpriced = search.evidence(&of_named, variance) - INDISTINGUISHABLE;
    let least_gain = of_named.gain / variance - 2.0 * INDISTINGUISHABLE;
    let columns = |candidate: usize| search.moments.count[candidate];
    // A wave has two columns because its phase is unknown: one that looks the same is no less alike for that.
    let no_more_said = |candidate: usize| {
        columns(candidate) <= columns(taken.candidate)
            || matches!(search.candidates[candidate].effect.shape, Shape::Harmonic { .. })
    };
    let (_, coefficients) = model.joined(taken.candidate);
    // Base columns are unit-length copies of the candidate's own; the signature is what they do together.
    let norms = search.norms(taken.candidate);
    let signature: Vec<(usize, f64)> = search
        .places(taken.candidate)
        .zip(coefficients.iter().zip(&norms).map(|(c, norm)| c * norm))
        .collect();
    let others: Vec<usize> = search.taken().iter().map(|t| t.candidate).collect();
    let gains = model.gains();
    let mut aliases: Vec<Alias> = gains
        .iter()
        .enumerate()
        .filter(|(candidate, gain)| {
            !others.contains(candidate)
                && !search.candidates[*candidate].last_resort
                && search.is_open(*candidate, &model.folds)
                && gain.freedom > 0
                && (search.evidence_for(*candidate, gain, variance) >= least
                    || search.evidence(gain, variance) >= least_unpriced
                    || no_more_said(*candidate) && gain.gain / variance >= least_gain)
        })
        .filter_map(|(candidate, _)| {
            let cosine = model.explained_by_signature(candidate, &signature).sqrt();
            (cosine >= MIN_COSINE).then(|| Alias {
                candidate,
                cosine,
                model_coefficients: model.joined(candidate).0,
            })
        })
        .collect();
    aliases.sort_by(|a, b| {
        to_six_decimals(b.cosine)
            .total_cmp(&to_six_decimals(a.cosine))
            .then_with(|| simplest_first(search, a.candidate, b.candidate))
    });
    // Of one name the nearest member stands for all; those that bear the winner's own name are the winner.
    let named = search.candidates[taken.candidate].effect.id();
    let mut seen = HashSet::from([named]);
    aliases.retain(|alias| seen.insert(search.candidates[alias.candidate].effect.id()));
    let competing_effects = competing_effects(search, k, &gains, variance, &aliases);
    (aliases, competing_effects)
}
