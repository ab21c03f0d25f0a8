//! The options of the analysis of sessions.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The options of the analysis of a session. They are part of its key.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Fit alone, without the search for effects.
    pub no_trace: bool,
    /// Maximum number of effects.
    pub max_effects: Option<usize>,
    /// Search only effects whose identifier contains one of these texts.
    pub only: Vec<String>,
    /// Do not search effects whose identifier contains one of these texts.
    pub exclude: Vec<String>,
}
