//! The fit of a session.

use abbe_identify::fit::{Fit, assume, base, tpoint};
use abbe_identify::plausibility::accepted;
use abbe_identify::problem::Problem;
use abbe_identify::propagation::add_monte_carlo;
use abbe_identify::results::{Estimate, Statements};
use abbe_identify::self_calibration::MonteCarlo;
use abbe_model::Diagnostic;
use abbe_plan::attainable;
use abbe_trace::SessionFit;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Analysis, Found, Given, Listener, session_of, unusable};
use crate::document::{Stated, StatedFit, json};
use crate::report;
use crate::report::block::Report;
use crate::report::commands::Commands;
use crate::report::parameters::{Estimates, table};
use crate::report::table::Table;

/// The options of a fit.
#[derive(Clone, Debug, Serialize, Deserialize)]
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
    /// Print the base parameters: a minimal set of numbers with u that predicts the same readings, and the parameters
    /// that are held at nominal because the readings do not separate them.
    #[cfg_attr(feature = "command", arg(long))]
    pub base: bool,
    /// Print the terms of a pointing model that the fit is equivalent to: IA, IE, AN, AW, CA, NPAE, TF, TX, harmonics.
    ///
    /// Example: --terms tpoint
    #[cfg_attr(feature = "command", arg(long, value_enum, value_name = "MODEL"))]
    pub terms: Option<Terms>,
    /// Propagate distributions by Monte Carlo with this number of runs (JCGM 101), for the full fit and for a
    /// self-calibration.
    ///
    /// Example: --monte-carlo 100000
    #[cfg_attr(feature = "command", arg(long, value_name = "RUNS"))]
    pub monte_carlo: Option<u64>,
    /// Coverage probability of the intervals of --monte-carlo.
    ///
    /// Example: --monte-carlo 10000 --coverage 0.99
    #[cfg_attr(feature = "command", arg(long, value_name = "P", requires = "monte_carlo", default_value_t = COVERAGE))]
    pub coverage: f64,
}

/// The pointing model whose terms are stated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Terms {
    /// Those of TPOINT.
    #[cfg_attr(feature = "command", value(name = "tpoint"))]
    TPoint,
}

/// Coverage probability of intervals, unless another is stated.
const COVERAGE: f64 = 0.95;
/// Minimum number of runs for 95 % intervals (JCGM 101, 7.2.2: 10⁴, so that 200 runs lie beyond each end).
const MIN_RUNS: u64 = 10_000;
/// Maximum number of runs: the coverage intervals have five digits then.
const MAX_RUNS: u64 = 1_000_000_000;

impl Default for FitOptions {
    fn default() -> Self {
        FitOptions {
            assume: Vec::new(),
            allow_implausible: false,
            base: false,
            terms: None,
            monte_carlo: None,
            coverage: COVERAGE,
        }
    }
}

impl FitOptions {
    /// The Monte Carlo propagation that is asked for.
    ///
    /// # Errors
    /// If it has too few or too many runs, or no such coverage.
    pub fn draws(&self, seed: u64) -> Result<Option<MonteCarlo>, Diagnostic> {
        let FitOptions { monte_carlo: Some(runs), coverage, .. } = *self else { return Ok(None) };
        let found = format!("`monte_carlo` is {runs}");
        if runs > MAX_RUNS {
            return Err(unusable(format!("{found}; {MAX_RUNS} runs are the most"), ""));
        }
        if runs < MIN_RUNS {
            let needed = format!("at least {MIN_RUNS} runs are needed for the coverage intervals");
            return Err(unusable(format!("{found}; {needed}"), ""));
        }
        if !(coverage > 0.5 && coverage < 0.9999) {
            let expected = "a probability between 0.5 and 0.9999 is expected";
            return Err(unusable(format!("`coverage` is {coverage}; {expected}"), ""));
        }
        Ok(Some(MonteCarlo { runs, seed, coverage }))
    }
}

impl Analysis for SessionFit {
    const NAME: &'static str = "fit";
    type Options = FitOptions;
    type Result = StatedFit<'static>;

    fn run(given: &[Given<'_>], options: &FitOptions, seed: u64, _: Listener<'_>) -> Result<Self, Diagnostic> {
        let draws = options.draws(seed)?;
        let mut found = SessionFit::of(&assume(session_of(given)?, &options.assume)?, seed)?;
        let SessionFit { problem, fit, result } = &mut found;
        if !options.allow_implausible {
            accepted(&result.plausibility)?;
        }
        if let Some(draws) = draws {
            add_monte_carlo(problem, fit, &draws, result)?;
        }
        if options.base {
            result.base = Some(base::report(problem, fit)?);
        }
        if let Some(Terms::TPoint) = options.terms {
            result.tpoint = Some(tpoint::report(problem, fit)?);
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
