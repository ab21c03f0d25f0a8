//! The parts of `abbe paper`: selections of text, tables and figures, from results.

pub mod comparison;
pub mod contents;
pub mod equations;
pub mod methods;

use super::block::Report;

/// What a part of the paper is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// The methods.
    Methods,
    /// Machine, set-ups and tests.
    SetUp,
    /// The closed form of the readings, and the nomenclature.
    Equations,
    /// Sensitivities of the readings.
    Sensitivity,
    /// Predicted uncertainties.
    Uncertainty,
    /// Correlation of the errors.
    Correlation,
    /// Ranks, null space, base parameters.
    Identifiability,
    /// Biases by undeclared effects.
    Bias,
    /// Several sessions beside each other.
    Comparison,
    /// Estimates and residuals.
    Trace,
}

/// The subjects in the order of the paper, with the words of `--parts`, which are the names of their files.
pub const SUBJECTS: &[(&str, Subject)] = &[
    ("methods", Subject::Methods),
    ("set-up", Subject::SetUp),
    ("equations", Subject::Equations),
    ("sensitivity", Subject::Sensitivity),
    ("uncertainty", Subject::Uncertainty),
    ("correlation", Subject::Correlation),
    ("identifiability", Subject::Identifiability),
    ("bias", Subject::Bias),
    ("comparison", Subject::Comparison),
    ("trace", Subject::Trace),
];

impl Subject {
    /// Its word.
    pub fn word(self) -> &'static str {
        SUBJECTS.iter().find(|(_, own)| *own == self).map_or("", |(word, _)| word)
    }
}

/// A part of the paper. The title of the report is its heading.
pub struct Part {
    /// What it is about.
    pub subject: Subject,
    /// Contents.
    pub report: Report,
}
