//! `abbe fit --compensation`: estimated errors as compensation tables of controls.

use std::path::PathBuf;

use abbe::apply::compensation::curves::of_fit;
use abbe::apply::compensation::{MAX_POINTS, TableFormat, tables};
use abbe::identify::fit::Fit;
use abbe::identify::problem::Problem;
use clap::Args;

use super::failure::Failure;
use super::message::{Kind, tell};
use super::{controls, folder, output};
use crate::report::compensation::uncertainties;

/// The file of the uncertainties.
const UNCERTAINTIES: &str = "uncertainty.csv";

/// Arguments of commands that estimate errors.
#[derive(Args)]
pub struct CompensationArguments {
    /// Write compensation tables of the estimated error motions into a new folder.
    ///
    /// Example: --compensation tables --control linuxcnc
    #[arg(long, value_name = "DIR", requires = "control")]
    compensation: Option<PathBuf>,
    /// The control that reads the tables.
    ///
    /// Example: --compensation tables --control beckhoff
    #[arg(long, value_parser = controls::with_tables(), requires = "compensation")]
    control: Option<&'static TableFormat>,
    /// Number of points of a table, over the travel of the axis in the readings.
    ///
    /// Example: --compensation tables --control heidenhain --points 73
    #[arg(long, value_name = "N", default_value_t = 37, requires = "compensation")]
    points: usize,
}

impl CompensationArguments {
    /// Whether tables are requested.
    pub fn wanted(&self) -> bool {
        self.compensation.is_some()
    }

    /// Checks before the fit that the tables can be written.
    pub fn check(&self) -> Result<(), Failure> {
        let Some(folder) = &self.compensation else {
            return Ok(());
        };
        if !(2..=MAX_POINTS).contains(&self.points) {
            return Err(Failure::Other(format!(
                "`--points {}`: a number from 2 to {MAX_POINTS} is expected, the maximum of LinuxCNC and Heidenhain",
                self.points
            )));
        }
        folder::check(folder, None).map(|_| ())
    }

    /// Writes the tables if they are requested, and lists the errors that they do not contain.
    pub fn run(&self, problem: &Problem, fit: &Fit, shown: bool) -> Result<(), Failure> {
        let (Some(folder), Some(format)) = (&self.compensation, self.control) else {
            return Ok(());
        };
        let found = tables(&problem.session.machine, &of_fit(problem, fit), format, self.points);
        if found.files.is_empty() {
            let all = found.left_out.iter().map(|line| format!("\n  {line}")).collect::<String>();
            return Err(Failure::Other(format!(
                "no error can be compensated in this format: declare error motions as [[effect]], as \
                 `abbe trace --write` does, and fit again{all}"
            )));
        }
        let mut files: Vec<(String, Vec<u8>)> =
            found.files.into_iter().map(|(name, text)| (name, text.into_bytes())).collect();
        files.push((UNCERTAINTIES.to_string(), output::csv(&uncertainties(&found.uncertainties))?));
        folder::write(folder, &files, false, |_| Ok(()))?;
        if !shown {
            for line in &found.left_out {
                tell(Kind::Warning, &format!("not in the compensation tables: {line}"));
            }
            return Ok(());
        }
        say!("");
        for (name, _) in &files {
            say!("{}", folder.join(name).display());
        }
        for line in format.import {
            say!("  {line}");
        }
        say!("  standard uncertainty (k = 1) of each point: {UNCERTAINTIES}");
        for line in &found.left_out {
            say!("  not in the tables: {line}");
        }
        Ok(())
    }
}
