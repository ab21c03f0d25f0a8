//! `abbe history`: the parameters of machines over time.

use std::path::PathBuf;

use abbe::fleet::compensations;
use abbe::fleet::history::{FleetHistory, history};
use abbe::fleet::store::Store;
use abbe::identify::history::HistoryOptions;
use abbe::model::files;
use clap::Args;

use super::failure::Failure;
use super::json::{self, Origin};
use super::output::{self, Outputs};
use super::{folder, json::command_line};
use crate::printers::page;
use crate::report::history as present;
use crate::report::pages::document::Document;
use crate::report::pages::history as report;
use crate::report::provenance::Provenance;
use crate::report::table::Table;

/// Examples of `abbe history`.
pub const HELP: &str = "DIR is the folder of `abbe run`. A session counts if its [about] has a `date`. Each parameter \
of each machine is \
tested for a drift and for steps; the false discovery rate holds over all of them together. A change that agrees with \
a known compensation \
(--compensations) is named as one. Effects are compared by their alias sets: the same fault under two names is one fault.

A CSV file for --compensations has the columns machine_id, date, parameter, change, unit: the change of an error is \
that which the table \
takes away, with its sign.

Examples:
  abbe run sessions/hermle-c600u/measured/session.toml --out results --no-trace
  abbe history results
  abbe history results --report history.html --json history.json";

/// Rows of a list that the first screen shows.
const MAX_ROWS: usize = 12;

/// `abbe history DIR`
#[derive(Args)]
pub struct HistoryArguments {
    /// Folder of the results.
    #[arg(value_name = "DIR")]
    results: PathBuf,
    /// Identifier of one machine.
    ///
    /// Example: --machine SN-0412
    #[arg(long, value_name = "ID", allow_hyphen_values = true)]
    machine: Option<String>,
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
    /// CSV file of known compensations.
    ///
    /// Example: --compensations compensations.csv
    #[arg(long, value_name = "FILE")]
    compensations: Option<PathBuf>,
    /// List everything that the first screen folds.
    #[arg(long)]
    all: bool,
    /// Write a report as one HTML file: of the fleet, or of the machine of --machine.
    ///
    /// Example: --report history.html
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// New folder for a page of the fleet, index.html, and a page of each machine.
    ///
    /// Example: --pages pages
    #[arg(long, value_name = "DIR")]
    pages: Option<PathBuf>,
    /// Write the result as JSON; `-` writes it, and nothing else, to standard output.
    ///
    /// Example: --json history.json
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs `abbe history`.
pub fn run(arguments: &HistoryArguments, quiet: bool) -> Result<(), Failure> {
    let outputs = Outputs::new(arguments.json.iter().chain(&arguments.report))?;
    if !(arguments.false_discovery_rate > 0.0 && arguments.false_discovery_rate < 1.0) {
        return Err(Failure::CommandLine("`--false-discovery-rate`: a number between 0 and 1 is expected".into()));
    }
    if !(arguments.tolerance_u > 0.0 && arguments.tolerance_u.is_finite()) {
        return Err(Failure::CommandLine("`--tolerance-u`: a positive number is expected".into()));
    }
    if let Some(path) = &arguments.pages {
        folder::check(path, None)?;
    }
    let store = Store::existing(&arguments.results)?;
    let read = |file: &PathBuf| files::text(file, "the file of compensations");
    let known = arguments.compensations.as_ref().map(read).transpose()?;
    let options = HistoryOptions {
        false_discovery_rate: arguments.false_discovery_rate,
        tolerance_u: arguments.tolerance_u,
        compensations: known.as_ref().map(compensations::of_source).transpose()?.unwrap_or_default(),
    };
    let found = history(&store, arguments.machine.as_deref(), &options)?;
    if outputs.tables(quiet) {
        print(&found, arguments.all);
    }
    if let Some(path) = &arguments.json {
        let stamps = known.iter().filter_map(|source| source.stamp.as_ref());
        json::write(path, Origin::of_files(stamps), None, &found)?;
    }
    if let Some(path) = &arguments.report {
        let document = match (&arguments.machine, found.history.machines.first()) {
            (Some(_), Some(machine)) => report::machine(machine, &found.conformity),
            _ => report::fleet(&found),
        };
        output::write_whole(path, html(&document)?.as_bytes())?;
    }
    if let Some(path) = &arguments.pages {
        let mut files = vec![("index.html".to_string(), html(&report::fleet(&found))?)];
        for (number, machine) in found.history.machines.iter().enumerate() {
            let plain = |sign: char| if sign.is_alphanumeric() || "-_.".contains(sign) { sign } else { '_' };
            let name: String = machine.machine_id.chars().map(plain).collect();
            // The number keeps machines apart whose identifiers differ in other signs or in case alone.
            files.push((format!("{:04}-{name}.html", number + 1), html(&report::machine(machine, &found.conformity))?));
        }
        folder::write(path, &files, false, |_| Ok(()))?;
    }
    Ok(())
}

fn html(document: &Document) -> Result<String, Failure> {
    let call = command_line();
    let options = call.options.iter().map(|(name, value)| format!(" --{} {value}", name.replace('_', "-")));
    let provenance = Provenance {
        command: format!("abbe {}{}", call.command, options.collect::<String>()),
        seed: 0,
        inputs: Vec::new(),
        about: Vec::new(),
    };
    page::html(document, &provenance).map_err(Failure::Other)
}

fn print(found: &FleetHistory, all: bool) {
    say!("{}", present::headline(found));
    let machines = &found.history.machines;
    let tables = [
        (present::machines(found), "Machines"),
        (present::drifts(machines), "Drifts"),
        (present::changes(machines), "Changes"),
        (present::conformity(&found.conformity), "Conformity (rule of ISO 14253-1, limits of each session)"),
        (present::faults(found), "Faults"),
        (present::not_used(&found.not_used), "Not used"),
    ];
    for (mut table, title) in tables.into_iter().filter(|(table, _)| !table.rows.is_empty()) {
        title.clone_into(&mut table.title);
        print_rows(table, all);
    }
}

fn print_rows(mut table: Table, all: bool) {
    let rows = table.rows.len();
    if !all {
        table.rows.truncate(MAX_ROWS);
    }
    let more = rows - table.rows.len();
    output::print(&table);
    if more > 0 {
        say!("  … {more} more; --all lists them");
    }
}
