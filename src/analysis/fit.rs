//! The fit of a session.

use abbe_identify::fit::{Fit, assume};
use abbe_identify::plausibility::accepted;
use abbe_identify::problem::Problem;
use abbe_identify::results::{Estimate, Statements};
use abbe_model::Diagnostic;
use abbe_plan::attainable;
use abbe_trace::SessionFit;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Analysis, Found, Given, Listener, session_of};
use crate::document::{Stated, StatedFit, json};
use crate::report;
use crate::report::block::Report;
use crate::report::commands::Commands;
use crate::report::parameters::{Estimates, table};
use crate::report::table::Table;

/// The options of a fit.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct FitOptions {
    /// Explanation that is accepted on the user's word: a declared effect, or one of its aliases, which then takes its
    /// place. Uncertainties do not cover the others; every output says so. May be repeated.
    ///
    /// Example: --assume EZC~C:h2
    #[cfg_attr(feature = "command", arg(long, value_name = "EFFECT", allow_hyphen_values = true))]
    pub assume: Vec<String>,
    /// Accept readings that contradict the machine, such as axes more than 5 % of a link beside their place. Without it they
    /// are refused where another reading of the file explains them.
    #[cfg_attr(feature = "command", arg(long))]
    pub allow_implausible: bool,
}

impl Analysis for SessionFit {
    const NAME: &'static str = "fit";
    type Options = FitOptions;
    type Result = StatedFit<'static>;

    fn run(given: &[Given<'_>], options: &FitOptions, seed: u64, _: Listener<'_>) -> Result<Self, Diagnostic> {
        let found = SessionFit::of(&assume(session_of(given)?, &options.assume)?, seed)?;
        if !options.allow_implausible {
            accepted(&found.result.plausibility)?;
        }
        Ok(found)
    }
}

impl Found for SessionFit {
    fn result(&self) -> serde_json::Result<Value> {
        json(&stated(self))
    }

    fn report(&self, commands: &Commands, figures: bool) -> Result<Report, Diagnostic> {
        report::fit::report(&self.problem, &self.fit, &stated(self), commands, figures)
    }

    fn tables(&self) -> Vec<Table> {
        estimates(&self.problem, &self.fit, &self.result.model.parameters)
    }

    fn fits(&self) -> Vec<(&Problem, &Fit)> {
        vec![(&self.problem, &self.fit)]
    }
}

fn stated(found: &SessionFit) -> StatedFit<'_> {
    let mut statements = Statements::of_fit(&found.problem, &found.result);
    statements.measure.step = attainable(&found.problem, statements.measure.step);
    Stated { statements, result: &found.result }
}

/// The tables of estimates: errors and effects, then the set-up.
pub fn estimates(problem: &Problem, fit: &Fit, of: &[Estimate]) -> Vec<Table> {
    let estimates = Estimates::new(problem, fit, of);
    let setup = (!estimates.setup.is_empty()).then(|| estimates.setup_table(None));
    std::iter::once(table(&estimates.errors, None)).chain(setup).collect()
}
