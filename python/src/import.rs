//! Foreign files of readings as a session: `abbe.import_readings`.

use std::path::PathBuf;

use abbe::files::import::{Foreign, Hint};
use abbe::files::store::Store;
use abbe::import::{ImportOptions, Target, import};
use abbe::model::document::node::Node;
use abbe::model::instrument;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::failed::Failed;
use crate::keywords::node_of;
use crate::work;

/// The files to write, the session as the last, and how they were understood, as JSON. One of `machine` and `session` is
/// given.
#[pyfunction]
#[pyo3(signature = (files, machine, session, kind, set, columns, like, allow_outside, allow_implausible))]
pub fn import_readings(
    py: Python<'_>,
    files: Vec<PathBuf>,
    machine: Option<PathBuf>,
    session: Option<PathBuf>,
    kind: Option<&str>,
    set: &Bound<'_, PyDict>,
    columns: Vec<String>,
    like: Option<String>,
    allow_outside: bool,
    allow_implausible: bool,
) -> PyResult<(Vec<(String, Vec<u8>)>, String)> {
    let of_words = |(message, help): (String, String)| Failed::argument(message, help);
    let known = || instrument::kinds().iter().map(|kind| kind.word()).collect::<Vec<_>>().join(", ");
    let kind = kind.map(|word| {
        let found = instrument::kinds().iter().copied().find(|kind| kind.word() == word);
        found.ok_or_else(|| Failed::argument(format!("there is no instrument `{word}`"), format!("known: {}", known())))
    });
    let options = ImportOptions {
        kind: kind.transpose()?,
        set: if set.is_empty() { Node::table::<Node>([]) } else { node_of("test", set.as_any())? },
        hints: columns.iter().map(|text| Hint::parse(text)).collect::<Result<_, _>>().map_err(of_words)?,
        like,
        store: Store::Disk,
        allow_outside,
        allow_implausible,
    };
    let imported = work::run(py, None, move |_| {
        let read = files.iter().map(|file| Foreign::read(&Store::Disk, file).map(|(file, _)| file));
        let files = read.collect::<Result<Vec<_>, _>>()?;
        let target = match (&machine, &session) {
            (Some(machine), None) => Target::Machine(machine),
            (None, Some(session)) => Target::Session(session),
            _ => return Err(Failed::argument("state `machine` or `session`", "one of them is expected")),
        };
        Ok(import(&files, target, &options)?)
    })?;
    let result = serde_json::to_string(&imported.result).map_err(|cause| Failed::new(cause.to_string()))?;
    Ok((imported.files, result))
}
