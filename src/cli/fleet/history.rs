//! `abbe fleet history`: the parameters of machines over time.

use std::path::PathBuf;

use abbe::document::StatedHistory;
use abbe::files;
use abbe::fleet::compensations;
use abbe::fleet::history::statements::statements;
use abbe::fleet::history::{HistoryOptions, history};
use abbe::fleet::store::Store;
use abbe::model::Diagnostic;
use clap::Args;

use crate::cli::failure::command_line;
use crate::cli::folder;
use crate::cli::results::{OutputArguments, Read};
use crate::printers::page;
use crate::report::block::Report;
use crate::report::history as report;

/// Examples of `abbe fleet history`.
pub const HELP: &str = include_str!("../help/history.txt");

/// `abbe fleet history DIR`
#[derive(Args)]
pub struct HistoryArguments {
    /// Folder of the results.
    #[arg(value_name = "DIR")]
    results: PathBuf,
    /// Identifier of one machine.
    ///
    /// Example: --machine-id SN-0412
    #[arg(long, value_name = "ID", allow_hyphen_values = true)]
    machine_id: Option<String>,
    /// False discovery rate over all parameters of all machines.
    ///
    /// Example: --false-discovery-rate 0.01
    #[arg(long, value_name = "Q", default_value_t = HistoryOptions::default().false_discovery_rate)]
    false_discovery_rate: f64,
    /// Change of a parameter, in its standard uncertainties, before which the next check is due.
    ///
    /// Example: --tolerance-u 6
    #[arg(long, value_name = "K", default_value_t = HistoryOptions::default().tolerance_u)]
    tolerance_u: f64,
    /// CSV file of known changes by compensation.
    ///
    /// Example: --known-changes changes.csv
    #[arg(long, value_name = "FILE")]
    known_changes: Option<PathBuf>,
    /// New folder for a page of the fleet, index.html, and a page of each machine.
    ///
    /// Example: --pages pages
    #[arg(long, value_name = "DIR")]
    pages: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArguments,
}

/// Characters of an identifier in the name of a page: a name of 255 bytes is the longest of most file systems.
const LONGEST_NAME: usize = 60;

/// Runs `abbe fleet history`.
pub fn run(arguments: &HistoryArguments) -> Result<(), Diagnostic> {
    let outputs = arguments.output.prepared(&[])?;
    if !(arguments.false_discovery_rate > 0.0 && arguments.false_discovery_rate < 1.0) {
        return Err(command_line("`--false-discovery-rate`: a number between 0 and 1 is expected"));
    }
    if !(arguments.tolerance_u > 0.0 && arguments.tolerance_u.is_finite()) {
        return Err(command_line("`--tolerance-u`: a positive number is expected"));
    }
    if let Some(path) = &arguments.pages {
        folder::check(path, arguments.output.folder.force)?;
    }
    let store = Store::existing(&arguments.results)?;
    let text = |file: &PathBuf| files::text(file, "the file of compensations");
    let known = arguments.known_changes.as_ref().map(text).transpose()?;
    let options = HistoryOptions {
        false_discovery_rate: arguments.false_discovery_rate,
        tolerance_u: arguments.tolerance_u,
        compensations: known.as_ref().map(compensations::of_source).transpose()?.unwrap_or_default(),
    };
    let found = history(&store, arguments.machine_id.as_deref(), &options)?;
    let read = Read::files(known.iter().filter_map(|source| source.stamp.as_ref()));
    let stated = StatedHistory::of_history(&found);
    let report = match (&arguments.machine_id, found.machines.first()) {
        (Some(_), Some(machine)) => report::machine(machine, &stated.statements, &found.conformity),
        _ => report::fleet(&stated),
    };
    arguments.output.put(&outputs, &report, &stated, &read)?;
    let Some(path) = &arguments.pages else { return Ok(()) };
    let html = |report: &Report| page::html(report, &read.provenance()).map_err(Diagnostic::other);
    let mut files = vec![("index.html".to_string(), html(&report::fleet(&stated))?)];
    for (number, machine) in found.machines.iter().enumerate() {
        let plain = |sign: char| if sign.is_alphanumeric() || "-_.".contains(sign) { sign } else { '_' };
        let name: String = machine.machine_id.chars().map(plain).take(LONGEST_NAME).collect();
        // The number keeps machines apart whose identifiers differ in other signs or in case alone.
        let own = report::machine(machine, &statements(std::slice::from_ref(machine)), &found.conformity);
        files.push((format!("{:04}-{name}.html", number + 1), html(&own)?));
    }
    folder::write(path, &files, arguments.output.folder.force, |_| Ok(()))
}
