//! A trace of a session that its readings contradict: it says so first, does not search where the readings are those of another session, and
//! claims no effect that only stands for a wrong statement of the set-up.

use super::Trace;
use super::report::unsearched;
use crate::error::IdentifyError;
use crate::fit::Fit;
use crate::plausibility::{self, Plausibility, is_another_session, with_set_ups_freed};
use crate::problem::Problem;
use crate::results::{Remainder, TraceResult};

/// What the readings of a session contradict.
pub(super) struct Contradicted {
    plausibility: Plausibility,
    /// The set-up parameters of which the search takes nothing as known.
    freed: Vec<String>,
}

impl Contradicted {
    /// Examines a fit, and frees the set-up parameters whose statements it contradicts.
    ///
    /// # Errors
    /// If the freed problem cannot be fitted.
    pub fn of(problem: &mut Problem<'_>, fit: &mut Fit) -> Result<Contradicted, IdentifyError> {
        let plausibility = plausibility::examine(problem, fit);
        let mut contradicted = Contradicted {
            plausibility,
            freed: Vec::new(),
        };
        if !contradicted.stops()
            && let Some((freed, found)) = with_set_ups_freed(problem, fit)?
        {
            contradicted.freed = freed;
            *fit = found;
        }
        Ok(contradicted)
    }

    /// Whether there is nothing to search: the readings are those of another session.
    pub fn stops(&self) -> bool {
        is_another_session(&self.plausibility)
    }

    /// Writes the conflicts into a result, in front of its other warnings.
    pub fn tell(&self, result: &mut TraceResult) {
        let mut warnings = plausibility::warnings(&self.plausibility);
        if !self.freed.is_empty() {
            warnings.push(format!(
                "the search takes nothing as known of {}: no effect is claimed that only stands for a wrong statement of the set-up",
                self.freed.join(", ")
            ));
        }
        warnings.append(&mut result.warnings);
        result.warnings = warnings;
        result.plausibility = self.plausibility.clone();
    }

    /// The trace that ends before its search.
    pub fn stopped<'a>(&self, problem: Problem<'a>, fit: Fit) -> Trace<'a> {
        let mut result = TraceResult {
            verdict: "unexplained".to_string(),
            remainder: Remainder {
                structured: true,
                p_value: 0.0,
                place: Some(
                    "every test: the readings contradict the session; no effect was searched for".to_string(),
                ),
            },
            residual_before: "the readings contradict the session".to_string(),
            ..unsearched(&problem, &fit)
        };
        self.tell(&mut result);
        Trace::of_declared(problem, fit, result)
    }
}
