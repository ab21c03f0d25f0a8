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
    /// The request is invalid.
    #[error("{0}")]
    Request(String),
}

impl From<ModelError> for ApplyError {
    fn from(error: ModelError) -> ApplyError {
        ApplyError::Identify(error.into())
    }
}
