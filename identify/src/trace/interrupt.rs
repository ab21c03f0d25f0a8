//! Interrupts a trace: the caller can stop it at any time and gets the effects found so far.

use super::result::unsearched;
use super::{Progress, TraceOutcome};
use crate::error::IdentifyError;
use crate::fit::Fit;
use crate::problem::Problem;
use crate::results::{TraceResult, TraceVerdict};

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

impl TraceResult {
    /// Marks a result as that of an interrupted trace: a field, the verdict, and a warning.
    pub fn mark_interrupted(&mut self) {
        self.interrupted = true;
        self.verdict = TraceVerdict::Incomplete;
        self.warnings.push(self.incompleteness());
    }

    /// States that a time limit of the caller interrupted the trace. A trace that was not interrupted is not changed.
    pub fn mark_time_limit(&mut self, seconds: f64) {
        if self.interrupted {
            let before = self.incompleteness();
            self.time_limit_s = Some(seconds);
            let now = self.incompleteness();
            self.warnings.iter_mut().filter(|warning| **warning == before).for_each(|w| w.clone_from(&now));
        }
    }

    fn incompleteness(&self) -> String {
        format!(
            "the trace was {}: effects may be missing from the model, and the residual was not examined for structure",
            self.interruption()
        )
    }

    /// The state at the interruption, for example `interrupted after 2 effects`.
    pub fn interruption(&self) -> String {
        let effects = match self.effects.len() {
            1 => "1 effect".to_string(),
            count => format!("{count} effects"),
        };
        match self.time_limit_s {
            Some(seconds) => format!("interrupted by the time limit of {seconds} s after {effects}"),
            None => format!("interrupted after {effects}"),
        }
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
