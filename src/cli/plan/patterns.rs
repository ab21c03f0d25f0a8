//! `abbe plan SESSION --patterns FILE.csv`: the change of the readings by each error alone.

use std::path::PathBuf;

use abbe::identify::patterns::{Patterns, patterns, usual_sizes};
use abbe::identify::quantity::Given;
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use clap::Args;

use crate::cli::output;
use crate::report::patterns as present;

/// Trace patterns: the change of the readings by each error alone.
#[derive(Args)]
pub struct PatternArguments {
    /// Write the change of each reading by each error alone (its trace pattern), by the exact chain.
    ///
    /// Example: --patterns patterns.csv
    #[arg(
        long,
        value_name = "FILE.csv",
        conflicts_with_all = ["improve", "separate", "range", "device_mm", "noise_um", "setup_um"]
    )]
    pub patterns: Option<PathBuf>,
    /// Value of an error; may be repeated [default of --patterns: all errors that the session estimates, 10 µm and 0.01°].
    ///
    /// Example: --patterns patterns.csv --error EY0A=10um --error EB0A=0.01deg
    #[arg(long = "error", value_name = "NAME=VALUE", allow_hyphen_values = true, requires = "patterns")]
    errors: Vec<String>,
}

impl PatternArguments {
    /// Writes the patterns.
    pub fn run(&self, session: &Session) -> Result<Patterns, Diagnostic> {
        let given: Vec<Given> = self.errors.iter().map(|text| Given::parse(text)).collect::<Result<_, _>>()?;
        let given = if given.is_empty() { usual_sizes(session) } else { given };
        let found = patterns(session, &given)?;
        if let Some(path) = &self.patterns {
            output::write_whole(path, &output::csv(&present::readings(&found, session))?)?;
        }
        Ok(found)
    }
}
