//! A trace of a session whose readings contradict it. The trace states the contradiction first. It does not search if
//! the readings belong to another session. It accepts no effect that only represents a wrong set-up value.

use abbe_identify::fit::{self, Fit, fit};
use abbe_identify::plausibility::{self, ConflictKind, Plausibility, Pulls};
use abbe_identify::problem::Problem;
use abbe_identify::results::TraceVerdict;
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;
use abbe_model::session::Prior;

use super::TraceOutcome;
use super::progress::Progress;
use super::result::unsearched;
use crate::result::{Remainder, TraceResult};

/// The contradictions between the readings and a session.
pub(super) struct Contradicted {
    plausibility: Plausibility,
    /// Identifiers of the set-up parameters whose stated values are contradicted.
    parameters: Vec<String>,
    /// The problem without the priors of these parameters, and its fit. `None` if no set-up value is contradicted.
    pub freed: Option<(Problem, Fit)>,
}

impl Contradicted {
    /// Examines a fit for contradictions.
    ///
    /// # Errors
    /// If the problem cannot be fitted without the set-up priors.
    pub fn of(problem: &Problem, fit: &Fit) -> Result<Contradicted, Diagnostic> {
        let mut contradicted =
            Contradicted { plausibility: plausibility::examine(problem, fit), parameters: Vec::new(), freed: None };
        let mut freed = problem.clone();
        if !contradicted.forbids_search()
            && let Some((parameters, found)) = with_set_ups_freed(&mut freed, fit)?
        {
            contradicted.parameters = parameters;
            contradicted.freed = Some((freed, found));
        }
        Ok(contradicted)
    }

    /// Tells the caller of contradictions.
    pub fn report(&self, progress: &dyn Fn(Progress) -> bool) {
        if !self.plausibility.conflicts.is_empty() {
            progress(Progress::Contradicted(Box::new(self.plausibility.clone())));
        }
    }

    /// Whether the set-up is still contradicted in a model with effects that were found without its priors.
    ///
    /// # Errors
    /// If the model with the effects cannot be fitted.
    pub fn contradicted_by(&self, problem: &Problem, fitted: &Fit, effects: &[Effect]) -> Result<bool, Diagnostic> {
        if effects.is_empty() {
            return Ok(true);
        }
        let mut with = problem.clone();
        for effect in effects {
            with.add_effect(effect)?;
        }
        let mut start = vec![0.0; with.parameters.list.len()];
        start[..fitted.beta.len()].copy_from_slice(&fitted.beta);
        let found = fit::fit(&with, Some(&start))?;
        Ok(!Pulls::of(&with, &found).contradicted().is_empty())
    }

    /// Whether the readings belong to another session, so that a search has no purpose.
    pub fn forbids_search(&self) -> bool {
        is_another_session(&self.plausibility)
    }

    /// The same for a search with the priors of the set-up.
    pub fn with_priors(self) -> Contradicted {
        Contradicted { parameters: Vec::new(), ..self }
    }

    /// The contradictions that remain beside the found effects.
    pub fn beside(self, found: &TraceOutcome) -> Contradicted {
        match found.effects.is_empty() || self.plausibility.conflicts.is_empty() {
            true => self,
            false => Contradicted { plausibility: plausibility::examine(&found.after, &found.after_fit), ..self },
        }
    }

    /// Adds the contradictions to a result, before its other warnings.
    pub fn add_warnings(&self, result: &mut TraceResult) {
        let mut warnings = plausibility::warnings(&self.plausibility);
        if !self.parameters.is_empty() {
            warnings.push(format!(
                "the search uses no prior of {}, so that it accepts no effect that only represents a wrong set-up value; \
                 χ²/ν with the effects counts none of these priors, χ²/ν before counts them as `fit` does",
                self.parameters.join(", ")
            ));
        }
        warnings.append(&mut result.warnings);
        result.warnings = warnings;
        result.plausibility = self.plausibility.clone();
    }

    /// The trace that ends before its search.
    pub fn outcome_without_search(&self, problem: Problem, fit: Fit) -> Result<TraceOutcome, Diagnostic> {
        let mut result = TraceResult {
            verdict: TraceVerdict::Unexplained,
            remainder: Remainder {
                structured: true,
                p_value: 0.0,
                place: Some("every test: the readings contradict the session; no effect was searched for".to_string()),
            },
            residual_before: "the readings contradict the session".to_string(),
            ..unsearched(&problem, &fit)?
        };
        self.add_warnings(&mut result);
        Ok(TraceOutcome::of_declared(problem, fit, result))
    }
}

/// Maximum number of rounds: a conflict may appear only after another is removed.
const MAX_ROUNDS: usize = 5;

/// A changed statement that lowers the residual by this factor is the explanation.
const STATEMENT_EXPLAINS: f64 = 5.0;

/// Whether readings and session disagree so much that a search for effects is meaningless.
pub fn is_another_session(plausibility: &Plausibility) -> bool {
    plausibility.conflicts.iter().any(|conflict| match conflict.kind {
        ConflictKind::Residual | ConflictKind::Orientations => true,
        ConflictKind::ExplainedVariance => conflict.value < conflict.stated,
        ConflictKind::Statement => conflict.value > STATEMENT_EXPLAINS * conflict.stated,
        ConflictKind::SetupParameter
        | ConflictKind::Setups
        | ConflictKind::Unit
        | ConflictKind::LocationError
        | ConflictKind::ZeroAngle => false,
    })
}

/// Whether any set-up parameter has a stated uncertainty.
fn has_priors(problem: &Problem) -> bool {
    let list = &problem.parameters.list;
    list.iter().any(|parameter| matches!(parameter.prior, Prior::Gaussian(_)))
}

/// Replaces the priors of the set-up parameters whose statements the readings contradict by wide ones, so that no
/// effect is accepted instead of a wrong statement. Returns the identifiers of these parameters and the fit; `None`
/// where nothing is contradicted.
///
/// # Errors
/// If the freed problem cannot be fitted.
pub fn with_set_ups_freed(problem: &mut Problem, before: &Fit) -> Result<Option<(Vec<String>, Fit)>, Diagnostic> {
    if !has_priors(problem) {
        return Ok(None);
    }
    let mut freed: Vec<String> = Vec::new();
    let mut found = before.clone();
    for _ in 0..MAX_ROUNDS {
        let pulls = Pulls::of(problem, &found);
        let contradicted: Vec<usize> = pulls.contradicted().iter().map(|pull| pull.parameter).collect();
        if contradicted.is_empty() {
            break;
        }
        for j in contradicted {
            let parameter = &mut problem.parameters.list[j];
            parameter.prior = Prior::Gaussian(parameter.size);
            freed.push(parameter.id.to_string());
        }
        found = fit(problem, Some(&found.beta))?;
    }
    Ok((!freed.is_empty()).then_some((freed, found)))
}
