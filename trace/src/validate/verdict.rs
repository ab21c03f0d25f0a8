//! The verdict on a model.
//!
//! Readings are *consistent* with the model if
//!
//! 1. the residual is as large as predicted: `√(χ²/ν) ≤ 1.05`, or `P(χ² > found) ≥ 0.001`,
//! 2. the 95 % intervals cover at least 90 % of the scalar readings, and
//! 3. no parameter has moved, at 0.5 % over all parameters.
//!
//! | verdict | when |
//! |---|---|
//! | `holds` | all readings are consistent |
//! | `holds-in-range` | the residual of all readings is not as predicted, but those inside the range are consistent |
//! | `degraded` | neither, but the model is better than the location errors alone |
//! | `does-not-hold` | neither, and the model is no better than those |
//!
//! A model without effects is compared with the nominal machine.

use crate::validate::ValidationVerdict;

/// What the verdict follows from.
pub(super) struct Evidence {
    /// Whether all readings are consistent with the model.
    pub all: bool,
    /// Whether the residual of all readings is as predicted, be parameters moved or not.
    pub as_predicted: bool,
    /// Whether those inside the range are; `None` if all or none are inside.
    pub in_range: Option<bool>,
    /// Whether residual and set-up are smaller over noise and priors than with the location errors alone.
    pub better_than_reference: bool,
}

/// The verdict.
pub(super) fn verdict(evidence: &Evidence) -> ValidationVerdict {
    match evidence {
        Evidence { all: true, .. } => ValidationVerdict::Holds,
        Evidence { in_range: Some(true), as_predicted: false, .. } => ValidationVerdict::HoldsInRange,
        Evidence { better_than_reference: true, .. } => ValidationVerdict::Degraded,
        _ => ValidationVerdict::DoesNotHold,
    }
}
