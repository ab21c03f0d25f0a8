//! `--monte-carlo`: propagation of distributions.

use abbe::identify::self_calibration::MonteCarlo;
use abbe::model::Diagnostic;
use clap::Args;

use super::failure::command_line;

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
    pub fn refuse(&self) -> Result<(), Diagnostic> {
        match self.monte_carlo {
            None => Ok(()),
            Some(_) => Err(command_line(
                "`--monte-carlo` works with the full fit and with `--method self-calibration`: leave out `--method` or `--monte-carlo`",
            )),
        }
    }

    /// The requested Monte Carlo propagation.
    pub fn draws(&self, seed: u64) -> Result<Option<MonteCarlo>, Diagnostic> {
        let Some(runs) = self.monte_carlo else {
            return Ok(None);
        };
        if runs > MAX_RUNS {
            return Err(Diagnostic::other(format!("`--monte-carlo {runs}`: {MAX_RUNS} runs are the most")));
        }
        if runs < MIN_RUNS {
            return Err(Diagnostic::other(format!(
                "`--monte-carlo {runs}`: at least {MIN_RUNS} runs are needed for the coverage intervals"
            )));
        }
        if !(self.coverage > 0.5 && self.coverage < 0.9999) {
            return Err(Diagnostic::other(format!(
                "`--coverage {}`: a probability between 0.5 and 0.9999 is expected",
                self.coverage
            )));
        }
        Ok(Some(MonteCarlo { runs, seed, coverage: self.coverage }))
    }
}
