//! The fit of a whole session: noise, outliers and parameters, with the result in display units.
//!
//! A decision about a limit needs a model that lacks nothing. χ² alone overlooks an effect that is small in each of many
//! readings, so where limits are to be decided the residual is tested for structure too, by the test of the trace.

use abbe_identify::fit::{Fit, FitResult, prepare, report};
use abbe_identify::problem::Problem;
use abbe_identify::results::Estimate;
use abbe_identify::tolerance::conformity;
use abbe_model::Diagnostic;
use abbe_model::session::Session;

use crate::trace::structure_of_fit;

/// A fitted session.
#[derive(Clone)]
pub struct SessionFit {
    /// The session with its noise, its outliers and its parameters.
    pub problem: Problem,
    /// The estimates, their covariance and the residuals, in internal units.
    pub fit: Fit,
    /// The result in display units, as the JSON output has it.
    pub result: FitResult,
}

impl SessionFit {
    /// Fits the errors, effects and set-up quantities of a session. If the session states limits, the residual is tested
    /// for structure. The seed decides folds for cross-validation, and the null draws of this test.
    ///
    /// # Errors
    /// If the session has no readings, or the iterations do not converge.
    pub fn of(session: &Session, seed: u64) -> Result<SessionFit, Diagnostic> {
        let (problem, fit) = prepare(session, seed)?;
        let mut result = report(&problem, &fit)?;
        if result.conformity.is_some() && result.model.outcome.goodness.forbids_decisions().is_none() {
            test_structure(&problem, &fit, &mut result, seed)?;
        }
        Ok(SessionFit { problem, fit, result })
    }

    /// The estimate of an identifiable parameter, such as `EX0C`, in its display unit.
    pub fn parameter(&self, id: &str) -> Option<&Estimate> {
        self.result.model.parameters.iter().find(|parameter| parameter.id == id)
    }

    /// The residuals of a test in µm: the coordinates of each reading together.
    pub fn residuals_um(&self, test: &str) -> Option<Vec<f64>> {
        let number = self.problem.tests.iter().position(|known| known.name == test)?;
        Some(self.fit.residuals[number].iter().map(|residual_mm| residual_mm * 1e3).collect())
    }
}

/// Tests the residual for structure. If it has any, nothing is decided about parameters, and no estimate may be quoted.
fn test_structure(problem: &Problem, fit: &Fit, result: &mut FitResult, seed: u64) -> Result<(), Diagnostic> {
    let Some(structure) = structure_of_fit(problem, fit, seed)?.filter(|found| found.is_significant()) else {
        return Ok(());
    };
    let goodness = result.model.outcome.goodness.with_structure(true);
    result.model.outcome.goodness = goodness;
    result.model.parameters.iter_mut().for_each(|parameter| parameter.quotable &= goodness.quotable);
    result.conformity = conformity(&problem.session, &result.model, &result.circular);
    result.warnings.push(format!(
        "the residual has structure that the model does not explain: {}; trace it to find the effect",
        structure.description
    ));
    Ok(())
}
