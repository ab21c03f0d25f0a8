//! Refits all parameters with the found effects, and tests the residual for remaining structure.

use abbe_identify::fit::{Fit, prepare_with, refit};
use abbe_identify::noise::{Noise, NoiseSource};
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;

use super::constants::SINGLE;
use super::remainder::{self, Structure};
use super::start::Start;
use super::state::SearchState;
use crate::TraceOptions;
use crate::candidates::columns::Columns;
use crate::null::Draws;

/// The refitted model with the selected effects, and the remaining structure.
pub(super) struct RefittedModel {
    pub after: Problem,
    pub after_fit: Fit,
    pub effects: Vec<Effect>,
    /// Remaining structure. `None` if the residual of the declared model was not tested either.
    pub structure: Option<Structure>,
}

impl RefittedModel {
    /// Refits with the selected effects of a search. `structure_before` is the structure in the residual of the
    /// declared model.
    pub fn of(
        problem: &Problem,
        before_fit: &Fit,
        search: &SearchState<'_>,
        options: &TraceOptions,
        structure_before: Option<&Structure>,
    ) -> Result<RefittedModel, Diagnostic> {
        search.forget_chosen();
        let effects: Vec<Effect> = selected_effects(search).cloned().collect();
        if effects.is_empty() {
            return Ok(RefittedModel {
                after: problem.clone(),
                after_fit: before_fit.clone(),
                effects,
                structure: structure_before.cloned(),
            });
        }
        // Noise, outliers and rank are determined anew, as in a fit of a session that declares these effects. The
        // residual of the declared model contains the effects and overstates the noise.
        let estimated: Vec<Effect> = effects.iter().cloned().map(Effect::with_estimated_numbers).collect();
        let (mut after, mut after_fit) = prepare_with(&problem.session, &estimated, options.seed)?;
        if noise_is_from_search(&problem.noise, &after.noise) {
            after.noise = problem.noise.clone();
            after_fit = refit(&mut after, &after_fit)?;
        }
        let structure = structure_before
            .map(|_| structure(&after, &after_fit, options, options.seed.wrapping_add(1), &|| search.should_continue()))
            .transpose()?;
        Ok(RefittedModel { after, after_fit, effects, structure })
    }

    /// Whether this model has the effects that the search selects now, in the same order. Exchanges keep the number of
    /// effects, so the number alone does not decide.
    pub fn is_of(&self, search: &SearchState<'_>) -> bool {
        self.effects.iter().eq(selected_effects(search))
    }

    /// The found effects with their estimated shape numbers.
    pub fn estimated(&self, search: &SearchState<'_>) -> &[Effect] {
        let all = &self.after.parameters.effects;
        &all[all.len().saturating_sub(search.selected().len())..]
    }

    /// Whether the residual may have significant structure. An untested residual may.
    pub fn is_structured(&self) -> bool {
        self.structure.as_ref().is_none_or(Structure::is_significant)
    }
}

/// The effects that a search has selected, in its order.
fn selected_effects<'s>(search: &'s SearchState<'_>) -> impl Iterator<Item = &'s Effect> {
    let selected = search.selected().iter();
    selected.map(|selected| search.effect(selected.candidate))
}

/// Relative difference of two standard deviations of the noise up to which the model is reported with that of a fit, so
/// that a fit of the session with the found effects gives the same uncertainties.
const SAME_NOISE: f64 = 0.1;

/// Whether the noise of the search is not that of a fit: repeats contradict the stated noise, or beside waves that vary from
/// run to run they give another standard deviation.
pub(super) fn noise_is_from_search(of_search: &Noise, of_fit: &Noise) -> bool {
    let of_one_size = (of_search.sigma_mm / of_fit.sigma_mm - 1.0).abs() < SAME_NOISE;
    match (of_search.source, of_fit.source) {
        (NoiseSource::Repeats, NoiseSource::Repeats) if !of_fit.ar_coefficients.is_empty() => false,
        (NoiseSource::Repeats, _) => !(of_search.ar_coefficients.is_empty() && of_one_size),
        _ => false,
    }
}

/// The declared model with the stated noise, if the search has judged it by a noise of repeats that is about the same: it is
/// then reported as a fit reports it.
///
/// # Errors
/// If the iterations do not converge.
pub(super) fn with_noise_of_fit(problem: &Problem, fit: &Fit) -> Result<Option<(Problem, Fit)>, Diagnostic> {
    let stated = problem.session.stated_noise_mm().map(|stated_mm| Noise::white(stated_mm, NoiseSource::Stated));
    match stated.filter(|stated| !noise_is_from_search(&problem.noise, stated)) {
        Some(noise) if problem.noise.source == NoiseSource::Repeats => {
            let mut problem = problem.clone();
            problem.noise = Noise { inflation: problem.noise.inflation, ..noise };
            let fit = refit(&mut problem, fit)?;
            Ok(Some((problem, fit)))
        }
        _ => Ok(None),
    }
}

/// The structure in the residual of a fit.
pub(super) fn structure(
    problem: &Problem,
    fit: &Fit,
    options: &TraceOptions,
    seed: u64,
    should_continue: &(dyn Fn() -> bool + Sync),
) -> Result<Structure, Diagnostic> {
    let columns = Columns::of_readings(problem);
    let start = Start::of(problem, &columns, fit)?;
    let count = options.null_draw_count();
    let (residuals, whitened, block) = (&fit.residuals, &start.residual, SINGLE);
    let draws = Draws { problem, columns: &columns, residuals, whitened, count, block, seed, progress: None };
    remainder::structure(problem, &start, &draws, should_continue)
}
