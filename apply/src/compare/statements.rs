//! The three statements of a comparison.

use abbe_identify::results::{NextStep, Statements};
use schemars::JsonSchema;
use serde::Serialize;

use super::results::{Comparison, Difference};

/// Whether inputs agree.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct ComparisonStatement {
    /// Number of significant differences.
    pub significant: usize,
    /// Number of differences.
    pub compared: usize,
}

impl Comparison {
    /// The three statements of the self.
    pub fn statements(&self) -> Statements<ComparisonStatement, Difference> {
        let significant = self.differences.iter().filter(|difference| difference.significant);
        let correct: Vec<Difference> = significant.cloned().collect();
        let step = if correct.is_empty() { NextStep::Nothing } else { NextStep::Repeat };
        Statements {
            good: ComparisonStatement { significant: correct.len(), compared: self.differences.len() },
            correct,
            further: Vec::new(),
            measure: step.into(),
        }
    }
}
