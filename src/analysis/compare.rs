//! What differs between sessions or models of one machine.

use abbe_apply::compare::results::Comparison;
use abbe_apply::compare::workspace::PLACES;
use abbe_apply::compare::{CompareOptions, Input, SIGNIFICANCE, compare_inputs};
use abbe_model::Diagnostic;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Analysis, Found, Given, Listener, unusable};
use crate::document::{Stated, StatedComparison, json};
use crate::report;
use crate::report::block::Report;
use crate::report::commands::Commands;

/// The options of a comparison.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct ComparisonOptions {
    /// Names of the inputs in the result.
    #[cfg_attr(feature = "command", arg(skip))]
    #[serde(skip_serializing)]
    pub names: Vec<String>,
    /// Set-up quantity that was not mounted again between the sessions: bar, workpiece_ball, spindle_ball, `none`; may be
    /// repeated [default: bars of the same name with the same prior].
    ///
    /// Example: --shared workpiece_ball
    #[cfg_attr(feature = "command", arg(long, value_name = "THING", allow_hyphen_values = true))]
    pub shared: Option<Vec<String>>,
    /// Probability of any false claim of a difference between two inputs.
    ///
    /// Example: --significance 0.01
    #[cfg_attr(feature = "command", arg(long, value_name = "P", default_value_t = SIGNIFICANCE))]
    pub significance: f64,
    /// Number of places along each axis: here of the volumetric error, 0 for none.
    ///
    /// Example: --places 7
    #[cfg_attr(feature = "command", arg(long, value_name = "N", default_value_t = PLACES))]
    pub places: usize,
}

impl Default for ComparisonOptions {
    fn default() -> Self {
        ComparisonOptions { names: Vec::new(), shared: None, significance: SIGNIFICANCE, places: PLACES }
    }
}

/// Compared sessions and models.
pub struct Compared {
    machine: String,
    with_workspace: bool,
    comparison: Comparison,
}

impl Analysis for Compared {
    const NAME: &'static str = "compare";
    type Options = ComparisonOptions;
    type Result = StatedComparison<'static>;

    fn run(given: &[Given<'_>], options: &ComparisonOptions, seed: u64, _: Listener<'_>) -> Result<Self, Diagnostic> {
        if given.len() < 2 || given.len() != options.names.len() {
            return Err(unusable("at least two inputs, each with its name, are expected".to_string(), ""));
        }
        let input = |given: &Given<'_>| match *given {
            Given::Session(session) => Input::Session(Box::new(session.clone())),
            Given::Model(model) => Input::Model(Box::new(model.clone())),
        };
        let inputs: Vec<Input> = given.iter().map(input).collect();
        let machine = inputs[0].machine().name.clone();
        let ComparisonOptions { names, shared, significance, places } = options.clone();
        let comparison = compare_inputs(names, inputs, &CompareOptions { significance, shared, places }, seed)?;
        Ok(Compared { machine, with_workspace: places > 0, comparison })
    }
}

impl Compared {
    fn stated(&self) -> StatedComparison<'_> {
        Stated { statements: self.comparison.statements(), result: &self.comparison }
    }
}

impl Found for Compared {
    fn result(&self) -> serde_json::Result<Value> {
        json(&self.stated())
    }

    fn report(&self, commands: &Commands, _: bool) -> Result<Report, Diagnostic> {
        Ok(report::compare::report(&self.machine, &self.stated(), self.with_workspace, commands))
    }
}
