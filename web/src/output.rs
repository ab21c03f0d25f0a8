//! What every result gives: its document, its report, its files.

use abbe::document::{Call, Document};
use abbe::identify::fit::Fit;
use abbe::identify::model_file::IdentifiedModel;
use abbe::identify::problem::Problem;
use abbe::printers::csv;
use abbe::printers::page;
use abbe::report::block::Report;
use abbe::report::provenance::Provenance;
use abbe::report::table::Table;
use serde::Serialize;
use serde_json::Map;

use crate::failed::Failed;
use crate::folder::Read;

/// The command that gives the same result, without options.
fn call(command: &str) -> Call {
    Call { command: command.to_string(), options: Map::new() }
}

/// The JSON document of a result.
pub fn json<T: Serialize>(command: &str, read: &Read, seed: u64, result: &T) -> Result<String, Failed> {
    Ok(Document::new(call(command), read.origin.clone(), Some(seed), result).text()?)
}

/// The page of a report.
pub fn report(command: &str, read: &Read, seed: u64, found: &Report) -> Result<String, Failed> {
    let provenance = Provenance::of((&read.session, &read.sources), seed);
    let command = format!("abbe {command} {}", read.sources.file.display());
    Ok(page::html(found, &Provenance { command, ..provenance })?)
}

/// The file of an identified model.
pub fn model(command: &str, read: &Read, seed: u64, problem: &Problem, fit: &Fit) -> Result<String, Failed> {
    let provenance = read.origin.provenance(call(command), seed);
    Ok(IdentifiedModel::of_fit(problem, fit, provenance)?.to_text()?)
}

/// The values of a report as CSV.
pub fn values(report: &Report) -> Result<String, Failed> {
    Ok(String::from_utf8_lossy(&csv::report(report)?).into_owned())
}

/// A table as CSV.
pub fn table(table: &Table) -> Result<String, Failed> {
    Ok(String::from_utf8_lossy(&csv::text(table)?).into_owned())
}
