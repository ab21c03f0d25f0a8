//! Result of a search on independent poses that accepted families of effects.

use abbe_identify::fit::Fit;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;

use super::effect::{described, explained_by};
use super::verdict::of_poses;
use super::{Model, Searched, Statements, build, explained, residual_before};
use crate::poses::{AcceptedEffect, PoseSearch};
use crate::remainder::Structure;
use crate::result::EffectResult;
use crate::{SearchStep, TraceOutcome};

/// How a search with families ended.
pub(crate) struct PosesEnded {
    /// Whether the maximum number of effects ended the search.
    pub stopped_early: bool,
    /// Structure in the residuals of the declared and of the last model; `None` if there are too few poses for the test.
    pub structures: [Option<Structure>; 2],
    /// Warnings about the options.
    pub warnings: Vec<String>,
}

/// The outcome of a search that accepted families: the declared model, and the model with the found effects. The aliases
/// of a family are not examined: it is the error of each joint about its own axis, as a whole.
///
/// # Errors
/// If the model cannot be evaluated for the cross-validation.
pub(crate) fn outcome_of_poses(
    before: &Problem,
    before_fit: &Fit,
    found: PoseSearch,
    ended: PosesEnded,
) -> Result<TraceOutcome, Diagnostic> {
    let PoseSearch { problem: after, fit: after_fit, effects: accepted, proposed, .. } = found;
    let [structure_before, structure_after] = ended.structures;
    let (verdict, remainder) = of_poses(true, ended.stopped_early, structure_after.as_ref(), found.last_p_value);
    let declared = before.parameters.effects.len();
    let with_effects = Model::of(&after, &after_fit, remainder.structured, None)?;
    let effect = |(k, accepted): (usize, &AcceptedEffect)| -> Result<EffectResult, Diagnostic> {
        let described = described(&after, &after_fit, declared + k, &with_effects.figures.parameters)?;
        Ok(EffectResult {
            family: accepted.group.to_string(),
            p_value: accepted.p_value,
            heldout_rms_um: accepted.heldout_rms_mm * 1e3,
            rms_gain_um: rms_gain_mm(&after, &after_fit, declared + k) * 1e3,
            ..with_aliases(described, &after, accepted)
        })
    };
    let effects: Vec<EffectResult> = accepted.iter().enumerate().map(effect).collect::<Result<_, _>>()?;
    let steps = (accepted.iter().enumerate())
        .map(|(k, accepted)| SearchStep {
            id: accepted.effect.id(),
            effects: k + 1,
            heldout_um: accepted.heldout_rms_mm * 1e3,
        })
        .collect();
    let statements = Statements {
        verdict,
        remainder,
        residual_before: residual_before(before, structure_before.as_ref(), true),
        rejected: Vec::new(),
        candidates: [proposed + found.candidates, proposed + found.detectable],
        searched: Searched::default(),
        interrupted: found.interrupted,
        warnings: ended.warnings,
    };
    let result = build(Model::of(before, before_fit, false, None)?, with_effects, statements, effects);
    let count = accepted.len();
    let aliases_of = |accepted: &AcceptedEffect| accepted.aliases.iter().map(|alias| alias.effect.clone()).collect();
    Ok(TraceOutcome {
        before: before.clone(),
        before_fit: before_fit.clone(),
        alias_effects: accepted.iter().map(aliases_of).collect(),
        effects: after.parameters.effects[declared..].to_vec(),
        competing_effects: (0..count).map(|_| Vec::new()).collect(),
        after,
        after_fit,
        steps,
        strongest: None,
        result,
    })
}

/// The result of an effect with its aliases.
fn with_aliases(of_effect: EffectResult, problem: &Problem, accepted: &AcceptedEffect) -> EffectResult {
    let aliases: Vec<&Effect> = accepted.aliases.iter().map(|alias| &alias.effect).collect();
    let costs: Vec<[f64; 2]> = accepted.aliases.iter().map(|alias| [alias.delta_chi2, alias.prior_cost]).collect();
    explained_by(of_effect, problem, &accepted.effect, &aliases, &costs)
}

/// Rms of what an effect explains in addition to the rest of the model, mm.
fn rms_gain_mm(problem: &Problem, fit: &Fit, number: usize) -> f64 {
    let increase = Some(explained(problem, fit, number)).filter(|increase| increase.is_finite());
    (increase.unwrap_or(0.0).max(0.0) / problem.scalars().max(1) as f64).sqrt() * problem.noise.likelihood_mm()
}
