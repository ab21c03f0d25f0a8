//! Aliases of a found effect: other effects that explain the residual equally well.
//!
//! Two candidates are aliases if the readings do not separate them. The alias replaces the found effect in the same model.
//! Either its evidence is then at most 2 lower, or χ² is at most 4 higher: 2 in the log-likelihood. Every tuned number of
//! the alias that the found effect does not have has to lower χ² by 4. Selected positions count with their penalty if the
//! found effect has positions too. The alias also reproduces at least half of the found effect's signature in the readings.
//! The search reports the candidate with the shortest description. The others are listed, the most probable first: by
//! likelihood and by mechanical plausibility (`plausible.rs`).

use std::cmp::Ordering;
use std::collections::HashSet;

use abbe_model::Diagnostic;
use abbe_model::effect::Shape;

use super::constants::{INDISTINGUISHABLE, MAX_COMPETING, MIN_COSINE, SAME_READINGS};
use super::plausible::prior_cost;
use super::state::{ALL, SearchState};
use crate::candidates::gain::{Gain, TrainedModel};

/// An alias of a selected effect.
#[derive(Clone, Debug)]
pub(super) struct Alias {
    /// Index of the candidate.
    pub candidate: usize,
    /// Cosine of the angle between the found effect's signature and the column space of the alias, after projection on
    /// the model.
    pub cosine: f64,
    /// Increase of χ² if the alias replaces the effect.
    pub delta_chi2: f64,
    /// Its prior cost less that of the found effect ([`super::plausible`]).
    pub prior_cost: f64,
    /// The candidate of which it is a variant: another shape of the same component over the same driver, whose fitted
    /// readings are the same. `None` for an explanation of its own.
    pub variant_of: Option<usize>,
}

impl Alias {
    /// `ln` of its probability over that of the found effect, by likelihood and mechanical plausibility.
    pub fn ln_probability_ratio(&self) -> f64 {
        -0.5 * self.delta_chi2 - self.prior_cost
    }
}

/// A candidate that competes with a found effect.
#[derive(Clone, Debug, PartialEq)]
pub struct CompetingEffect {
    /// Its identifier. One candidate represents all candidates with this identifier.
    pub id: String,
    /// `−ln P` of its gain in place of the found effect, less its selection penalty.
    pub evidence: f64,
    /// Whether it is the found effect itself.
    pub named: bool,
    /// Whether it is confounded with the found effect.
    pub alias: bool,
}

/// Decimals of a cosine in an order.
const DECIMALS_OF_COSINE: i32 = 6;
/// Decimals of a logarithm of a probability in an order: it is as large as 10⁵, and basis functions are in single precision.
const DECIMALS_OF_LN: i32 = 2;

/// Rounds to some decimals. Lists are sorted by this value, so that rounding errors decide no tie.
fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10.0_f64.powi(decimals);
    (value * scale).round() / scale
}

/// The order of two equally good candidates: by description length, then by identifier, then by index.
fn simplest_first(search: &SearchState<'_>, a: usize, b: usize) -> Ordering {
    let [first, second] = [a, b].map(|candidate| &search.candidates[candidate]);
    first
        .description_length()
        .total_cmp(&second.description_length())
        .then_with(|| first.effect.id().cmp(&second.effect.id()))
        .then(a.cmp(&b))
}

/// The competing explanations of the `k`-th selected effect, best first: that effect, its aliases, and rejected
/// candidates.
fn competing_effects(
    search: &SearchState<'_>,
    k: usize,
    gains: &[Gain],
    variance: f64,
    aliases: &[Alias],
) -> Vec<CompetingEffect> {
    let selected = search.selected()[k].candidate;
    let named = search.effect(selected).id();
    let alias_ids: HashSet<String> = aliases.iter().map(|alias| search.effect(alias.candidate).id()).collect();
    let others: Vec<usize> = search.selected().iter().map(|t| t.candidate).collect();
    let mut ranked: Vec<(f64, usize)> = gains
        .iter()
        .enumerate()
        .filter(|(candidate, gain)| {
            gain.freedom > 0
                && (*candidate == selected || !others.contains(candidate))
                && !search.candidates[*candidate].last_resort
                && search.may_be_added(*candidate, &search.selection.branches[ALL].folds)
        })
        .map(|(candidate, gain)| {
            let evidence = search.evidence_for(candidate, gain, variance);
            (rounded(evidence, DECIMALS_OF_LN), candidate)
        })
        .collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| simplest_first(search, a.1, b.1)));
    let mut competing_effects: Vec<CompetingEffect> = Vec::new();
    for (evidence, candidate) in ranked {
        let id = search.effect(candidate).id();
        if competing_effects.iter().any(|rival| rival.id == id) {
            continue;
        }
        if competing_effects.len() == MAX_COMPETING {
            break;
        }
        competing_effects.push(CompetingEffect { named: id == named, alias: alias_ids.contains(&id), id, evidence });
    }
    competing_effects
}

/// The aliases of the `k`-th selected effect, the most probable first, and its competing explanations. `model` is the model
/// without that effect.
pub(super) fn aliases(
    search: &SearchState<'_>,
    k: usize,
    model: &TrainedModel<'_>,
    variance: f64,
) -> Result<(Vec<Alias>, Vec<CompetingEffect>), Diagnostic> {
    let selected = &search.selected()[k];
    let of_named = model.gain(selected.candidate)?;
    let least = search.evidence_for(selected.candidate, &of_named, variance) - INDISTINGUISHABLE;
    let least_unpriced = search.evidence(&of_named, variance) - INDISTINGUISHABLE;
    // A staircase that the found effect approximates in a shorter description is an alias without its penalty.
    let has_positions = search.candidates[selected.candidate].selection_penalty > 0.0;
    let numbers = |candidate: usize| search.gram.numbers(candidate);
    let least_gain = |candidate: usize| {
        let more = numbers(candidate).saturating_sub(numbers(selected.candidate)) as f64;
        of_named.gain / variance + 2.0 * INDISTINGUISHABLE * (more - 1.0)
    };
    let columns = |candidate: usize| search.gram.count(candidate);
    // A harmonic has two columns because its phase is estimated. It still counts as an alias of an effect with one
    // column.
    let no_more_said = |candidate: usize| {
        columns(candidate) <= columns(selected.candidate)
            || matches!(search.effect(candidate).shape, Shape::Harmonic { .. })
    };
    let (_, signature) = model.with_candidate(selected.candidate)?;
    let others: Vec<usize> = search.selected().iter().map(|t| t.candidate).collect();
    let gains = search.gains(model)?;
    let near: Vec<(usize, f64)> = gains
        .iter()
        .enumerate()
        .filter(|(candidate, gain)| {
            !others.contains(candidate)
                && !search.candidates[*candidate].last_resort
                && search.may_be_added(*candidate, &model.folds)
                && gain.freedom > 0
                && !search.is_beyond_library(search.effect(*candidate))
                && (search.evidence_for(*candidate, gain, variance) >= least
                    || !has_positions && search.evidence(gain, variance) >= least_unpriced
                    || no_more_said(*candidate) && gain.gain / variance >= least_gain(*candidate))
        })
        .map(|(candidate, gain)| (candidate, gain.gain))
        .collect();
    // The costs of the search, and a tuned number counts as much as in the comparison above.
    let cost = |candidate: usize| {
        let description = search.candidates[candidate].cost + INDISTINGUISHABLE * numbers(candidate) as f64;
        prior_cost(search.effect(candidate)) + description
    };
    let mut aliases: Vec<Alias> = Vec::new();
    for (candidate, gain) in near {
        let cosine = model.explained_by_signature(candidate, selected.candidate, &signature)?.sqrt();
        if cosine >= MIN_COSINE {
            let delta_chi2 = (of_named.gain - gain) / variance;
            let prior_cost = cost(candidate) - cost(selected.candidate);
            aliases.push(Alias { candidate, cosine, delta_chi2, prior_cost, variant_of: None });
        }
    }
    aliases.sort_by(|a, b| {
        rounded(b.ln_probability_ratio(), DECIMALS_OF_LN)
            .total_cmp(&rounded(a.ln_probability_ratio(), DECIMALS_OF_LN))
            .then_with(|| rounded(b.cosine, DECIMALS_OF_COSINE).total_cmp(&rounded(a.cosine, DECIMALS_OF_COSINE)))
            .then_with(|| simplest_first(search, a.candidate, b.candidate))
    });
    // The most probable candidate represents all candidates with its identifier. Candidates with the found effect's own
    // identifier are excluded.
    let named = search.effect(selected.candidate).id();
    let mut ids = HashSet::from([named]);
    aliases.retain(|alias| ids.insert(search.effect(alias.candidate).id()));
    mark_variants(search, selected.candidate, model, variance, &mut aliases)?;
    let competing_effects = competing_effects(search, k, &gains, variance, &aliases);
    Ok((aliases, competing_effects))
}

/// Marks the aliases that are variants of the found effect, or of an alias before them. Of one explanation the simplest
/// shape has the name.
fn mark_variants(
    search: &SearchState<'_>,
    found: usize,
    model: &TrainedModel<'_>,
    variance: f64,
    aliases: &mut [Alias],
) -> Result<(), Diagnostic> {
    let same = SAME_READINGS.powi(2) * variance * search.columns.rows() as f64;
    let is_variant = |one: usize, other: usize| -> Result<bool, Diagnostic> {
        let [a, b] = [one, other].map(|candidate| search.effect(candidate));
        let alike = a.component == b.component && a.driver == b.driver && a.tests == b.tests;
        Ok(alike && model.difference_square([one, other])? < same)
    };
    let mut order: Vec<usize> = (0..aliases.len()).collect();
    order.sort_by_key(|place| {
        let own = aliases[*place].candidate;
        (search.gram.numbers(own), matches!(search.effect(own).shape, Shape::Precession(_)))
    });
    let mut heads = vec![found];
    for place in order {
        let own = aliases[place].candidate;
        for head in &heads {
            if is_variant(own, *head)? {
                aliases[place].variant_of = Some(*head);
                break;
            }
        }
        if aliases[place].variant_of.is_none() {
            heads.push(own);
        }
    }
    Ok(())
}
