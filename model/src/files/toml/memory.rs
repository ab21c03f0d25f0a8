//! A session in memory from the keys of a session file: its tables as text, its readings as columns of numbers.
//!
//! A program that has its readings in memory states machine, instrument and tests with the keys of a session file, and
//! gets the same checks, defaults and messages:
//!
//! ```
//! use abbe_model::files::toml::memory;
//! use abbe_model::files::table::memory::{MemoryColumn, Values};
//!
//! let head = "[machine]\nchain = \"w C b Z t\"\n[machine.axis.C]\ndirection = [0, 0, 1]\n\
//!             [machine.axis.Z]\ndirection = [0, 0, 1]\n[instrument]\nkind = \"ballbar\"\n";
//! let mut session = memory::session(head)?;
//! let test = "[[test]]\nname = \"C125\"\nbar_mm = 125\nworkpiece_ball_mm = [0, 100, 0]\n\
//!             spindle_ball_mm = [0, 0, 0]\nat = { z_mm = 75 }\ndata = \"C125.csv\"\n";
//! let columns = [("c_deg", [0.0, 90.0]), ("length_mm", [125.0, 125.0])];
//! let columns = columns.each_ref().map(|(name, values)| MemoryColumn { name, values: Values::Numbers(values), missing: &[] });
//! memory::add(&mut session, test, &columns)?;
//! assert_eq!(session.tests[0].readings.as_ref().map(|readings| readings.rows()), Some(2));
//! # Ok::<(), abbe_model::ModelError>(())
//! ```

use std::path::Path;

use super::body::BodyFiles;
use super::document::{Source, Table};
use super::{
    Context, Declared, Found, ReadOptions, body, driver_columns, effect, head, machine, sockets, test, tolerance,
};
use crate::error::ModelError;
use crate::files::table::memory::MemoryColumn;
use crate::files::table::request::Format;
use crate::session::{Session, setups};

/// A session without tests from the tables `[machine]` (inline), `[instrument]`, `[unknowns]`, `[constants]`, `[about]`.
///
/// # Errors
/// [`ModelError::Session`] as for a session file, without its line.
pub fn session(text: &str) -> Result<Session, ModelError> {
    parsed(text, |root| {
        let machine = root.require("machine", "the machine's tables")?.table("[machine]".into())?;
        head(machine::from_table(machine, &mut BodyFiles::default())?, root)
    })
}

/// The session of a whole text with its machine in it, without readings.
///
/// # Errors
/// As [`session`].
pub fn plan(text: &str) -> Result<Session, ModelError> {
    parsed(text, |root| {
        let machine = root.require("machine", "the machine's tables")?.table("[machine]".into())?;
        let mut session = head(machine::from_table(machine, &mut BodyFiles::default())?, root)?;
        // The layout of data files has no meaning without them.
        drop(root.take("format"));
        drop(root.take("columns"));
        add_tables(&mut session, root, None)?;
        Ok(session)
    })
}

/// Adds the tests, effects and distances of sockets of a text. Tests with `data` have the readings of the columns,
/// whatever the name of the file. After an error the session is unchanged.
///
/// # Errors
/// [`ModelError::Session`] as for a session file, without its line.
pub fn add(session: &mut Session, text: &str, columns: &[MemoryColumn<'_>]) -> Result<(), ModelError> {
    parsed(text, |root| add_tables(session, root, Some(columns)))
}

/// Adds tests with readings of these columns, or without readings.
fn add_tables(
    session: &mut Session,
    root: &mut Table<'_>,
    columns: Option<&[MemoryColumn<'_>]>,
) -> Result<(), ModelError> {
    let options = ReadOptions { read_data: columns.is_some(), ..ReadOptions::default() };
    let mut found = Found::default();
    let (tests, effects, distances, tolerance, clearance) = {
        let context = Context {
            file: Path::new(""),
            machine: &session.machine,
            instrument: session.instrument,
            constants: &session.constants,
            format: Format::default(),
            columns: None,
            memory: columns,
            options: &options,
        };
        let mut declared = declared(session);
        let mut tests = session.tests.clone();
        for item in root.take("test").map_or(Ok(Vec::new()), |value| value.list("tables [[test]]"))? {
            let mut table = item.table("test".into())?;
            let name = test::name(&mut table, &declared)?;
            let parts = test::tests(&context, &name, table, &mut found)?;
            declared.push(Declared { name, parts: parts.iter().map(|test| test.name.clone()).collect() });
            for test in parts {
                found.warnings.extend(setups::differing(&tests, &test));
                tests.push(test);
            }
        }
        let effects = root.take("effect").map_or(Ok(Vec::new()), |value| value.list("tables [[effect]]"))?;
        let columns = driver_columns(&context, &tests);
        let effects = effects.into_iter().map(|item| effect::effect(&context, &declared, &columns, item));
        let effects = effects.collect::<Result<Vec<_>, _>>()?;
        let distances = sockets::socket_distances(session.instrument, &tests, root, options.read_data)?;
        let names: Vec<&str> = tests.iter().map(|test| test.name.as_str()).collect();
        let tolerance = tolerance::tolerance(&session.machine, &session.unknowns, &names, root)?;
        (tests, effects, distances, tolerance, body::clearance(root)?)
    };
    session.tests = tests;
    session.effects.extend(effects);
    session.socket_distances.extend(distances);
    session.clearance = clearance.or(session.clearance);
    session.tolerance = tolerance.or(session.tolerance.take());
    session.warnings.extend(found.warnings);
    Ok(())
}

/// The names by which effects refer to the tests: those of tests, and those of groups of one test for each socket.
fn declared(session: &Session) -> Vec<Declared> {
    let mut declared: Vec<Declared> = Vec::new();
    for test in &session.tests {
        let suffix = test.socket.as_ref().map(|socket| format!("/{socket}"));
        let name = suffix.and_then(|suffix| test.name.strip_suffix(&suffix)).unwrap_or(&test.name);
        match declared.iter_mut().find(|group| group.name == name) {
            Some(group) => group.parts.push(test.name.clone()),
            None => declared.push(Declared { name: name.to_string(), parts: vec![test.name.clone()] }),
        }
    }
    declared
}

/// Reads all of a text. A fault in it has no place that the user knows.
fn parsed<T>(text: &str, read: impl FnOnce(&mut Table<'_>) -> Result<T, ModelError>) -> Result<T, ModelError> {
    let source = Source::new(Path::new(""), text);
    let whole = || {
        let mut root = source.parse()?;
        let found = read(&mut root)?;
        root.finish()?;
        Ok(found)
    };
    whole().map_err(|fault| match fault {
        ModelError::Input { message, help, .. } => ModelError::Session { message, help: help.unwrap_or_default() },
        ModelError::FileAccess { message, help, .. } => ModelError::Session { message, help },
        other => other,
    })
}
