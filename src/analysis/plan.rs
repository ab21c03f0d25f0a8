//! What planned tests identify, and how surely.

use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::session::limits::{LARGEST, MIN_UM};
use abbe_model::session::{Prior, Session};
use abbe_model::unit::InternalUnit;
use abbe_plan::results::PlanAnalysis;
use abbe_plan::{PlanOptions, analyse, collision, prepared, states};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Analysis, Found, Given, Listener, session_of, unusable};
use crate::document::{Stated, StatedPlan, json};
use crate::report::block::Report;
use crate::report::commands::Commands;
use crate::report::plan as present;
use crate::report::table::Table;

/// The options of the analysis of a plan.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct PlanningOptions {
    /// Standard deviation of a reading, µm, instead of the session's.
    ///
    /// Example: --noise-um 0.5
    #[cfg_attr(feature = "command", arg(long, value_name = "UM", allow_negative_numbers = true))]
    pub noise_um: Option<f64>,
    /// Use the planned movements even if there are data.
    #[cfg_attr(feature = "command", arg(long))]
    pub planned: bool,
    /// Do not screen undeclared effects.
    #[cfg_attr(feature = "command", arg(long))]
    pub no_effects: bool,
    /// Standard uncertainty of every set-up length with a prior, instead of the session's.
    ///
    /// Example: --setup-um 1
    #[cfg_attr(feature = "command", arg(long, value_name = "UM", allow_negative_numbers = true))]
    pub setup_um: Option<f64>,
    /// Use one mounted spindle ball for all tests.
    #[cfg_attr(feature = "command", arg(long))]
    pub one_spindle_ball: bool,
}

impl PlanningOptions {
    /// Gives a session the priors and the mount that the options state.
    pub fn set_up(&self, session: &mut Session) {
        for test in &mut session.tests {
            if self.one_spindle_ball {
                test.spindle_setup = "all tests".to_string();
            }
            let Some(um) = self.setup_um else { continue };
            for (prior, unknown) in test.priors.iter_mut().zip(test.station.kind().unknowns()) {
                if matches!(prior, Prior::Gaussian(_)) && unknown.unit == InternalUnit::Millimetre {
                    *prior = Prior::Gaussian(um * 1e-3);
                }
            }
        }
    }
}

/// An analysed plan.
pub struct Plan {
    /// The problem at the planned states.
    pub problem: Problem,
    /// What the readings would say.
    pub analysis: PlanAnalysis,
}

/// The problem of a session at its planned states.
///
/// # Errors
/// If the session cannot become a problem.
pub fn problem_of(session: &Session, options: &PlanOptions) -> Result<Problem, Diagnostic> {
    let (complete, noise) = prepared(session, options)?;
    states::problem_by_test(&complete, noise)
}

impl Plan {
    /// Analyses a session with its problem.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn of(session: &Session, problem: Problem, options: &PlanOptions) -> Result<Plan, Diagnostic> {
        let mut analysis = analyse(session, options)?;
        analysis.warnings.extend(collision::unchecked(session, options.planned_only));
        Ok(Plan { problem, analysis })
    }

    /// The analysis with its statements.
    pub fn stated(&self) -> StatedPlan<'_> {
        Stated { statements: self.analysis.statements(&self.problem), result: &self.analysis }
    }

    /// The change of the readings of a test by each error of the analysis, µm per unit of the error, row by row; `None`
    /// without such a test.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn sensitivity(&self, test: &str) -> Result<Option<Vec<f64>>, Diagnostic> {
        let problem = &self.problem;
        let Some(number) = problem.tests.iter().position(|known| known.name == test) else { return Ok(None) };
        let list = &problem.parameters.list;
        let of = |id: &str| list.iter().position(|parameter| parameter.id.to_string() == id);
        let columns: Vec<Option<usize>> = self.analysis.errors.iter().map(|error| of(&error.id)).collect();
        let values = problem.slot_values(&vec![0.0; list.len()]);
        let mut matrix: Vec<f64> = Vec::new();
        for block in problem.blocks().iter().filter(|block| block.test == number) {
            let rows = problem.rows(&values, block)?;
            for row in 0..rows.nrows() {
                let entry = |column: &Option<usize>| {
                    column.map_or(0.0, |j| 1e3 * rows[(row, j)] / list[j].unit.display_per_internal)
                };
                matrix.extend(columns.iter().map(entry));
            }
        }
        Ok(Some(matrix))
    }
}

impl Analysis for Plan {
    const NAME: &'static str = "plan";
    type Options = PlanningOptions;
    type Result = StatedPlan<'static>;

    fn run(given: &[Given<'_>], options: &PlanningOptions, _: u64, _: Listener<'_>) -> Result<Self, Diagnostic> {
        let mut session = session_of(given)?.clone();
        let lengths = [
            ("noise_um", options.noise_um, "the standard deviation of a reading"),
            ("setup_um", options.setup_um, "the standard uncertainty of a set-up length"),
        ];
        for (name, um, meaning) in lengths {
            if let Some(um) = um.filter(|um| !(MIN_UM..=LARGEST).contains(um)) {
                let message = format!("`{name}` is {um}; a number of µm from {MIN_UM:e} to {LARGEST:e} is expected");
                return Err(unusable(message, meaning));
            }
        }
        options.set_up(&mut session);
        let session = &session;
        let options = PlanOptions {
            noise_mm: options.noise_um.map(|um| um * 1e-3),
            planned_only: options.planned,
            effects: !options.no_effects,
            ..PlanOptions::default()
        };
        Plan::of(session, problem_of(session, &options)?, &options)
    }
}

impl Found for Plan {
    fn result(&self) -> serde_json::Result<Value> {
        json(&self.stated())
    }

    fn report(&self, commands: &Commands, figures: bool) -> Result<Report, Diagnostic> {
        present::analysis::report(&self.problem, &self.stated(), commands, figures)
    }

    fn tables(&self) -> Vec<Table> {
        let errors = &self.analysis.errors;
        vec![present::uncertainties(errors), present::sensitivity(errors), present::budgets(errors)]
    }
}
