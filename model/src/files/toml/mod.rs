//! Reader of machine and session files.

mod body;
mod constants;
mod data_folder;
pub(crate) mod document;
mod effect;
mod format;
mod machine;
pub mod memory;
mod movement;
pub mod parts;
mod prior;
mod quoted;
pub mod rewrite;
mod shape;
mod sockets;
mod station;
mod test;
mod tolerance;
mod unknowns;
pub mod write;
pub mod write_test;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

pub use machine::{machine, machine_of};

use super::quantity::{self, MICROMETRE};
use super::source_map::{BodyFile, SourceMap};
use super::stamp::FileStamp;
use super::store::Store;
use super::table::memory::MemoryColumn;
use super::table::request::{ColumnMapping, Format};
use crate::chain::Machine;
use crate::driver::column;
use crate::error::{Location, ModelError};
use crate::instrument::InstrumentKind;
use crate::session::expression::{Constant, Length};
use crate::session::limits;
use crate::session::{Session, Test, setups};
use crate::words;
use body::BodyFiles;
pub use document::Source;
use document::{Table, Value};

/// Options for reading a session.
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// The folder of the data files, if they are not beside the session file.
    pub data_directory: Option<PathBuf>,
    /// Whether the data files are read; otherwise the session is only a plan.
    pub read_data: bool,
    /// Whether the session may read files outside its own folder, the folders below and the data directory.
    pub allow_outside: bool,
    /// Where the session, its machine and its data lie.
    pub store: Store,
}

impl Default for ReadOptions {
    /// Data are read, from the session's folder and below.
    fn default() -> Self {
        ReadOptions { data_directory: None, read_data: true, allow_outside: false, store: Store::Disk }
    }
}

/// Context of the session for the readers of tests and effects.
struct Context<'a> {
    /// The session file.
    file: &'a Path,
    machine: &'a Machine,
    instrument: InstrumentKind,
    constants: &'a [Constant],
    format: Format,
    columns: Option<Vec<ColumnMapping>>,
    /// Readings in memory, in place of a data file.
    memory: Option<&'a [MemoryColumn<'a>]>,
    options: &'a ReadOptions,
}

impl Context<'_> {
    /// A length: a number, or an expression in the constants.
    fn length(&self, value: &Value<'_>) -> Result<(Length, f64), ModelError> {
        let Some(text) = value.as_text() else {
            let number = value.number_or_inf("a number or an expression in quotes")?;
            if !number.is_finite() {
                return Err(value.error(format!("`{}` is infinite; a length is expected", value.key), None));
            }
            return Ok((Length::Number(number), number));
        };
        let names: Vec<&str> = self.constants.iter().map(|constant| constant.name.as_str()).collect();
        let length = Length::parse(text, &names).map_err(|fault| {
            let help = "a length is a number or an expression in [constants] with + - * / ^2 sqrt( )";
            value.error(format!("`{}` = \"{text}\": {fault}", value.key), Some(help.into()))
        })?;
        let number = length.evaluate(&|name: &str| {
            let found = self.constants.iter().find(|known| known.name == name);
            found.map_or(f64::NAN, |constant| constant.mm)
        });
        if let Some(fault) = limits::too_large_for(&value.key, number) {
            let message = format!("`{}` = \"{text}\" evaluates to {fault}", value.key);
            return Err(value.error(message, None));
        }
        if !number.is_finite() {
            let message = format!("`{}` = \"{text}\" evaluates to {number} with these constants", value.key);
            return Err(value.error(message, Some("a root of a negative number, or a division by zero?".into())));
        }
        Ok((length, number))
    }

    /// Three lengths, mm.
    fn point_mm(&self, value: Value<'_>) -> Result<[f64; 3], ModelError> {
        let items = value.three("a list of three lengths")?;
        let mut point_mm = [0.0; 3];
        for (coordinate, item) in point_mm.iter_mut().zip(&items) {
            (_, *coordinate) = self.length(item)?;
        }
        Ok(point_mm)
    }
}

/// Reads the text of another file in the same way. `what` names its content in messages.
///
/// # Errors
/// As [`Source::read`].
pub fn text(path: &Path, what: &str) -> Result<Source, ModelError> {
    Source::read(&Store::Disk, path, what)
}

/// Reads a session file, its machine and, if requested, its data.
///
/// # Errors
/// Every fault that prevents the use of the session: file, line, what was found and expected, and what to do.
pub fn session(path: &Path, options: &ReadOptions) -> Result<Session, ModelError> {
    session_with_sources(path, options).map(|(session, _)| session)
}

/// As [`session`], with the files and texts from which the session was read.
///
/// # Errors
/// As [`session`].
pub fn session_with_sources(path: &Path, options: &ReadOptions) -> Result<(Session, SourceMap), ModelError> {
    session_of(&Source::read(&options.store, path, "the session file")?, options)
}

/// As [`session_with_sources`], from a session file that has been read.
///
/// # Errors
/// As [`session`].
pub fn session_of(source: &Source, options: &ReadOptions) -> Result<(Session, SourceMap), ModelError> {
    let path = source.file.as_path();
    let mut root = source.parse()?;
    let SessionMachine { machine, source: machine_source, bodies, warnings } =
        session_machine(path, options, &mut root)?;
    let head = head(machine, &mut root)?;

    let format = match root.take("format") {
        Some(value) => format::format(value.table("[format]".into())?)?,
        None => Format::default(),
    };
    let columns = match root.take("columns") {
        Some(value) => Some(format::columns(value.table("[columns]".into())?)?),
        None => None,
    };
    let context = Context {
        file: path,
        machine: &head.machine,
        instrument: head.instrument,
        constants: &head.constants,
        format,
        columns,
        memory: None,
        options,
    };
    let mut found = Found { warnings, ..Found::default() };
    let (tests, declared) = tests(&context, &mut root, &mut found)?;
    for (index, test) in tests.iter().enumerate() {
        found.warnings.extend(setups::differing(&tests[..index], test));
    }
    let columns = driver_columns(&context, &tests);
    let effects = match root.take("effect") {
        Some(value) => value
            .list("tables [[effect]]")?
            .into_iter()
            .map(|item| effect::effect(&context, &declared, &columns, item))
            .collect::<Result<Vec<_>, _>>()?,
        None => Vec::new(),
    };
    let names: Vec<&str> = tests.iter().map(|test| test.name.as_str()).collect();
    let tolerance = tolerance::tolerance(&head.machine, &head.unknowns, &names, &mut root)?;
    let clearance = body::clearance(&mut root)?;
    let socket_distances = sockets::socket_distances(head.instrument, &tests, &mut root, options.read_data)?;
    root.finish()?;
    let mut files: Vec<FileStamp> = Vec::new();
    let own = source.stamp.iter().chain(machine_source.iter().filter_map(|source| source.stamp.as_ref()));
    for stamp in own.chain(bodies.iter().map(|body| &body.stamp)).chain(&found.stamps) {
        if !files.contains(stamp) {
            files.push(stamp.clone());
        }
    }
    let sources = SourceMap {
        file: path.to_path_buf(),
        text: source.text.clone(),
        machine_text: machine_source.map(|source| source.text),
        bodies,
        files,
    };
    let session = Session { effects, tests, socket_distances, tolerance, clearance, warnings: found.warnings, ..head };
    Ok((session, sources))
}

/// What a session states before its tests.
fn head(machine: Machine, root: &mut Table<'_>) -> Result<Session, ModelError> {
    let constants = constants::constants(root)?;
    let instrument = Instrument::read(root)?;
    let about = about(root)?;
    let unknowns = unknowns::unknowns(&machine, instrument.kind, root)?;
    Ok(Session {
        constants,
        noise_mm: instrument.noise_mm,
        resolution_mm: instrument.resolution_mm,
        unknowns,
        about,
        ..Session::new(machine, instrument.kind)
    })
}

/// The driver columns of the data, and those that `[columns]` names.
fn driver_columns(context: &Context<'_>, tests: &[Test]) -> BTreeSet<String> {
    let recorded = tests.iter().filter_map(|test| test.readings.as_ref()).flat_map(|readings| readings.drivers.keys());
    let named = context.columns.iter().flatten().filter_map(|entry| column::of_files(&entry.own));
    recorded.cloned().chain(named.map(str::to_string)).collect()
}

/// What was found while the tests were read, beside the tests.
#[derive(Default)]
struct Found {
    /// Warnings about usable tests.
    warnings: Vec<String>,
    /// The data files.
    stamps: Vec<FileStamp>,
}

/// The machine of a session, and its file if it has one of its own.
struct SessionMachine {
    machine: Machine,
    source: Option<Source>,
    /// The files of bodies.
    bodies: Vec<BodyFile>,
    /// Warnings about usable files of bodies.
    warnings: Vec<String>,
}

/// Reads the machine: a file beside the session, or tables in the session.
fn session_machine(path: &Path, options: &ReadOptions, root: &mut Table<'_>) -> Result<SessionMachine, ModelError> {
    let value = root.require("machine", "[machine] with `file = \"machine.toml\"`, or the machine's tables in it")?;
    let mut table = value.table("[machine]".into())?;
    let Some(file) = table.take("file") else {
        let mut files = BodyFiles { from: Some((path, path, options)), ..BodyFiles::default() };
        let machine = machine::from_table(table, &mut files)?;
        return Ok(SessionMachine { machine, source: None, bodies: files.read, warnings: files.warnings });
    };
    let named = file.text()?;
    let found = path.parent().unwrap_or(Path::new("")).join(&named);
    if !options.store.exists(&found) {
        let message = format!("the machine file `{named}` does not exist; looked for {}", found.display());
        return Err(file.error(message, Some("its name is relative to the session file".into())));
    }
    data_folder::check(path, options, &file, &found)?;
    table.finish()?;
    let source = machine::source(&options.store, &found)?;
    let mut files = BodyFiles { from: Some((path, &found, options)), ..BodyFiles::default() };
    let machine = machine::from_table(source.parse()?, &mut files)?;
    Ok(SessionMachine { machine, source: Some(source), bodies: files.read, warnings: files.warnings })
}

/// Reads `[about]`: notes that reports repeat.
fn about(root: &mut Table<'_>) -> Result<Vec<(String, String)>, ModelError> {
    let Some(value) = root.take("about") else {
        return Ok(Vec::new());
    };
    let notes = value.table("[about]".into())?.remaining_values()?;
    notes
        .into_iter()
        .map(|note| {
            let control = note.key.chars().any(char::is_control);
            if control || note.key.trim().is_empty() {
                let message = "a note of [about] has a name that cannot be displayed";
                let help = "use names such as `serial_number`, `operator`, `date`, `comment`";
                return Err(note.source.error(note.key_span.clone(), message, Some(help.into())));
            }
            Ok((note.key.clone(), note.note()?))
        })
        .collect()
}

/// The valid values of `kind` of an instrument, in words.
fn kinds() -> String {
    let words: Vec<String> = InstrumentKind::ALL.iter().map(|kind| format!("\"{}\"", kind.word())).collect();
    effect::listed(&words, "or")
}

struct Instrument {
    kind: InstrumentKind,
    noise_mm: Option<f64>,
    resolution_mm: Option<f64>,
}

impl Instrument {
    fn read(root: &mut Table<'_>) -> Result<Instrument, ModelError> {
        let value = root.require("instrument", "[instrument] with `kind = \"ballbar\"`")?;
        let mut table = value.table("[instrument]".into())?;
        let value = table.require("kind", &kinds())?;
        let word = value.text()?;
        let Some(kind) = InstrumentKind::of_word(&word) else {
            return Err(value.unexpected(&kinds()));
        };
        let mut not_negative = |key: &'static str| -> Result<Option<f64>, ModelError> {
            let Some(value) = table.take(key) else {
                return Ok(None);
            };
            let number = value.number()?;
            if number < 0.0 {
                let message = format!("`{key}` is {}; it cannot be negative", words::number(number));
                return Err(value.error(message, None));
            }
            if let Some(fault) = limits::too_small_um(number) {
                return Err(value.error(format!("`{key}` is {fault}"), None));
            }
            Ok(Some(number * MICROMETRE))
        };
        let noise_mm = not_negative("noise_um")?;
        let resolution_mm = not_negative("resolution_um")?.filter(|step| *step > 0.0);
        table.finish()?;
        Ok(Instrument { kind, noise_mm, resolution_mm })
    }
}

/// The name of a `[[test]]`, with the tests that it declares: one for each socket, else one.
struct Declared {
    name: String,
    parts: Vec<String>,
}

/// Reads the tests, and the names by which effects may refer to them.
fn tests(
    context: &Context<'_>,
    root: &mut Table<'_>,
    found: &mut Found,
) -> Result<(Vec<Test>, Vec<Declared>), ModelError> {
    let items = match root.take("test") {
        Some(value) => value.list("tables [[test]]")?,
        None => Vec::new(),
    };
    let mut tests: Vec<Test> = Vec::new();
    let mut declared: Vec<Declared> = Vec::new();
    for item in items {
        let called = format!("test {}", declared.len() + 1);
        let mut table = item.table(called)?;
        let name = test::name(&mut table, &declared)?;
        let parts = test::tests(context, &name, table, found)?;
        declared.push(Declared { name, parts: parts.iter().map(|test| test.name.clone()).collect() });
        tests.extend(parts);
    }
    if tests.is_empty() {
        return Err(ModelError::Input {
            location: Location::file(context.file),
            message: "a session without tests".into(),
            help: Some("add at least one [[test]]".into()),
        });
    }
    Ok((tests, declared))
}
