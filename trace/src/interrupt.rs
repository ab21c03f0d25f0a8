//! Interrupts a trace: the caller can stop it at any time and gets the effects found so far.

use abbe_identify::error::IdentifyError;
use abbe_identify::fit::Fit;
use abbe_identify::problem::Problem;
use abbe_identify::results::TraceResult;

use super::result::unsearched;
use super::{Progress, TraceOutcome};

/// Asks the caller of a trace whether to continue.
#[derive(Clone, Copy)]
pub struct Interrupt<'t>(pub &'t (dyn Fn(Progress) -> bool + Sync));

impl Interrupt<'_> {
    /// Returns if the trace continues.
    ///
    /// # Errors
    /// [`IdentifyError::Interrupted`] if the caller stops the trace.
    pub fn check(&self) -> Result<(), IdentifyError> {
        if (self.0)(Progress::Working) { Ok(()) } else { Err(IdentifyError::Interrupted) }
    }
}

impl TraceOutcome {
    /// A trace that was interrupted before its search began. It contains the declared model only.
    pub(super) fn unsearched(problem: Problem, fit: Fit) -> Result<TraceOutcome, IdentifyError> {
        let mut result = unsearched(&problem, &fit)?;
        result.mark_interrupted();
        Ok(TraceOutcome::of_declared(problem, fit, result))
    }

    /// A trace that contains the declared model only, with its result.
    pub(super) fn of_declared(problem: Problem, fit: Fit, result: TraceResult) -> TraceOutcome {
        TraceOutcome {
            after: problem.clone(),
            after_fit: fit.clone(),
            before: problem,
            before_fit: fit,
            effects: Vec::new(),
            alias_effects: Vec::new(),
            competing_effects: Vec::new(),
            steps: Vec::new(),
            strongest: None,
            result,
        }
    }
}
