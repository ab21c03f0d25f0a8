//! The one builder of the result of a trace: for the search of the library, for the search on poses that accepts families,
//! and for a trace that ended before its search.

use abbe_identify::fit::outcome::goodness;
use abbe_identify::fit::{self, Fit, JudgedBy};
use abbe_identify::heldout::mislabelled_runs;
use abbe_identify::plausibility::{self, Plausibility};
use abbe_identify::problem::Problem;
use abbe_identify::results::{ModelResult, TraceVerdict};
use abbe_model::Diagnostic;

use super::changed_parameters;
use super::verdict::not_examined;
use crate::result::{EffectResult, RejectedCandidate, Remainder, TraceResult};

/// A fitted model and its figures.
#[derive(Clone)]
pub(super) struct Model<'m> {
    pub problem: &'m Problem,
    pub fit: &'m Fit,
    pub figures: ModelResult,
}

impl<'m> Model<'m> {
    /// Whose residual has structure or has none.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn of(
        problem: &'m Problem,
        fit: &'m Fit,
        structured: bool,
        judged_by: Option<JudgedBy<'_>>,
    ) -> Result<Model<'m>, Diagnostic> {
        let goodness = goodness(problem, fit).with_structure(structured);
        Ok(Model { problem, fit, figures: fit::model(problem, fit, goodness, judged_by)? })
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

/// The result with the declared model `before` and the model `after` with the found effects.
pub(super) fn build(
    before: Model<'_>,
    after: Model<'_>,
    statements: Statements,
    effects: Vec<EffectResult>,
) -> TraceResult {
    let Statements { verdict, remainder, residual_before, rejected, candidates, interrupted, .. } = statements;
    let mut warnings = before.problem.session.warnings.clone();
    warnings.extend(before.figures.outcome.contradicted_noise().map(str::to_string));
    warnings.extend(mislabelled_runs(&before.problem.tests));
    warnings.extend(fit::assumptions(after.problem));
    warnings.extend(statements.warnings);
    warnings.extend(plausibility::coefficients::warnings(before.problem, before.fit));
    let mut result = TraceResult {
        reading_unit: after.figures.noise.unit,
        noise_um: after.figures.noise.value,
        verdict: verdict.gated(after.figures.outcome.goodness.verdict),
        interrupted: false,
        time_limit_s: None,
        unique: effects.iter().all(|effect| effect.unique),
        changed_parameters: changed_parameters(&before.figures.parameters, &after.figures.parameters),
        before: before.figures,
        after: after.figures,
        effects,
        remainder,
        residual_before,
        rejected_candidates: rejected,
        candidates: candidates[0],
        candidates_detectable: candidates[1],
        families: statements.searched.families,
        presumed: statements.searched.presumed,
        conformity: None,
        plausibility: Plausibility::default(),
        warnings,
        about: before.problem.session.about.iter().cloned().collect(),
    };
    if interrupted {
        result.mark_interrupted();
    }
    result
}

/// The declared model alone, without a verdict.
///
/// # Errors
/// If the model cannot be evaluated.
pub(crate) fn unsearched(problem: &Problem, fit: &Fit) -> Result<TraceResult, Diagnostic> {
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
    let declared = Model::of(problem, fit, false, None)?;
    Ok(build(declared.clone(), declared, statements, Vec::new()))
}
