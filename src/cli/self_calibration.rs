//! `abbe fit --method self-calibration`: rotary axis, linear axes and artefact separately.

use abbe::identify::results::ParameterResult;
use abbe::identify::self_calibration::{self, MonteCarlo, SelfCalibration};
use abbe::model::files::SourceMap;
use abbe::model::session::Session;
use abbe::model::words::counted;
use clap::Args;

use super::failure::Failure;
use super::{CommonArguments, message, output, screen};
use crate::report::fit::noise;
use crate::report::number::micrometres;
use crate::report::{parameters, self_calibration as present};

/// Monte Carlo propagation of a self-calibration or of the full fit.
#[derive(Args)]
pub struct DrawArguments {
    /// Propagate distributions by Monte Carlo with this number of runs (JCGM 101), for the full fit and for a
    /// self-calibration.
    ///
    /// Example: --monte-carlo 100000
    #[arg(long, value_name = "RUNS")]
    monte_carlo: Option<u64>,
    /// Coverage probability of the intervals of --monte-carlo.
    ///
    /// Example: --monte-carlo 10000 --coverage 0.99
    #[arg(long, value_name = "P", requires = "monte_carlo", default_value_t = 0.95)]
    coverage: f64,
}

/// Minimum number of runs for 95 % intervals (JCGM 101, 7.2.2: 10⁴, so that 200 runs lie beyond each end).
const MIN_RUNS: u64 = 10_000;
/// Maximum number of runs: the coverage intervals have five digits then.
const MAX_RUNS: u64 = 1_000_000_000;

impl DrawArguments {
    /// Refuses Monte Carlo with another method.
    pub fn refuse(&self) -> Result<(), Failure> {
        match self.monte_carlo {
            None => Ok(()),
            Some(_) => Err(Failure::CommandLine(
                "`--monte-carlo` works with the full fit and with `--method self-calibration`: leave out `--method` or `--monte-carlo`"
                    .into(),
            )),
        }
    }

    /// The requested Monte Carlo propagation.
    pub fn draws(&self, seed: u64) -> Result<Option<MonteCarlo>, Failure> {
        let Some(runs) = self.monte_carlo else {
            return Ok(None);
        };
        if runs > MAX_RUNS {
            return Err(Failure::Other(format!("`--monte-carlo {runs}`: {MAX_RUNS} runs are the most")));
        }
        if runs < MIN_RUNS {
            return Err(Failure::Other(format!(
                "`--monte-carlo {runs}`: at least {MIN_RUNS} runs are needed for the coverage intervals"
            )));
        }
        if !(self.coverage > 0.5 && self.coverage < 0.9999) {
            return Err(Failure::Other(format!(
                "`--coverage {}`: a probability between 0.5 and 0.9999 is expected",
                self.coverage
            )));
        }
        Ok(Some(MonteCarlo { runs, seed, coverage: self.coverage }))
    }
}

/// Runs `abbe fit --method self-calibration`.
pub fn run(
    (session, sources): (&Session, &SourceMap),
    draws: &DrawArguments,
    common: &CommonArguments,
    tables: bool,
) -> Result<(), Failure> {
    let draws = draws.draws(common.seed)?;
    let calibration = self_calibration::calibrate(session)?;
    let result = calibration.report(session, draws.as_ref());
    if tables {
        print(&result);
    }
    message::print_warnings(&result.warnings);
    common.write_json(sources, &result)
}

fn print(result: &SelfCalibration) {
    say!(
        "{}, {}, residual {}",
        counted(result.readings, "reading"),
        noise(result.noise_um, result.noise_source),
        micrometres(result.rms_um)
    );
    say!(
        "{} of four functions, numerical rank {} without boundary conditions",
        counted(result.value_count, "value"),
        result.rank_without_conditions
    );
    say!(
        "{} under {}, numerical rank {}",
        counted(result.parameter_count, "parameter"),
        counted(result.conditions.len(), "condition"),
        result.rank
    );
    for condition in &result.conditions {
        say!("  {condition}");
    }
    output::print(&present::functions(&result.functions).titled("Functions, µm, value ± standard uncertainty"));
    let estimates =
        |list: &[&ParameterResult], title: &str| output::print(&parameters::table(list, None).titled(title));
    if let Some(radius) = &result.radius {
        say!("");
        estimates(&[radius], "");
    }
    if !result.parameters.is_empty() {
        let axis = &result.axis;
        let title = format!("Position of axis {axis}, by the least-squares circle of its displacements");
        estimates(&result.parameters.iter().collect::<Vec<_>>(), &title);
        estimates(&result.parameters_by_turn.iter().collect::<Vec<_>>(), "The same, from the angles of rotation");
        let title = format!("Error motions of axis {axis}, µm");
        output::print(&present::functions(&result.error_motions).titled(title));
    }
    screen::print_missing(&result.unobservable, &[], &[], true);
    if let Some(drawn) = &result.monte_carlo {
        output::print(&present::intervals(drawn).titled(format!(
            "Monte Carlo, {}, seed {}; coverage intervals of {} %, µm",
            counted(drawn.runs, "run"),
            drawn.seed,
            drawn.coverage_probability * 100.0
        )));
    }
}
