//! The found effects judged: everything refitted together, and what that leaves.

use abbe_model::effect::Effect;

use super::columns::Columns;
use super::remainder::{self, Structure};
use super::search::Search;
use super::start::Start;
use super::{SCATTER, TraceOptions, draws_of, null};
use crate::error::IdentifyError;
use crate::fit::{Fit, fit, prepare_with};
use crate::noise::NoiseSource;
use crate::problem::Problem;

/// The model with what the search has taken, refitted, and what it leaves.
pub(super) struct RefittedModel<'a> {
    pub after: Problem<'a>,
    pub after_fit: Fit,
    pub effects: Vec<Effect>,
    /// `None` where no structure was looked for before either.
    pub structure: Option<Structure>,
}

impl<'a> RefittedModel<'a> {
    /// Of what a search has taken; `structure_before` is what the declared model leaves.
    pub fn of(
        problem: &Problem<'a>,
        before_fit: &Fit,
        search: &Search<'_>,
        options: &TraceOptions,
        structure_before: Option<&Structure>,
    ) -> Result<RefittedModel<'a>, IdentifyError> {
        let effects: Vec<Effect> = taken_effects(search).cloned().collect();
        if effects.is_empty() {
            return Ok(RefittedModel {
                after: problem.clone(),
                after_fit: before_fit.clone(),
                effects,
                structure: structure_before.cloned(),
            });
        }
        // Noise, outliers and rank are found anew, as the fit of a session that declares these effects finds them: what remained of the declared model
        // was not noise.
        let (mut after, mut after_fit) = prepare_with(problem.session, &effects, options.seed)?;
        if noise_is_from_residual(problem, &after) {
            after.noise = problem.noise.clone();
            after_fit = fit(&after, Some(&after_fit.beta))?;
        }
        let structure = structure_before
            .map(|_| remaining_structure(&after, &after_fit, options))
            .transpose()?;
        Ok(RefittedModel {
            after,
            after_fit,
            effects,
            structure,
        })
    }

    /// Whether this is of what the search has added now, in that order. Exchanges leave the number of effects as it is, so the number says nothing.
    pub fn is_of(&self, search: &Search<'_>) -> bool {
        self.effects.iter().eq(taken_effects(search))
    }

    /// Whether structure was looked for and found.
    pub fn is_structured(&self) -> bool {
        self.structure.as_ref().is_some_and(Structure::is_significant)
    }
}

/// What a search has added, in its order.
fn taken_effects<'s>(search: &'s Search<'_>) -> impl Iterator<Item = &'s Effect> {
    let taken = search.taken().iter();
    taken.map(|taken| &search.candidates[taken.candidate].effect)
}

/// Whether the noise of the search is not what a fit would take, but what repeats show along runs: autocorrelated, or of another size.
fn noise_is_from_residual(search: &Problem<'_>, fit: &Problem<'_>) -> bool {
    let (of_search, of_fit) = (&search.noise, &fit.noise);
    let of_one_size = (of_search.sigma_mm / of_fit.sigma_mm - 1.0).abs() < SCATTER;
    of_search.source == NoiseSource::Repeats && !(of_search.memory.is_empty() && of_one_size)
}

/// What a fit leaves, beside its model.
fn remaining_structure(
    problem: &Problem<'_>,
    fit: &Fit,
    options: &TraceOptions,
) -> Result<Structure, IdentifyError> {
    let columns = Columns::new(problem, &fit.beta);
    let start = Start::of(problem, &columns, fit)?;
    let (count, seed) = (draws_of(options), options.seed.wrapping_add(1));
    let draws = null::draws(
        problem,
        &columns,
        &fit.residuals,
        &start.residual,
        count,
        null::SINGLE,
        seed,
    );
    let prior = start.prior();
    remainder::structure(problem, &columns, start.model, &start.residual, draws, &prior)
}
