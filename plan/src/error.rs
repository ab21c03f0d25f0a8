//! The error type of this crate.

use abbe_identify::IdentifyError;
use abbe_model::ModelError;

/// Errors of a plan.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The session cannot become a problem.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// Poses of an instrument need the travel of every linear axis.
    #[error("axis `{axis}` states no travel, so that no poses can be drawn; add `travel_mm` to the machine")]
    NoTravel {
        /// The axis.
        axis: String,
    },
    /// The place of a socket is not known.
    #[error(
        "test `{test}`: the place of its socket is not known; state `socket_mm`, or give the data with poses in the socket"
    )]
    NoPlace {
        /// The test.
        test: String,
    },
    /// No pose meets the condition of the instrument.
    #[error("test `{test}`: none of {drawn} drawn poses {goal} within the travel of the axes; check {check}")]
    OutOfReach {
        /// The test.
        test: String,
        /// The number of drawn poses.
        drawn: usize,
        /// What a pose has to do.
        goal: String,
        /// What may be wrong.
        check: &'static str,
    },
    /// No candidate test is feasible.
    #[error(
        "no candidate test is feasible on this machine: the instrument reads no motion of its axes, no bar reaches, the \
         travel is too short, or no test clears the bodies of the machine"
    )]
    NoCandidateTest,
    /// More work than a limit allows.
    #[error("{found}; the limit is {limit}: {remedy}")]
    TooMany {
        /// What would be computed, with its number.
        found: String,
        /// The limit of that number.
        limit: usize,
        /// What to do.
        remedy: String,
    },
}

impl From<ModelError> for PlanError {
    fn from(error: ModelError) -> PlanError {
        PlanError::Identify(error.into())
    }
}
