//! The fit of a whole session: noise, outliers and parameters, with the result in display units.

use abbe_model::session::Session;

use super::{Fit, prepare, report};
use crate::error::IdentifyError;
use crate::problem::Problem;
use crate::results::{FitResult, ParameterResult};

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
    /// Fits the errors, effects and set-up quantities of a session. The seed decides folds for cross-validation only.
    ///
    /// # Errors
    /// If the session has no readings, or the iterations do not converge.
    pub fn of(session: &Session, seed: u64) -> Result<SessionFit, IdentifyError> {
        let (problem, fit) = prepare(session, seed)?;
        let result = report(&problem, &fit)?;
        Ok(SessionFit { problem, fit, result })
    }

    /// The estimate of an identifiable parameter, such as `EX0C`, in its display unit.
    pub fn parameter(&self, id: &str) -> Option<&ParameterResult> {
        self.result.parameters.iter().find(|parameter| parameter.id == id)
    }

    /// The residuals of a test in µm: the coordinates of each reading together.
    pub fn residuals_um(&self, test: &str) -> Option<Vec<f64>> {
        let number = self.problem.tests.iter().position(|known| known.name == test)?;
        Some(self.fit.residuals[number].iter().map(|residual_mm| residual_mm * 1e3).collect())
    }
}
