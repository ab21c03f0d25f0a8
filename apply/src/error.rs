//! What the formats refuse.

use std::fmt::Display;

use abbe_model::Diagnostic;

/// A format, or the compensation, cannot represent something: what it represents, or what to do.
pub fn unrepresentable(format: impl Display, found: impl Display, holds: impl Display) -> Diagnostic {
    Diagnostic::identification(format!("{format} cannot represent {found}: {holds}"))
}
