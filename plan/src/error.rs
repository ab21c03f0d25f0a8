//! Refusals of a plan that a caller recognises.

use std::fmt::Display;

use abbe_model::Diagnostic;
use abbe_model::diagnostic::{Area, Code};

/// No candidate test is feasible.
pub const NO_CANDIDATE_TEST: Code = Code { area: Area::Identification, word: "no-candidate-test" };
/// More work than a limit allows.
pub const TOO_MANY: Code = Code { area: Area::Identification, word: "too-many" };

/// [`TOO_MANY`]: what would be computed with its number, the limit of that number, and what to do.
pub(crate) fn too_many(found: impl Display, limit: usize, remedy: impl Display) -> Diagnostic {
    Diagnostic::coded(TOO_MANY, format!("{found}; the limit is {limit}: {remedy}"))
}
