//! Foreign files of readings as a session: the layout and the columns are guessed, a fit decides what the files leave
//! open, and readings that contradict the machine are refused with the mistakes that explain it.
//!
//! ```no_run
//! use abbe::import::{ImportOptions, Target, import};
//! use abbe::files::import::Foreign;
//!
//! let file = Foreign { name: "poses.csv".into(), bytes: std::fs::read("poses.csv")? };
//! let imported = import(&[file], Target::Machine("robot.toml".as_ref()), &ImportOptions::default())?;
//! for (name, contents) in &imported.files {
//!     std::fs::write(std::path::Path::new("run1").join(name), contents)?;
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::path::Path;

use abbe_files::ReadOptions;
use abbe_files::import::session::{Draft, SESSION_FILE};
use abbe_files::import::{ColumnFound, Foreign, Hint, Reading, Understood, instrument};
use abbe_files::read::machine_with_bodies;
use abbe_files::store::Store;
use abbe_identify::error::{self, CONTRADICTED};
use abbe_identify::fit;
use abbe_identify::plausibility::{self, ConflictKind, Plausibility};
use abbe_identify::start::with_targets;
use abbe_model::Diagnostic;
use abbe_model::diagnostic::FOREIGN_FILE;
use abbe_model::diagnostic::Location;
use abbe_model::document::node::Node;
use abbe_model::instrument::{Fault, InstrumentKind};
use abbe_model::session::Session;
use schemars::JsonSchema;
use serde::Serialize;

/// Where the readings go.
#[derive(Clone, Copy, Debug)]
pub enum Target<'t> {
    /// A new session of this machine file.
    Machine(&'t Path),
    /// Tests of this session file.
    Session(&'t Path),
}

/// What the user says.
#[derive(Clone, Default)]
pub struct ImportOptions {
    /// The instrument, for a new session.
    pub kind: Option<InstrumentKind>,
    /// Keys of the new tests: their set-up and their path.
    pub set: Node,
    /// What columns hold.
    pub hints: Vec<Hint>,
    /// The test whose set-up new tests of a session have.
    pub like: Option<String>,
    /// Where the file of the [`Target`] and those that it names lie: on the disk by default, or in memory.
    pub store: Store,
    /// Accept a session that reads files outside its folder.
    pub allow_outside: bool,
    /// Accept readings that contradict the machine.
    pub allow_implausible: bool,
}

/// A session of foreign files.
pub struct Imported {
    /// The files to write, by their names in the folder of the session; the session is the last.
    pub files: Vec<(String, Vec<u8>)>,
    /// The session with its readings.
    pub session: Session,
    /// How the files were understood.
    pub result: ImportResult,
}

/// How foreign files were understood.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ImportResult {
    /// The session file.
    pub session: String,
    /// The instrument.
    pub instrument: String,
    /// The tests, one for each file.
    pub tests: Vec<ImportedTest>,
    /// Standard deviation of the residual of the nominal machine with the set-up estimated: for poses the share of their
    /// spread, for others mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nominal_misfit: Option<f64>,
    /// Where the target or the ball was found in the tool frame, mm, if no one has stated it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_mm: Option<[f64; 3]>,
    /// What contradicts the machine, and what would explain it.
    pub plausibility: Plausibility,
    /// Warnings about the readings.
    pub warnings: Vec<String>,
}

/// A file as readings of a test.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ImportedTest {
    /// The test.
    pub test: String,
    /// The foreign file.
    pub file: String,
    /// The file that the session reads.
    pub data: String,
    /// The encoding, such as `utf-8`.
    pub encoding: String,
    /// The separator, in words.
    pub separator: String,
    /// The decimal sign.
    pub decimal: String,
    /// Lines above the names, or above the first row.
    pub skipped_lines: usize,
    /// Number of rows in the file.
    pub rows: usize,
    /// The columns.
    pub columns: Vec<ColumnFound>,
    /// The first rows as they stand in the file.
    pub first_rows: Vec<Vec<String>>,
    /// Why the session reads a normalised copy; empty if it reads the file as it is.
    pub normalised: Vec<String>,
    /// What was assumed or left out.
    pub remarks: Vec<String>,
}

/// Foreign files as tests of a session: one test each, with the name of the file.
///
/// # Errors
/// If a file cannot be understood, or the readings contradict the machine: what was found, and what to do.
pub fn import(files: &[Foreign], target: Target<'_>, options: &ImportOptions) -> Result<Imported, Diagnostic> {
    let names: Vec<String> = files.iter().map(Foreign::stem).collect();
    for (place, name) in names.iter().enumerate() {
        if names[..place].iter().any(|other| other.to_lowercase() == name.to_lowercase()) {
            let found = format!("two files are named {name}");
            return Err(error::not_applicable("import", found, "each is the test of its name"));
        }
    }
    let read_options =
        ReadOptions { allow_outside: options.allow_outside, store: options.store.clone(), ..ReadOptions::default() };
    let (mut draft, tests) = match target {
        Target::Session(file) => Draft::of_session(file, &read_options, &names, options.like.as_deref(), &options.set)?,
        Target::Machine(file) => {
            let Some(first) = files.first() else {
                return Err(error::too_few("an import", "file", 1, 0));
            };
            let kind = match options.kind {
                Some(kind) => kind,
                None => {
                    let machine = machine_with_bodies(file, &read_options)?.machine;
                    instrument(&first.bytes, &machine, &options.hints).map_err(|fault| of_file(&first.name, fault))?
                }
            };
            (Draft::of_machine(file, &read_options, kind, &names, &options.set)?, names)
        }
    };
    let planned = draft.planned()?;
    let mut chosen: Vec<(Understood, Reading, String)> = Vec::new();
    for (file, test) in files.iter().zip(&tests) {
        let found =
            draft.understand(&planned, test, file, &options.hints).map_err(|fault| of_file(&file.name, fault))?;
        let reading = best(&draft, test, file, &found)?;
        let data = draft.apply(test, file, &reading)?;
        chosen.push((found, reading, data));
    }
    draft.share_layout(&chosen.iter().map(|(_, reading, _)| reading).collect::<Vec<_>>())?;
    let target_mm = draft.set_targets(&with_targets(&draft.read()?))?;
    let session = draft.read()?;
    let nominal_misfit = plausibility::nominal_misfit(&session);
    let mut warnings: Vec<String> = (files.iter().zip(&chosen))
        .flat_map(|(file, (_, reading, _))| {
            reading.remarks.iter().map(move |remark| format!("{}: {remark}", file.name))
        })
        .collect();
    warnings.extend(session.warnings.iter().cloned());
    let plausibility = checked(&session, nominal_misfit, options.allow_implausible, &mut warnings)?;
    warnings.extend(plausibility::warnings(&plausibility));
    let result = ImportResult {
        session: draft.file.file_name().map_or_else(|| SESSION_FILE.into(), |name| name.to_string_lossy().into_owned()),
        instrument: session.instrument.word().to_string(),
        tests: files.iter().zip(&tests).zip(chosen).map(|((file, test), chosen)| told(file, test, chosen)).collect(),
        nominal_misfit,
        target_mm,
        plausibility,
        warnings,
    };
    Ok(Imported { files: draft.files(), session, result })
}

/// What an error of [`import()`] lacks, as `bar_mm=100`, if it is one of the session that would be written, which lacks a key or
/// has a wrong one.
pub fn key_of_new_session(error: &Diagnostic) -> Option<String> {
    error.location().filter(|place| place.file == Path::new(SESSION_FILE))?;
    let said = error.to_string();
    let key = said.split_once("no `").and_then(|(_, key)| key.split_once('`')).map(|(key, _)| key);
    Some(key.filter(|key| *key != "bar_mm").map_or("bar_mm=100".to_string(), |key| format!("{key}=VALUE")))
}

/// The error of a fault of a file.
fn of_file(name: &str, (message, help): Fault) -> Diagnostic {
    Diagnostic { code: FOREIGN_FILE, ..Diagnostic::input(Location::file(Path::new(name)), message, help) }
}

/// The way to read a file that the nominal machine explains best. Ways of which one cannot be read are none.
///
/// # Errors
/// If the nominal machine explains another way as well.
fn best(draft: &Draft, test: &str, file: &Foreign, found: &Understood) -> Result<Reading, Diagnostic> {
    if let [only] = &found.readings[..] {
        return Ok(only.clone());
    }
    let mut tried: Vec<(f64, f64, &Reading)> = Vec::new();
    let mut refused: Option<Diagnostic> = None;
    for reading in &found.readings {
        let mut draft = draft.clone();
        let session = draft.apply(test, file, reading).and_then(|_| draft.read_alone(test));
        match session {
            Ok(session) => {
                // Lengths in a larger unit leave a larger residual, but no larger share of them.
                let scale_mm = if is_two_sided(&session) { reading.scale_mm } else { 1.0 };
                let misfit = plausibility::nominal_misfit(&session).unwrap_or(f64::INFINITY);
                tried.push((misfit / scale_mm, max_misfit(&session) / scale_mm, reading));
            }
            Err(error) => refused = refused.or(Some(error)),
        }
    }
    tried.sort_by(|(a, ..), (b, ..)| a.total_cmp(b));
    match (&tried[..], refused) {
        ([], Some(error)) => Err(error),
        ([], None) => Err(error::no_readings()),
        ([(misfit, _, reading), (second, most, other), ..], _)
            if *second < most.min(AS_WELL * misfit.max(f64::MIN_POSITIVE)) =>
        {
            let [read, otherwise] = [reading, other].map(|way| (way.assumes.join("; "), &way.columns));
            let differs = (read.1.iter().zip(otherwise.1)).find_map(|(one, other)| {
                (one.own != other.own).then_some((one.own.as_ref()?, other.own.as_ref()?, one))
            });
            let help = differs.map_or(String::new(), |(one, other, column)| {
                let theirs = if column.name.is_empty() { column.number.to_string() } else { column.name.clone() };
                format!(", or say what a column holds: {one}={theirs} or {other}={theirs}")
            });
            let message = format!("units are not stated, and two readings fit as well: {}; or {}", read.0, otherwise.0);
            Err(of_file(&file.name, (message, format!("state the units in the names of the columns{help}"))))
        }
        ([(_, _, reading), ..], _) => Ok((*reading).clone()),
    }
}

/// Factor of the misfit up to which a second way to read a file fits as well as the best.
const AS_WELL: f64 = 2.0;

fn is_two_sided(session: &Session) -> bool {
    session.instruments().iter().any(|kind| kind.is_two_sided())
}

/// Misfit of the nominal machine above which a session that cannot be fitted is refused: a share of the spread of poses, or mm.
const MAX_MISFIT: [f64; 2] = [0.02, 1.0];

fn max_misfit(session: &Session) -> f64 {
    MAX_MISFIT[usize::from(is_two_sided(session))]
}

/// Noise of a coordinate of poses, mm, if a session states none. The residual of a wrong machine, taken for noise, would hide
/// its location errors.
const NOISE_MM: f64 = 0.05;

/// Whether machine and readings belong together. A session that the nominal machine explains can be read, though its
/// readings may be too few for a fit.
fn checked(
    session: &Session,
    nominal_misfit: Option<f64>,
    allow_implausible: bool,
    warnings: &mut Vec<String>,
) -> Result<Plausibility, Diagnostic> {
    let explained = nominal_misfit.is_some_and(|misfit| misfit < max_misfit(session));
    let stated = match is_two_sided(session) {
        true => session.clone(),
        false => Session { noise_mm: session.noise_mm.or(Some(NOISE_MM)), ..session.clone() },
    };
    let found = match fit::prepare(&stated, 1) {
        Ok((problem, fit)) => {
            let mut found = plausibility::examine(&problem, &fit);
            // A noise that no one stated says nothing about the unit.
            found.conflicts.retain(|conflict| conflict.kind != ConflictKind::Unit || session.noise_mm.is_some());
            found
        }
        Err(error) if error.code == CONTRADICTED && !allow_implausible && !explained => return Err(error),
        Err(error) => {
            warnings.push(format!("the session is not fitted yet: {error}"));
            Plausibility::default()
        }
    };
    let of_readings = |kind: ConflictKind| {
        matches!(
            kind,
            ConflictKind::ExplainedVariance
                | ConflictKind::Orientations
                | ConflictKind::LocationError
                | ConflictKind::ZeroAngle
                | ConflictKind::Residual
                | ConflictKind::Statement
        )
    };
    // Without a cause that was tested, a conflict remains a warning.
    let Some(diagnosis) = plausibility::explained(&found) else { return Ok(found) };
    if allow_implausible || !found.conflicts.iter().any(|conflict| of_readings(conflict.kind)) {
        return Ok(found);
    }
    let conflicts: Vec<&str> = (found.conflicts.iter())
        .filter(|conflict| of_readings(conflict.kind))
        .map(|conflict| conflict.words.as_str())
        .take(MAX_NAMED)
        .collect();
    Err(error::contradicted(conflicts.join("; "), diagnosis))
}

/// Largest number of contradictions that a refusal names.
const MAX_NAMED: usize = 2;

fn told(file: &Foreign, test: &str, (found, reading, data): (Understood, Reading, String)) -> ImportedTest {
    ImportedTest {
        test: test.to_string(),
        file: file.name.clone(),
        data,
        encoding: found.encoding.to_string(),
        separator: found.separator.to_string(),
        decimal: found.decimal.to_string(),
        skipped_lines: found.skipped_lines,
        rows: found.row_count,
        columns: reading.columns,
        first_rows: found.first_rows,
        normalised: reading.normalised,
        remarks: reading.remarks,
    }
}
