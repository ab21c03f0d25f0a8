//! Machine and session files.

mod effect;
mod layout;
mod machine;
mod movement;
pub(crate) mod quantity;
mod station;
mod test;

use std::path::{Path, PathBuf};

pub use machine::machine;

use super::document::{Source, Table, Value};
use super::expression::Length;
use super::table::{Format, Mapped};
use super::{Session, SocketDistance, Test};
use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::component::{ErrorKind, ErrorName, Freedom};
use crate::error::{ModelError, Place};
use crate::instrument::InstrumentKind;
use quantity::MICROMETRE;

/// How a session is read.
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// Where the data files lie when they do not lie beside the session file.
    pub data_directory: Option<PathBuf>,
    /// Whether the data files are read; without, a session is only its plan.
    pub read_data: bool,
}

impl Default for ReadOptions {
    /// Data are read, from beside the session file.
    fn default() -> Self {
        ReadOptions {
            data_directory: None,
            read_data: true,
        }
    }
}

/// What the readers of tests and effects need of the session around them.
struct Context<'a> {
    /// The session file.
    file: &'a Path,
    machine: &'a Machine,
    instrument: InstrumentKind,
    constants: &'a [(String, f64)],
    format: Format,
    columns: Option<Vec<Mapped>>,
    options: &'a ReadOptions,
}

impl Context<'_> {
    /// A length: a number, or an expression over the constants.
    fn length(&self, value: &Value<'_>) -> Result<(Length, f64), ModelError> {
        let Some(text) = value.as_text() else {
            let number = value.number_or_inf("a number or an expression in quotes")?;
            if !number.is_finite() {
                return Err(value.error(format!("`{}` is infinite; a length is expected", value.key), None));
            }
            return Ok((Length::Number(number), number));
        };
        let names: Vec<&str> = self.constants.iter().map(|(name, _)| name.as_str()).collect();
        let length = Length::parse(text, &names).map_err(|fault| {
            let help = "a length is a number or an expression over [constants] with + - * / ^2 sqrt( )";
            value.error(
                format!("`{}` = \"{text}\": {fault}", value.key),
                Some(help.into()),
            )
        })?;
        let number = length.evaluate(&|name: &str| {
            let found = self.constants.iter().find(|(known, _)| known == name);
            found.map_or(f64::NAN, |(_, value)| *value)
        });
        if !number.is_finite() {
            let message = format!(
                "`{}` = \"{text}\" comes to {number} with these constants",
                value.key
            );
            return Err(value.error(
                message,
                Some("a root of a negative number, or a division by zero?".into()),
            ));
        }
        Ok((length, number))
    }

    /// Three lengths.
    fn point(&self, value: Value<'_>) -> Result<([Length; 3], [f64; 3]), ModelError> {
        let items = value.three("a list of three lengths")?;
        let mut lengths = [const { Length::Number(0.0) }; 3];
        let mut numbers = [0.0; 3];
        for (i, item) in items.iter().enumerate() {
            (lengths[i], numbers[i]) = self.length(item)?;
        }
        Ok((lengths, numbers))
    }
}

/// Reads a session file, its machine and, if asked for, its data.
///
/// # Errors
/// Whatever keeps the session from being used: file, line, what was found and expected, and what to do.
pub fn session(path: &Path, options: &ReadOptions) -> Result<Session, ModelError> {
    let source = Source::read(path, "the session file")?;
    let mut root = source.parse()?;
    let machine = session_machine(path, &mut root)?;
    let constants = constants(&mut root)?;
    let instrument = Instrument::read(&mut root)?;
    let unknowns = unknowns(&machine, instrument.kind, &mut root)?;

    let format = match root.take("format") {
        Some(value) => layout::format(value.table("[format]".into())?)?,
        None => Format::default(),
    };
    let columns = match root.take("columns") {
        Some(value) => Some(layout::columns(value.table("[columns]".into())?)?),
        None => None,
    };
    let context = Context {
        file: path,
        machine: &machine,
        instrument: instrument.kind,
        constants: &constants,
        format,
        columns,
        options,
    };
    let mut warnings = Vec::new();
    let (tests, declared) = tests(&context, &mut root, &mut warnings)?;
    let effects = match root.take("effect") {
        Some(value) => value
            .list("tables [[effect]]")?
            .into_iter()
            .map(|item| effect::effect(&context, &declared, item))
            .collect::<Result<Vec<_>, _>>()?,
        None => Vec::new(),
    };
    let socket_distances = socket_distances(instrument.kind, &tests, &mut root, options.read_data)?;
    root.finish()?;
    Ok(Session {
        file: path.to_path_buf(),
        constants,
        instrument: instrument.kind,
        noise_mm: instrument.noise_mm,
        resolution_mm: instrument.resolution_mm,
        unknowns,
        effects,
        tests,
        socket_distances,
        warnings,
        machine,
    })
}

/// The machine: a file beside the session, or the tables themselves.
fn session_machine(path: &Path, root: &mut Table<'_>) -> Result<Machine, ModelError> {
    let value = root.need(
        "machine",
        "[machine] with `file = \"machine.toml\"`, or the machine's tables in it",
    )?;
    let mut table = value.table("[machine]".into())?;
    let Some(file) = table.take("file") else {
        return machine::from_table(table);
    };
    let named = file.text()?;
    let found = path.parent().unwrap_or(Path::new("")).join(&named);
    if !found.exists() {
        let message = format!(
            "the machine file `{named}` is not there; looked for {}",
            found.display()
        );
        return Err(file.error(message, Some("its name is relative to the session file".into())));
    }
    table.finish()?;
    machine(&found)
}

fn constants(root: &mut Table<'_>) -> Result<Vec<(String, f64)>, ModelError> {
    let Some(value) = root.take("constants") else {
        return Ok(Vec::new());
    };
    let mut constants = Vec::new();
    for entry in value.table("[constants]".into())?.take_all() {
        let name = entry.key.clone();
        let mut letters = name.chars();
        let valid = letters.next().is_some_and(|c| c.is_alphabetic() || c == '_')
            && letters.all(|c| c.is_alphanumeric() || c == '_')
            && name != "sqrt";
        if !valid {
            let help = "a letter, then letters, digits and `_`; `sqrt` is taken";
            let message = format!("a constant cannot be called `{name}`");
            return Err(entry
                .source
                .error(entry.key_span.clone(), message, Some(help.into())));
        }
        constants.push((name, entry.number()?));
    }
    Ok(constants)
}

struct Instrument {
    kind: InstrumentKind,
    noise_mm: Option<f64>,
    resolution_mm: Option<f64>,
}

impl Instrument {
    fn read(root: &mut Table<'_>) -> Result<Instrument, ModelError> {
        let value = root.need("instrument", "[instrument] with `kind = \"ballbar\"`")?;
        let mut table = value.table("[instrument]".into())?;
        let value = table.need("kind", "\"ballbar\", \"tracker\" or \"socket\"")?;
        let word = value.text()?;
        let Some(kind) = InstrumentKind::ALL.into_iter().find(|kind| kind.word() == word) else {
            if word == "probe" || word == "r-test" {
                let help = "ballbar, tracker and socket are";
                return Err(value.error(
                    format!("the instrument \"{word}\" is not built yet"),
                    Some(help.into()),
                ));
            }
            return Err(value.unlike("\"ballbar\", \"tracker\" or \"socket\""));
        };
        let mut not_negative = |key: &'static str| -> Result<Option<f64>, ModelError> {
            let Some(value) = table.take(key) else {
                return Ok(None);
            };
            let number = value.number()?;
            if number < 0.0 {
                let message = format!("`{key}` is {number}; it cannot be negative");
                return Err(value.error(message, None));
            }
            Ok(Some(number * MICROMETRE))
        };
        let noise_mm = not_negative("noise_um")?;
        let resolution_mm = not_negative("resolution_um")?.filter(|step| *step > 0.0);
        table.finish()?;
        Ok(Instrument {
            kind,
            noise_mm,
            resolution_mm,
        })
    }
}

/// The errors to be identified: those stated, or what the instrument is there for.
fn unknowns(
    machine: &Machine,
    kind: InstrumentKind,
    root: &mut Table<'_>,
) -> Result<Vec<ErrorName>, ModelError> {
    let stated = match root.take("unknowns") {
        None => None,
        Some(value) => {
            let mut table = value.table("[unknowns]".into())?;
            let errors = table.take("errors");
            table.finish()?;
            errors
        }
    };
    let Some(value) = stated else {
        return Ok(match kind {
            InstrumentKind::BallBar => default_unknowns(machine),
            InstrumentKind::Tracker | InstrumentKind::Socket => Vec::new(),
        });
    };
    let mut unknowns: Vec<ErrorName> = Vec::new();
    for item in value.list("a list of error names")? {
        let name = error_name(machine, &item)?;
        if unknowns.contains(&name) {
            return Err(item.error(format!("`{name}` stands twice among the unknowns"), None));
        }
        unknowns.push(name);
    }
    Ok(unknowns)
}

/// An error of the machine by its name.
fn error_name(machine: &Machine, item: &Value<'_>) -> Result<ErrorName, ModelError> {
    let text = item.text()?;
    let Some(mut name) = ErrorName::parse(&text) else {
        let help = "ISO 230-1 names such as \"EY0A\" (location) and \"EYA\" (motion), or `e_y0a`, `θ_z0c`";
        return Err(item.error(format!("\"{text}\" is no error's name"), Some(help.into())));
    };
    match quantity::axis_index(machine, &name.axis) {
        Some(index) => name.axis.clone_from(&machine.axes[index].name),
        None => {
            let (message, help) = quantity::no_axis(machine, &name.axis);
            return Err(item.error(format!("\"{text}\": {message}"), Some(help)));
        }
    }
    Ok(name)
}

/// The position and orientation errors of every rotary axis, in alphabetical order of the axes: its location errors without the two
/// that its own movement hides.
fn default_unknowns(machine: &Machine) -> Vec<ErrorName> {
    let mut rotary: Vec<_> = machine
        .axes
        .iter()
        .filter(|axis| axis.kind == AxisKind::Rotary)
        .collect();
    rotary.sort_by(|a, b| a.name.cmp(&b.name));
    rotary
        .into_iter()
        .flat_map(|axis| {
            let own = axis.own_freedom().index() % 3;
            Freedom::ALL
                .into_iter()
                .filter(move |freedom| freedom.index() % 3 != own)
                .map(|freedom| ErrorName {
                    kind: ErrorKind::Location,
                    freedom,
                    axis: axis.name.clone(),
                })
        })
        .collect()
}

/// A `[[test]]` by name, with the tests that came of it: one for each socket, else itself.
struct Declared {
    name: String,
    parts: Vec<String>,
}

/// The tests, and the names that effects may use for them.
fn tests(
    context: &Context<'_>,
    root: &mut Table<'_>,
    warnings: &mut Vec<String>,
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
        let parts = test::tests(context, &name, table, warnings)?;
        declared.push(Declared {
            name,
            parts: parts.iter().map(|test| test.name.clone()).collect(),
        });
        tests.extend(parts);
    }
    if tests.is_empty() {
        return Err(ModelError::Input {
            place: Place::file(context.file),
            message: "a session without tests".into(),
            help: Some("add at least one [[test]]".into()),
        });
    }
    Ok((tests, declared))
}

fn socket_distances(
    kind: InstrumentKind,
    tests: &[Test],
    root: &mut Table<'_>,
    read: bool,
) -> Result<Vec<SocketDistance>, ModelError> {
    let Some(value) = root.take("socket_distance") else {
        return Ok(Vec::new());
    };
    if kind != InstrumentKind::Socket {
        let message = format!(
            "[[socket_distance]] in a session whose instrument is a {}",
            kind.word()
        );
        return Err(value.source.error(value.key_span.clone(), message, None));
    }
    let mut distances = Vec::new();
    for item in value.list("tables [[socket_distance]]")? {
        let mut table = item.table("[[socket_distance]]".into())?;
        let between = table.need("between", "the two sockets, as [\"0\", \"1\"]")?;
        let (source, span) = (between.source, between.span.clone());
        let mut names = Vec::new();
        for name in between.list("a list of two sockets")? {
            let socket = name.text()?;
            // Sockets that a column names are known once the data are read.
            if read
                && !tests
                    .iter()
                    .any(|test| test.socket.as_deref() == Some(socket.as_str()))
            {
                let mut known: Vec<&str> = tests.iter().filter_map(|test| test.socket.as_deref()).collect();
                known.dedup();
                let help = format!("sockets here: {}", known.join(", "));
                return Err(name.error(format!("no test has the socket \"{socket}\""), Some(help)));
            }
            names.push(socket);
        }
        let Ok(between) = <[String; 2]>::try_from(names) else {
            return Err(source.error(span, "`between` takes two sockets", None));
        };
        if between[0] == between[1] {
            return Err(source.error(span, "`between` takes two different sockets", None));
        }
        let distance_mm = table.need("mm", "the distance in mm")?.positive()?;
        let u_mm = match table.take("u_um") {
            Some(value) => {
                let u = value.number()?;
                if u < 0.0 {
                    return Err(value.error(format!("`u_um` is {u}; it cannot be negative"), None));
                }
                u * MICROMETRE
            }
            None => 0.0,
        };
        table.finish()?;
        distances.push(SocketDistance {
            between,
            distance_mm,
            u_mm,
        });
    }
    Ok(distances)
}
