//! Sessions and machines from files, and from documents in memory.

use std::path::Path;

use abbe_model::chain::Machine;
use abbe_model::diagnostic::{Diagnostic, Location};
use abbe_model::document::edit::SessionText;
use abbe_model::document::effect;
use abbe_model::document::fault::{Fault, Step, Within};
use abbe_model::document::machine as machine_document;
use abbe_model::document::node::Node;
use abbe_model::document::session::{MachineFile, Session as Document, SessionMachine};
use abbe_model::effect::Effect;
use abbe_model::instrument::InstrumentParameter;
use abbe_model::session::Session;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use super::access::{self, ReadOptions};
use super::source_map::{BodyFile, SourceMap};
use super::stamp::FileStamp;
use super::store::Store;
use super::table::memory::MemoryColumn;
use crate::lower::body::BodyFiles;
use crate::lower::{self, Data, Surroundings};
use crate::source::{Parsed, Source};

/// Reads the text of another file in the same way: UTF-8 with or without byte order mark, of a limited size, unchanged
/// while it is read. `what` names its content in messages.
///
/// # Errors
/// If the file cannot be read or is not such a text, with its name and what to do.
pub fn text(path: &Path, what: &str) -> Result<Source, Diagnostic> {
    Source::read(&Store::Disk, path, what)
}

/// As [`text()`], of a file of another program in its own encoding, such as a URDF.
///
/// # Errors
/// If the file cannot be read, or is too large.
pub fn foreign_text(path: &Path, what: &str) -> Result<Source, Diagnostic> {
    Source::read_foreign(&Store::Disk, path, what)
}

/// Reads a machine file.
///
/// # Errors
/// If the file cannot be read or does not describe a machine, with its line and what to do.
pub fn machine(path: &Path) -> Result<Machine, Diagnostic> {
    machine_of(&machine_source(&Store::Disk, path)?)
}

/// As [`machine()`], from a text that has been read.
///
/// # Errors
/// As [`machine()`].
pub fn machine_of(source: &Source) -> Result<Machine, Diagnostic> {
    let options = ReadOptions::default();
    let path = source.file.as_path();
    // A text from no file has no files beside it.
    let from = source.stamp.is_some().then_some((path, path, &options));
    machine_in(&source.parse()?, &mut BodyFiles { from, ..BodyFiles::default() })
}

/// The machine of a document in memory.
///
/// # Errors
/// If it does not describe a machine; the diagnostic has no place.
pub fn machine_of_node(node: Node) -> Result<Machine, Diagnostic> {
    machine_in(&Parsed::of_node(node), &mut BodyFiles::default())
}

fn machine_in(parsed: &Parsed<'_>, files: &mut BodyFiles<'_>) -> Result<Machine, Diagnostic> {
    let document: machine_document::Machine = parsed.document()?;
    lower::machine(&document, files).map_err(|fault| parsed.error_of(fault))
}

/// A machine with its text and the files of its bodies.
pub struct MachineRead {
    /// The machine.
    pub machine: Machine,
    /// Its text.
    pub source: Source,
    /// The files of its bodies.
    pub bodies: Vec<BodyFile>,
}

/// As [`machine()`], with the text and the files of its bodies.
///
/// # Errors
/// As [`machine()`].
pub fn machine_with_bodies(path: &Path, options: &ReadOptions) -> Result<MachineRead, Diagnostic> {
    let source = machine_source(&options.store, path)?;
    let mut files = BodyFiles { from: Some((path, path, options)), ..BodyFiles::default() };
    let machine = machine_in(&source.parse()?, &mut files)?;
    Ok(MachineRead { machine, bodies: files.read, source })
}

fn machine_source(store: &Store, path: &Path) -> Result<Source, Diagnostic> {
    Source::read(store, path, "the machine file")
}

/// The machine of a part of another document.
///
/// # Errors
/// If it does not describe a machine: the fault in the part.
pub fn machine_of_document(document: &machine_document::Machine) -> Result<Machine, Fault> {
    lower::machine(document, &mut BodyFiles::default())
}

/// An effect of a session with this machine, these parameters of instruments and names of tests, from a part of another
/// document.
///
/// # Errors
/// As for a session file: the fault in the part.
pub fn effect_of_document(
    document: &effect::Effect,
    machine: &Machine,
    of_instruments: &[InstrumentParameter],
    tests: &[String],
) -> Result<Effect, Fault> {
    lower::effect_of(machine, of_instruments, tests, document)
}

/// What follows from a document of another kind. A fault of it has its place in the text.
///
/// # Errors
/// As [`machine()`], and the fault of `lower`.
pub fn lowered<T: DeserializeOwned + JsonSchema, V>(
    source: &Source,
    lower: impl FnOnce(&T) -> Result<V, Fault>,
) -> Result<V, Diagnostic> {
    let parsed = source.parse()?;
    lower(&parsed.document()?).map_err(|fault| parsed.error_of(fault))
}

/// Reads a session file, its machine and, if requested, its data.
///
/// # Errors
/// Every fault that prevents the use of the session: file, line, what was found and expected, and what to do.
pub fn session(path: &Path, options: &ReadOptions) -> Result<Session, Diagnostic> {
    session_with_sources(path, options).map(|(session, _)| session)
}

/// As [`session`], with the files and texts from which the session was read.
///
/// # Errors
/// As [`session`].
pub fn session_with_sources(path: &Path, options: &ReadOptions) -> Result<(Session, SourceMap), Diagnostic> {
    session_of(&Source::read(&options.store, path, "the session file")?, options)
}

/// As [`session_with_sources`], from a session file that has been read.
///
/// # Errors
/// As [`session`].
pub fn session_of(source: &Source, options: &ReadOptions) -> Result<(Session, SourceMap), Diagnostic> {
    let path = source.file.as_path();
    let parsed = source.parse()?;
    let document: Document = parsed.document()?;
    let here = |fault: Fault| parsed.error_of(fault);
    let SessionMachineRead { machine, source: machine_source, bodies, warnings } =
        session_machine(path, options, &document.machine).within("machine").map_err(here)?;
    let comment = |path: &[&str]| parsed.comment(path);
    let mut session = lower::head(machine, &document, &comment).map_err(here)?;
    session.warnings = warnings;
    let surroundings = Surroundings {
        file: path,
        options,
        data: if options.read_data { Data::Files } else { Data::None },
        place: &|table, item, keys| {
            let key = |key: &&str| Step::Key((*key).to_string());
            let path = table.iter().map(key).chain(item.map(Step::Item)).chain(keys.iter().map(key));
            parsed.location_of(&path.collect::<Vec<_>>())
        },
    };
    let found = lower::add(&mut session, &document.parts, &surroundings).map_err(here)?;
    if session.tests.is_empty() {
        return Err(Diagnostic::input(Location::file(path), "a session without tests", "add at least one [[test]]"));
    }
    let mut files: Vec<FileStamp> = Vec::new();
    let own = source.stamp.iter().chain(machine_source.iter().filter_map(|source| source.stamp.as_ref()));
    for stamp in own.chain(bodies.iter().map(|body| &body.stamp)).chain(&found.stamps) {
        if !files.contains(stamp) {
            files.push(stamp.clone());
        }
    }
    let sources = SourceMap {
        file: path.to_path_buf(),
        text: SessionText::new(&source.text, path)?,
        machine_text: machine_source.map(|source| source.text),
        bodies,
        files,
    };
    Ok((session, sources))
}

/// The machine of a session, and its file if it has one of its own.
struct SessionMachineRead {
    machine: Machine,
    source: Option<Source>,
    /// The files of bodies.
    bodies: Vec<BodyFile>,
    /// Warnings about usable files of bodies.
    warnings: Vec<String>,
}

/// The machine: a file beside the session, or tables in the session.
fn session_machine(path: &Path, options: &ReadOptions, document: &SessionMachine) -> Result<SessionMachineRead, Fault> {
    let named = match document {
        SessionMachine::File(MachineFile { file }) => file,
        SessionMachine::Other(tables) => {
            let mut files = BodyFiles { from: Some((path, path, options)), ..BodyFiles::default() };
            let machine = lower::machine(tables, &mut files)?;
            let BodyFiles { read: bodies, warnings, .. } = files;
            return Ok(SessionMachineRead { machine, source: None, bodies, warnings });
        }
    };
    let found = path.parent().unwrap_or(Path::new("")).join(named);
    if !options.store.exists(&found) {
        let message = format!("the machine file `{named}` does not exist; looked for {}", found.display());
        return Err(Fault::new(message, "its name is relative to the session file").at("file"));
    }
    access::check(path, options, ("file", named), &found).within("file")?;
    let source = machine_source(&options.store, &found)?;
    let mut files = BodyFiles { from: Some((path, &found, options)), ..BodyFiles::default() };
    let machine = machine_in(&source.parse()?, &mut files)?;
    let BodyFiles { read: bodies, warnings, .. } = files;
    Ok(SessionMachineRead { machine, source: Some(source), bodies, warnings })
}

/// A session of a document in memory, with its machine in it: a plan, whose tests have no readings, or a session without
/// tests.
///
/// # Errors
/// As for a session file, without its line.
pub fn plan_of_node(node: Node) -> Result<Session, Diagnostic> {
    plan_in(&Parsed::of_node(node))
}

/// As [`plan_of_node`], from the text of a session.
///
/// # Errors
/// As for a session file.
pub fn plan_of(source: &Source) -> Result<Session, Diagnostic> {
    plan_in(&source.parse()?)
}

fn plan_in(source: &Parsed<'_>) -> Result<Session, Diagnostic> {
    let document: Document = source.document()?;
    let read = || {
        let SessionMachine::Other(tables) = &document.machine else {
            let help = "state the machine's tables in [machine]";
            return Err(Fault::new("a session in memory has no machine file", help).at("machine"));
        };
        let machine = lower::machine(tables, &mut BodyFiles::default()).within("machine")?;
        let mut session = lower::head(machine, &document, &|_| None)?;
        lower::add(&mut session, &document.parts, &in_memory(Data::None, &ReadOptions::default()))?;
        Ok(session)
    };
    read().map_err(|fault| source.error_of(fault))
}

/// Adds an entry of a list of a session, such as `test`, `effect` or `socket_distance`. A test has the readings of the
/// columns, if there are any. After an error the session is unchanged.
///
/// A program that has its readings in memory states its tests with the keys of a session file, and gets the same checks,
/// defaults and messages. A ball bar on a five-axis machine; the axis of C is 10 µm away from its nominal position along X:
///
/// ```
/// use abbe_model::chain::Machine;
/// use abbe_files::read::add_node;
/// use abbe_files::table::memory::MemoryColumn;
/// use abbe_model::session::Session;
/// use serde_json::json;
///
/// let mut session = Session::new(Machine::from_code("[wCAbYXZt]")?, "ballbar".parse()?);
/// let test = json!({"name": "C125", "bar_mm": 125, "workpiece_ball_mm": [0, 100, 0], "spindle_ball_mm": [0, 0, 0],
///                   "at": {"z_mm": 75}});
/// let c_rad: Vec<f64> = (0..360).map(|degree| f64::from(degree).to_radians()).collect();
/// let read = |c: &f64| ((0.01 - 100.0 * c.sin()).powi(2) + (100.0 * c.cos()).powi(2) + 75.0_f64.powi(2)).sqrt();
/// let length_mm: Vec<f64> = c_rad.iter().map(read).collect();
/// let columns = [MemoryColumn::numbers("c_rad", &c_rad), MemoryColumn::numbers("length_mm", &length_mm)];
/// add_node(&mut session, "test", test.into(), &columns)?;
/// assert_eq!(session.tests[0].readings.as_ref().map(|readings| readings.rows()), Some(360));
///
/// // Without the position of Z, the bar does not reach from ball to ball.
/// let test = json!({"name": "again", "bar_mm": 125, "workpiece_ball_mm": [0, 100, 0], "spindle_ball_mm": [0, 0, 0]});
/// let fault = add_node(&mut session, "test", test.into(), &columns).unwrap_err();
/// assert!(fault.to_string().contains("a bar of 125.0000 mm cannot reach between its balls"));
/// # Ok::<(), abbe_model::Diagnostic>(())
/// ```
///
/// # Errors
/// As for a session file, without its line.
pub fn add_node(
    session: &mut Session,
    list: &str,
    entry: Node,
    columns: &[MemoryColumn<'_>],
) -> Result<(), Diagnostic> {
    let source = Parsed::of_node(Node::table([(list.to_string(), Node::from_iter([entry]))]));
    let added = lower::add(session, &source.document()?, &in_memory(Data::Columns(columns), &ReadOptions::default()));
    added.map(|_| ()).map_err(|fault| source.error_of(fault))
}

fn in_memory<'a>(data: Data<'a>, options: &'a ReadOptions) -> Surroundings<'a> {
    Surroundings { file: Path::new(""), options, data, place: &|_, _, _| Location::default() }
}
