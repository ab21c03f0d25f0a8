//! The error type of this crate.

use abbe_identify::IdentifyError;
use abbe_model::ModelError;

/// Errors of what is derived from a model.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ApplyError {
    /// The model or its session cannot be evaluated.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// A format, or the compensation, cannot represent something.
    #[error("{format} cannot represent {found}: {holds}")]
    Unrepresentable {
        /// The format.
        format: String,
        /// What it cannot represent.
        found: String,
        /// What it represents, or what to do.
        holds: String,
    },
}

impl ApplyError {
    /// [`ApplyError::Unrepresentable`] of its three parts.
    pub fn unrepresentable(
        format: impl Into<String>,
        found: impl Into<String>,
        holds: impl Into<String>,
    ) -> ApplyError {
        ApplyError::Unrepresentable { format: format.into(), found: found.into(), holds: holds.into() }
    }
}

impl From<ModelError> for ApplyError {
    fn from(error: ModelError) -> ApplyError {
        ApplyError::Identify(error.into())
    }
}
