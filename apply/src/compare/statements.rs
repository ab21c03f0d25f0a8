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
    /// The inputs whose differences are not judged.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_judged: Vec<String>,
    /// The volumetric error of each input over the common range, rms in µm; empty if not evaluated.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub volumetric_rms_um: Vec<f64>,
}

impl Comparison {
    /// The three statements of the self.
    pub fn statements(&self) -> Statements<ComparisonStatement, Difference> {
        let significant = self.differences.iter().filter(|difference| difference.significant);
        let changed: Vec<Difference> = significant.cloned().collect();
        let step = match (self.not_judged.is_empty(), changed.is_empty()) {
            (false, _) => NextStep::Trace,
            (true, true) => NextStep::Nothing,
            (true, false) => NextStep::Repeat,
        };
        Statements {
            good: ComparisonStatement {
                significant: changed.len(),
                compared: self.differences.len(),
                not_judged: self.not_judged.iter().map(|own| own.input.clone()).collect(),
                volumetric_rms_um: self.workspace.iter().map(|volume| volume.rms_um).collect(),
            },
            correct: Vec::new(),
            changed,
            further: Vec::new(),
            measure: step.into(),
        }
    }
}
