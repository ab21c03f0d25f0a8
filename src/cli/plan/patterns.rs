//! `abbe plan SESSION --patterns FILE.csv`: the change of the readings by each error alone.

use std::path::PathBuf;

use abbe::identify::patterns::{Pattern, Patterns, patterns, usual_sizes};
use abbe::identify::quantity::Given;
use abbe::model::files::SourceMap;
use abbe::model::session::Session;
use clap::Args;

use crate::cli::failure::Failure;
use crate::cli::{CommonArguments, json, output, table};

/// Trace patterns: the change of the readings by each error alone.
#[derive(Args)]
pub struct PatternArguments {
    /// Write the change of each reading by each error alone (its trace pattern), by the exact chain.
    ///
    /// Example: --patterns patterns.csv
    #[arg(
        long,
        value_name = "FILE.csv",
        conflicts_with_all = ["improve", "separate", "range", "report", "plots", "clearance_mm", "noise_um", "setup_um"]
    )]
    patterns: Option<PathBuf>,
    /// Size of an error for --patterns; may be repeated
    /// [default: all errors that the session estimates, 10 µm and 0.01°].
    ///
    /// Example: --patterns patterns.csv --error EY0A=10um --error EB0A=0.01deg
    #[arg(long = "error", value_name = "NAME=SIZE", allow_hyphen_values = true, requires = "patterns")]
    errors: Vec<String>,
}

impl PatternArguments {
    /// The file of the patterns.
    pub fn file(&self) -> Option<&PathBuf> {
        self.patterns.as_ref()
    }

    /// Whether patterns are requested.
    pub fn asked(&self) -> bool {
        self.patterns.is_some()
    }

    /// Writes the patterns and prints their sizes.
    pub fn run(
        &self,
        (session, sources): (&Session, &SourceMap),
        common: &CommonArguments,
        tables: bool,
    ) -> Result<(), Failure> {
        let given: Vec<Given> = self.errors.iter().map(|text| Given::parse(text)).collect::<Result<_, _>>()?;
        let given = if given.is_empty() { usual_sizes(session) } else { given };
        let found = patterns(session, &given)?;
        if let Some(path) = &self.patterns {
            output::write_whole(path, &csv(&found, session)?)?;
        }
        if tables {
            print(&found);
        }
        if let Some(path) = &common.json {
            let result = PatternSizes { patterns: found.patterns };
            json::write_of_session(path, sources, common.seed, &result)?;
        }
        Ok(())
    }
}

/// Change of the readings of each test by each error alone.
#[derive(serde::Serialize, schemars::JsonSchema)]
pub struct PatternSizes {
    /// Test by test, error by error.
    patterns: Vec<Pattern>,
}

/// Prints the sizes of the patterns.
fn print(found: &Patterns) {
    let number = |value: f64| {
        let rounded = format!("{value:.3}");
        if rounded == "-0.000" { "0.000".to_string() } else { rounded }
    };
    let rows: Vec<Vec<String>> = found
        .patterns
        .iter()
        .map(|pattern| {
            vec![
                pattern.test.clone(),
                pattern.error.clone(),
                format!("{} {}", pattern.size, table::unit(&pattern.unit)),
                number(pattern.largest_um),
                number(pattern.mean_um),
                number(pattern.standard_deviation_um),
            ]
        })
        .collect();
    table::print(&["test", "error", "size", "largest, µm", "mean, µm", "standard deviation, µm"], &rows);
}

/// One line per reading and error: test, error and its size, run, positions of the axes, deviation.
fn csv(found: &Patterns, session: &Session) -> Result<Vec<u8>, Failure> {
    let axes = &session.machine.axes;
    let mut header: Vec<String> = ["test", "error", "size", "unit", "run"].map(String::from).to_vec();
    header.extend(axes.iter().map(|axis| axis.column("")));
    match session.instrument.coordinates() {
        1 => header.push("deviation_um".into()),
        _ => header.extend(["x", "y", "z"].map(|k| format!("deviation_{k}_um"))),
    }
    let mut rows = Vec::new();
    for pattern in &found.patterns {
        let Some((name, states)) = found.tests.iter().find(|(name, _)| *name == pattern.test) else {
            continue;
        };
        for (row, deviations) in pattern.deviations_um.chunks(states.coordinates.max(1)).enumerate() {
            let run = states.run.get(row).map_or(String::new(), ToString::to_string);
            let mut cells =
                vec![name.clone(), pattern.error.clone(), pattern.size.to_string(), pattern.unit.clone(), run];
            // Rounded to 1e-9 to omit rounding errors of the last digits.
            let shown = |position: f64| (position * 1e9).round() / 1e9 + 0.0;
            let at = axes.iter().zip(&states.positions);
            cells.extend(at.map(|(axis, column)| shown(axis.kind.to_display(column[row])).to_string()));
            cells.extend(deviations.iter().map(|deviation| format!("{deviation:.6}")));
            rows.push(cells);
        }
    }
    output::csv(&header, rows)
}
