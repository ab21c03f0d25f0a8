//! `abbe plan SESSION --patterns FILE.csv`.

use std::path::{Path, PathBuf};

use abbe::identify::patterns::{patterns, usual_sizes};
use abbe::identify::quantity::Given;
use abbe::model::session::Session;
use clap::Args;

use crate::cli::failure::Failure;
use crate::cli::{output, table};

/// What each error alone does to the readings.
#[derive(Args)]
pub struct PatternArguments {
    /// Write what each error alone does to each reading: its trace pattern, by the exact chain.
    #[arg(long, value_name = "FILE.csv")]
    patterns: Option<PathBuf>,
    /// Size of an error whose pattern is wanted; may be repeated. Without it: the session's unknown errors, 10 µm and 0.01°.
    #[arg(
        long = "error",
        value_name = "NAME=SIZE",
        allow_hyphen_values = true,
        requires = "patterns"
    )]
    errors: Vec<String>,
}

impl PatternArguments {
    /// Whether patterns are asked for.
    pub fn asked(&self) -> bool {
        self.patterns.is_some()
    }

    /// Writes the patterns and prints how large they are.
    pub fn run(&self, session: &Session, json: Option<&Path>) -> Result<(), Failure> {
        let given: Vec<Given> = self
            .errors
            .iter()
            .map(|text| Given::parse(text))
            .collect::<Result<_, _>>()?;
        let given = if given.is_empty() {
            usual_sizes(session)
        } else {
            given
        };
        let found = patterns(session, &given)?;
        if let Some(path) = &self.patterns {
            output::write_whole(path, found.csv(session).as_bytes())?;
        }
        let number = |value: f64| {
            let rounded = format!("{value:.3}");
            if rounded == "-0.000" {
                "0.000".to_string()
            } else {
                rounded
            }
        };
        let rows: Vec<Vec<String>> = found
            .patterns
            .iter()
            .map(|pattern| {
                vec![
                    pattern.test.clone(),
                    pattern.error.clone(),
                    format!("{} {}", pattern.size, pattern.unit),
                    number(pattern.largest_um),
                    number(pattern.mean_um),
                    number(pattern.rms_um),
                ]
            })
            .collect();
        table::print(
            &[
                "test",
                "error",
                "size",
                "largest, µm",
                "mean, µm",
                "rms about it, µm",
            ],
            &rows,
        );
        if let Some(path) = json {
            output::write_json(path, &found.patterns)?;
        }
        Ok(())
    }
}
