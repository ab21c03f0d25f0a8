//! Result of a trace without a search: that of the declared model.

use abbe_identify::error::IdentifyError;
use abbe_identify::fit::outcome::{self, Determined};
use abbe_identify::fit::{self, Fit};
use abbe_identify::noise;
use abbe_identify::plausibility::Plausibility;
use abbe_identify::problem::Problem;
use abbe_identify::results::{ModelResult, TraceResult, TraceVerdict};

use super::{model_result, not_examined};

/// The declared model alone, without a verdict.
pub(crate) fn unsearched(problem: &Problem, fit: &Fit) -> Result<TraceResult, IdentifyError> {
    unsearched_of(problem, fit, model_result(problem, fit, fit.held_out.rms_mm)?)
}

/// As [`unsearched`], with the known figures of the model.
///
/// # Errors
/// If the model cannot be evaluated.
pub(super) fn unsearched_of(problem: &Problem, fit: &Fit, declared: ModelResult) -> Result<TraceResult, IdentifyError> {
    let remainder = not_examined();
    let mut warnings = problem.session.warnings.clone();
    warnings.extend(noise::stated_against_repeats(problem, &fit.residuals));
    let determined = Determined::of(problem, &fit.rank)?;
    Ok(TraceResult {
        reading_unit: problem.unit(),
        outcome: outcome::outcome(problem, fit, declared.goodness, &determined),
        verdict: TraceVerdict::Incomplete,
        interrupted: false,
        time_limit_s: None,
        unique: true,
        noise_um: problem.noise.sigma_mm * 1e3,
        noise_source: problem.noise.source,
        noise_ar_coefficients: problem.noise.ar_coefficients.clone(),
        readings: problem.readings(),
        heldout_by: problem.folds.kind.words().to_string(),
        before: declared.clone(),
        after: declared,
        effects: Vec::new(),
        rejected_candidates: Vec::new(),
        residual_before: remainder.place.clone().unwrap_or_default(),
        remainder,
        changed_parameters: Vec::new(),
        candidates: 0,
        candidates_detectable: 0,
        unobservable: fit::unobservable(problem, &fit.rank),
        null_space: fit::null_space(problem, &fit.rank),
        outliers: fit::outliers(problem, fit),
        about: problem.session.about.iter().cloned().collect(),
        conformity: None,
        plausibility: Plausibility::default(),
        warnings,
    })
}
