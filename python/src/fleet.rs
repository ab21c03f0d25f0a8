//! Units of work of a fleet, and the history of its machines.

use std::path::PathBuf;

use abbe::document::StatedHistory;
use abbe::fleet::history::{HistoryOptions, history};
use abbe::fleet::options::Options;
use abbe::fleet::store::{IfClaimed, Store};
use abbe::fleet::unit::{self, Done, Places};
use abbe::fleet::{compensations, list};
use pyo3::prelude::*;
use serde::Serialize;

use crate::failed::Failed;
use crate::work;

fn json(result: &impl Serialize) -> Result<String, Failed> {
    serde_json::to_string(result).map_err(|cause| Failed::new(format!("the result cannot be written: {cause}")))
}

fn options(text: &str) -> Result<Options, Failed> {
    serde_json::from_str(text).map_err(|cause| Failed::argument(format!("an option cannot be used: {cause}"), ""))
}

/// Analyses a session if the folder has no record of it: whether it was computed, and the note of the folder as JSON.
#[pyfunction]
pub fn run_session(
    py: Python<'_>,
    file: PathBuf,
    out: PathBuf,
    options_json: &str,
    models: Option<PathBuf>,
    allow_outside: bool,
) -> PyResult<(bool, String)> {
    let options = options(options_json)?;
    work::run(py, None, move |caller| {
        let store = Store::open(out)?;
        let places = Places { models, allow_outside };
        let done = unit::run(&file, &options, &places, &store, IfClaimed::Wait, &|| caller.should_continue())?;
        let (done, pointer) = done.ok_or_else(|| Failed::new("another process analyses the session"))?;
        Ok((done == Done::Computed, json(&pointer)?))
    })
}

/// The record of a session as JSON, without a folder.
#[pyfunction]
pub fn analyse_session(
    py: Python<'_>,
    file: PathBuf,
    options_json: &str,
    models: Option<PathBuf>,
    allow_outside: bool,
) -> PyResult<String> {
    let options = options(options_json)?;
    work::run(py, None, move |caller| {
        let places = Places { models, allow_outside };
        json(&unit::analyse(&file, &options, &places, &|| caller.should_continue())?)
    })
}

/// Session files from files and folders.
#[pyfunction]
pub fn session_files(paths: Vec<PathBuf>) -> Result<Vec<PathBuf>, Failed> {
    Ok(list::sessions(&paths)?)
}

/// Removes the notes of session files in or below these places that are no longer there, and returns the files.
#[pyfunction]
pub fn forget_missing_sessions(out: PathBuf, paths: Vec<PathBuf>) -> Result<Vec<String>, Failed> {
    Ok(Store::open(out)?.forget_missing(&paths)?)
}

/// The notes and records of a folder as JSON texts, and the files whose record is missing.
#[pyfunction]
pub fn fleet_records(py: Python<'_>, out: PathBuf) -> PyResult<(Vec<(String, String)>, Vec<String>)> {
    work::run(py, None, move |_| {
        let (records, missing) = Store::existing(out)?.records()?;
        let texts = records.iter().map(|(pointer, record)| Ok((json(pointer)?, json(record)?)));
        let missing = missing.into_iter().map(|(_, file)| file).collect();
        Ok((texts.collect::<Result<_, Failed>>()?, missing))
    })
}

/// The history of the machines of a folder as JSON.
#[pyfunction]
pub fn fleet_history(
    py: Python<'_>,
    out: PathBuf,
    machine_id: Option<String>,
    false_discovery_rate: f64,
    tolerance_u: f64,
    compensations: Option<PathBuf>,
) -> PyResult<String> {
    work::run(py, None, move |_| {
        let known = compensations.map(|file| compensations::read(&file)).transpose()?.unwrap_or_default();
        let options = HistoryOptions { false_discovery_rate, tolerance_u, compensations: known };
        let found = history(&Store::existing(out)?, machine_id.as_deref(), &options)?;
        json(&StatedHistory::of_history(&found))
    })
}
