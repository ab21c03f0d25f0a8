//! Foreign files of readings as a session, as `abbe import` makes it.

use std::path::{Path, PathBuf};

use abbe::files::import::session::keys;
use abbe::files::import::{Foreign, Hint};
use abbe::files::store::Store;
use abbe::import::{ImportOptions, ImportResult, Imported, Target, import};
use abbe::model::axis::AxisKind;
use abbe::model::instrument::{Fault, kinds};
use abbe::model::session::Session;
use abbe::model::unit::Unit;
use serde::{Deserialize, Serialize};
use wasm_bindgen::prelude::*;

use crate::failed::Failed;
use crate::folder::Folder;

/// What the page asks for: the arguments of the command.
#[derive(Deserialize)]
struct Asked {
    /// The foreign files.
    files: Vec<PathBuf>,
    /// The machine file of a new session, or else the session.
    machine: Option<PathBuf>,
    session: Option<PathBuf>,
    kind: Option<String>,
    /// `KEY=VALUE`.
    set: Vec<String>,
    /// `OWN=THEIRS`.
    columns: Vec<String>,
    like: Option<String>,
    allow_implausible: bool,
}

/// A session of foreign files.
#[wasm_bindgen]
pub struct Import {
    imported: Imported,
}

/// What the page shows.
#[derive(Serialize)]
struct Shown<'i> {
    result: &'i ImportResult,
    /// The files to write, beside the session.
    names: Vec<&'i str>,
    /// Our columns that such a file may have.
    columns: Vec<String>,
}

#[wasm_bindgen]
impl Import {
    /// Imports files of a folder; `asked` is the JSON text of what is asked for.
    ///
    /// # Errors
    /// If a file cannot be understood, or the readings contradict the machine.
    pub fn of(folder: &Folder, asked: &str) -> Result<Import, Failed> {
        let asked: Asked = serde_json::from_str(asked).map_err(|fault| Failed::from(fault.to_string()))?;
        let store = folder.store();
        let options = ImportOptions {
            kind: kinds().iter().copied().find(|kind| asked.kind.as_deref() == Some(kind.word())),
            set: keys(&asked.set).map_err(of_words)?,
            hints: asked.columns.iter().map(|text| Hint::parse(text)).collect::<Result<_, _>>().map_err(of_words)?,
            like: asked.like,
            store: store.clone(),
            allow_outside: false,
            allow_implausible: asked.allow_implausible,
        };
        let made = made(&store, &asked.files, (asked.machine.as_deref(), asked.session.as_deref()), &options);
        Ok(Import { imported: made.map_err(|failed| failed.within(&store))? })
    }

    /// How the files were understood, as JSON.
    pub fn shown(&self) -> Result<String, Failed> {
        let shown = Shown {
            result: &self.imported.result,
            names: self.imported.files.iter().map(|(name, _)| name.as_str()).collect(),
            columns: columns(&self.imported.session),
        };
        serde_json::to_string(&shown).map_err(|fault| Failed::from(fault.to_string()))
    }

    /// The content of a file to write, by its number.
    pub fn contents(&self, file: usize) -> Vec<u8> {
        self.imported.files.get(file).map_or_else(Vec::new, |(_, contents)| contents.clone())
    }
}

fn made(
    store: &Store,
    files: &[PathBuf],
    target: (Option<&Path>, Option<&Path>),
    options: &ImportOptions,
) -> Result<Imported, Failed> {
    let read = files.iter().map(|path| Ok(Foreign::read(store, path)?.0));
    let files: Vec<Foreign> = read.collect::<Result<_, Failed>>()?;
    let target = match target {
        (Some(machine), None) => Target::Machine(machine),
        (None, Some(session)) => Target::Session(session),
        _ => return Err("state a machine or a session".to_string().into()),
    };
    Ok(import(&files, target, options)?)
}

fn of_words((message, help): Fault) -> Failed {
    Failed::from(format!("{message}; {help}"))
}

/// The units of a length and of an angle in the name of a column.
const LENGTHS: &[&str] = &["mm", "um", "in", "mil", "m"];
const ANGLES: &[&str] = &["deg", "arcsec", "rad"];

/// The columns that a data file of a session may have, with each unit.
fn columns(session: &Session) -> Vec<String> {
    let axes = session.machine.axes.iter().map(|axis| {
        let units = if axis.kind == AxisKind::Rotary { ANGLES } else { LENGTHS };
        (axis.name.to_lowercase(), units)
    });
    let station = session.tests.first().map(|test| test.station.columns()).unwrap_or_default();
    let readings = station.iter().map(|column| {
        let units = match column.unit {
            Unit::One => &[][..],
            unit if unit.is_angle() => ANGLES,
            _ => LENGTHS,
        };
        (column.stem.to_string(), units)
    });
    let others: [(&str, &[&str]); 3] = [("time", &["s"]), ("run", &[]), ("temperature", &["c"])];
    let others = others.into_iter().map(|(stem, units)| (stem.to_string(), units));
    let each = |(stem, units): (String, &[&str])| match units {
        [] => vec![stem],
        units => units.iter().map(|unit| format!("{stem}_{unit}")).collect(),
    };
    axes.chain(readings).chain(others).flat_map(each).collect()
}

/// The instruments, in the words of `--kind`.
#[wasm_bindgen]
pub fn instruments() -> Vec<String> {
    kinds().iter().map(|kind| kind.word().to_string()).collect()
}
