//! Result of a search on independent poses that accepted families of effects.

use faer::prelude::Solve;
use faer::{Mat, Side};

use super::effect::described;
use super::unsearched::unsearched_of;
use super::{changed_parameters, model_result};
use crate::error::IdentifyError;
use crate::fit::Fit;
use crate::parameters::Role;
use crate::problem::Problem;
use crate::results::{EffectResult, Remainder, TraceResult, TraceVerdict};
use crate::trace::families::AcceptedFamilies;
use crate::trace::{SearchStep, TraceOutcome};

/// How a search with families ended.
pub(in crate::trace) struct FamiliesEnded {
    /// Number of effects of the proposed families.
    pub families: usize,
    /// Number of single effects that were screened.
    pub candidates: usize,
    /// Number of those that the readings would show.
    pub detectable: usize,
    /// p-value of the best single effect that was not added.
    pub last_p_value: f64,
    /// Whether the maximum number of effects ended the search.
    pub stopped_early: bool,
    /// Whether the caller interrupted it.
    pub interrupted: bool,
    /// Warnings about the options.
    pub warnings: Vec<String>,
}

/// The outcome of a search that accepted families: the declared model, and the model with the found effects. Their
/// aliases are not examined: a family is the error of each joint about its own axis, as a whole.
///
/// # Errors
/// If the model cannot be evaluated for the cross-validation.
pub(in crate::trace) fn outcome_with_families(
    before: &Problem,
    before_fit: &Fit,
    found: AcceptedFamilies,
    ended: FamiliesEnded,
) -> Result<TraceOutcome, IdentifyError> {
    let AcceptedFamilies { problem: after, fit: after_fit, effects: accepted, .. } = found;
    let before_result = model_result(before, before_fit, before_fit.held_out.rms_mm)?;
    let after_result = model_result(&after, &after_fit, after_fit.held_out.rms_mm)?;
    let declared = before.parameters.effects.len();
    let effects: Vec<EffectResult> = (accepted.iter().enumerate())
        .map(|(k, accepted)| EffectResult {
            family: accepted.group.to_string(),
            p_value: accepted.p_value,
            heldout_rms_um: accepted.heldout_rms_mm * 1e3,
            rms_gain_um: rms_gain_mm(&after, &after_fit, declared + k) * 1e3,
            ..described(&after, &after_fit, declared + k, &after_result.parameters)
        })
        .collect();
    let verdict = if ended.stopped_early { TraceVerdict::PartlyExplained } else { TraceVerdict::Explained };
    let steps = (accepted.iter().enumerate())
        .map(|(k, accepted)| SearchStep {
            id: accepted.effect.id(),
            effects: k + 1,
            heldout_rms_um: accepted.heldout_rms_mm * 1e3,
        })
        .collect();
    let mut result = TraceResult {
        verdict: verdict.gated(after_result.goodness.verdict),
        changed_parameters: changed_parameters(&before_result.parameters, &after_result.parameters),
        before: before_result,
        effects,
        remainder: Remainder { structured: false, p_value: ended.last_p_value, place: None },
        residual_before: "independent poses: structure is looked for effect by effect".to_string(),
        candidates: ended.families + ended.candidates,
        candidates_detectable: ended.families + ended.detectable,
        ..unsearched_of(&after, &after_fit, after_result)?
    };
    result.warnings.extend(ended.warnings);
    if ended.interrupted {
        result.mark_interrupted();
    }
    let count = accepted.len();
    Ok(TraceOutcome {
        before: before.clone(),
        before_fit: before_fit.clone(),
        after,
        after_fit,
        effects: accepted.into_iter().map(|accepted| accepted.effect).collect(),
        alias_effects: vec![Vec::new(); count],
        competing_effects: (0..count).map(|_| Vec::new()).collect(),
        steps,
        strongest: None,
        result,
    })
}

/// Rms of what an effect explains in addition to the rest of the model, mm: the increase of the sum of squares of
/// readings and priors without the effect, `bᵀ C⁻¹ b` with the covariance `C` of its coefficients.
fn rms_gain_mm(problem: &Problem, fit: &Fit, number: usize) -> f64 {
    let list = &problem.parameters.list;
    let own = |j: &usize| matches!(list[*j].role, Role::Coefficient { effect, .. } if effect == number);
    let own: Vec<usize> = (0..list.len()).filter(own).collect();
    let size = |k: usize| list[own[k]].size;
    let covariance = Mat::from_fn(own.len(), own.len(), |i, k| fit.covariance[(own[i], own[k])] / (size(i) * size(k)));
    let b = Mat::from_fn(own.len(), 1, |k, _| fit.beta[own[k]] / size(k));
    let Ok(factor) = covariance.llt(Side::Lower) else { return 0.0 };
    let increase = (b.transpose() * factor.solve(&b))[(0, 0)];
    let rows = problem.scalars().max(1) as f64;
    (increase.max(0.0) / rows).sqrt() * problem.noise.likelihood_mm()
}
