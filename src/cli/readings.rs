//! Options of the tables of readings of a fit.

use std::path::PathBuf;

use abbe::identify::fit::Fit;
use abbe::identify::problem::Problem;
use abbe::model::Diagnostic;
use clap::Args;

use super::output;
use crate::report::readings;

/// Options of the tables of readings of a fit.
#[derive(Args)]
pub struct ReadingArguments {
    /// Write readings and residuals of an R-test by direction: of the sensors, along X, Y and Z, radial, tangential and
    /// axial.
    ///
    /// Example: --views views.csv
    #[arg(long, value_name = "FILE.csv")]
    pub views: Option<PathBuf>,
    /// Write reading and residual of every reading as CSV: test, run, line, axis positions, reading, residual in µm,
    /// residual over the noise standard deviation, and whether the reading counts or is an outlier; of the full fit.
    ///
    /// Example: --residuals residuals.csv
    #[arg(long, value_name = "FILE.csv")]
    pub residuals: Option<PathBuf>,
}

impl ReadingArguments {
    /// Writes the tables that are asked for.
    pub fn write(&self, problem: &Problem, fit: &Fit) -> Result<(), Diagnostic> {
        if let Some(path) = &self.views {
            output::write_whole(path, &output::csv(&readings::by_direction(problem, fit)?)?)?;
        }
        if let Some(path) = &self.residuals {
            output::write_whole(path, &output::csv(&readings::residuals(problem, fit))?)?;
        }
        Ok(())
    }
}
