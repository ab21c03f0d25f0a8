//! The one builder of the result of a trace: for the search of the library, for the search on poses that accepts families,
//! and for a trace that ended before its search.

use abbe_identify::error::IdentifyError;
use abbe_identify::fit::outcome::{self, Determined};
use abbe_identify::fit::{self, Fit};
use abbe_identify::heldout::mislabelled_runs;
use abbe_identify::noise;
use abbe_identify::plausibility::{self, Plausibility};
use abbe_identify::problem::Problem;
use abbe_identify::results::{EffectResult, ModelResult, RejectedCandidate, Remainder, TraceResult, TraceVerdict};

use super::verdict::not_examined;
use super::{changed_parameters, model_result};

/// A fitted model and its figures.
#[derive(Clone)]
pub(super) struct Model<'m> {
    pub problem: &'m Problem,
    pub fit: &'m Fit,
    pub figures: ModelResult,
}

impl<'m> Model<'m> {
    /// With the held-out error of the fit.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn of(problem: &'m Problem, fit: &'m Fit) -> Result<Model<'m>, IdentifyError> {
        Ok(Model { problem, fit, figures: model_result(problem, fit, fit.held_out.rms_mm)? })
    }
}

/// What a search says besides the figures of its models and effects.
pub(super) struct Statements {
    pub verdict: TraceVerdict,
    pub remainder: Remainder,
    pub residual_before: String,
    pub rejected: Vec<RejectedCandidate>,
    /// Number of candidates, and of those that the readings would show.
    pub candidates: [usize; 2],
    /// The families of these, and the motions that location errors rest on.
    pub searched: Searched,
    pub interrupted: bool,
    /// Warnings of the search.
    pub warnings: Vec<String>,
}

/// What a search covers, and what it cannot.
#[derive(Clone, Debug, Default)]
pub(in crate::result) struct Searched {
    /// The families of effects of its candidates.
    pub families: Vec<String>,
    /// Motions of rotary axes that no reading separates from their location errors, in words.
    pub presumed: Vec<String>,
}

/// The result with the declared model `before` and the model `after` with the found effects, which `effects` describes by
/// the figures of that model.
///
/// # Errors
/// If the model cannot be evaluated.
pub(super) fn build(
    before: Model<'_>,
    after: Model<'_>,
    statements: Statements,
    effects: impl FnOnce(&ModelResult) -> Result<Vec<EffectResult>, IdentifyError>,
) -> Result<TraceResult, IdentifyError> {
    let Model { problem, fit, mut figures } = after;
    let Statements { verdict, remainder, residual_before, rejected, candidates, interrupted, .. } = statements;
    let determined = Determined::of(problem, &fit.rank)?;
    let contradicted = noise::stated_against_repeats(problem, &fit.residuals);
    figures.goodness = figures.goodness.with_structure(remainder.structured);
    determined.mark(problem, &mut figures.parameters, figures.goodness);
    let effects = effects(&figures)?;
    let mut warnings = before.problem.session.warnings.clone();
    warnings.extend(noise::stated_against_repeats(before.problem, &before.fit.residuals));
    warnings.extend(mislabelled_runs(&before.problem.tests));
    warnings.extend(fit::assumptions(problem));
    warnings.extend(statements.warnings);
    warnings.extend(plausibility::coefficients::warnings(before.problem, before.fit));
    let mut result = TraceResult {
        reading_unit: problem.unit(),
        verdict: verdict.gated(figures.goodness.verdict),
        outcome: outcome::outcome(problem, fit, figures.goodness, &determined, contradicted),
        interrupted: false,
        time_limit_s: None,
        unique: effects.iter().all(|effect| effect.unique),
        noise_um: problem.noise.sigma_mm * 1e3,
        noise_source: problem.noise.source,
        noise_ar_coefficients: problem.noise.ar_coefficients.clone(),
        readings: problem.readings(),
        heldout_by: problem.folds.kind.words().to_string(),
        changed_parameters: changed_parameters(&before.figures.parameters, &figures.parameters),
        before: before.figures,
        after: figures,
        effects,
        remainder,
        residual_before,
        rejected_candidates: rejected,
        candidates: candidates[0],
        candidates_detectable: candidates[1],
        families: statements.searched.families,
        presumed: statements.searched.presumed,
        unobservable: fit::unobservable(problem, &fit.rank),
        null_space: fit::null_space(problem, &fit.rank),
        outliers: fit::outliers(problem, fit),
        conformity: None,
        plausibility: Plausibility::default(),
        warnings,
        about: before.problem.session.about.iter().cloned().collect(),
    };
    if interrupted {
        result.mark_interrupted();
    }
    Ok(result)
}

/// The declared model alone, without a verdict.
///
/// # Errors
/// If the model cannot be evaluated.
pub(crate) fn unsearched(problem: &Problem, fit: &Fit) -> Result<TraceResult, IdentifyError> {
    let remainder = not_examined();
    let statements = Statements {
        verdict: TraceVerdict::Incomplete,
        residual_before: remainder.place.clone().unwrap_or_default(),
        remainder,
        rejected: Vec::new(),
        candidates: [0, 0],
        searched: Searched::default(),
        interrupted: false,
        warnings: Vec::new(),
    };
    let declared = Model::of(problem, fit)?;
    build(declared.clone(), declared, statements, |_| Ok(Vec::new()))
}
