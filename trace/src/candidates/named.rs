//! Effects of the library by their identifiers.

use abbe_identify::error;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;

use super::library;

/// Adds an effect of the library by its identifier.
///
/// # Errors
/// If the library has no such effect for this plan.
pub fn add(problem: &mut Problem, id: &str) -> Result<(), Diagnostic> {
    if problem.parameters.effects.iter().any(|effect| effect.id() == id) {
        return Ok(());
    }
    problem.add_effect(&effect(problem, id)?)
}

/// An effect of the library by its identifier.
///
/// # Errors
/// If the library has no such effect for this plan.
pub fn effect(problem: &Problem, id: &str) -> Result<Effect, Diagnostic> {
    let candidates = library::candidates(problem)?;
    let Some(candidate) = candidates.iter().find(|candidate| candidate.effect.id() == id) else {
        let before_shape = id.split(':').next().unwrap_or(id);
        let mut alike: Vec<String> =
            candidates.iter().map(|c| c.effect.id()).filter(|other| other.starts_with(before_shape)).collect();
        alike.dedup();
        alike.truncate(6);
        let these = "identifiers are component~driver:shape, as in EZC~C:h2; similar ones:";
        return Err(error::unknown("the library of effects for this plan", "effect", id, these, alike));
    };
    Ok(candidate.effect.clone())
}
