//! Reader of `[[test]]`: one test, or one for each socket in its data.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{Context, Declared, Found, data_folder, format, movement, quantity, station};
use crate::axis::AxisKind;
use crate::error::ModelError;
use crate::files::table::{self, memory, request::Request};
use crate::files::toml::document::{Table, Value};
use crate::instrument::SharedBy;
use crate::instrument::set_up::SetUp;
use crate::session::expression::Length;
use crate::session::motion::Motion;
use crate::session::planned;
use crate::session::{Test, check};

/// The name of a test, which must be unique.
pub(super) fn name(table: &mut Table<'_>, declared: &[Declared]) -> Result<String, ModelError> {
    let value = table.require("name", "a name that no other test has")?;
    let name = value.text()?;
    check::name(&name, declared.iter().map(|test| test.name.as_str()))
        .map_err(|(message, help)| value.error(message, Some(help)))?;
    table.name = format!("test \"{name}\"");
    Ok(name)
}

/// Reads one `[[test]]` and its data.
pub(super) fn tests(
    context: &Context<'_>,
    name: &str,
    mut table: Table<'_>,
    found: &mut Found,
) -> Result<Vec<Test>, ModelError> {
    let SetUp { station: written, priors, socket } = station::set_up(context, &mut table)?;
    let (station, geometry) = (written.map(|length| length.mm), written.map(|length| length.length.clone()));
    let mut group = |key: &'static str, default: &str| match table.take(key) {
        Some(value) => value.text(),
        None => Ok(default.to_string()),
    };
    let setup = group("setup", name)?;
    let spindle_setup = group("spindle_setup", context.instrument.spindle_setup(name))?;
    let has_bar = context.instrument.shares(SharedBy::BarSetup);
    let bar_setup = if has_bar { group("bar_setup", name)? } else { name.to_string() };
    let HeldPositions { mut at, written: at_written, listed } = at(context, &mut table)?;
    let format = match table.take("format") {
        Some(value) => format::format(value.table(format!("[test.format] of \"{name}\""))?)?,
        None => context.format.clone(),
    };
    let columns = match table.take("columns") {
        Some(value) => Some(format::columns(value.table(format!("[test.columns] of \"{name}\""))?)?),
        None => context.columns.clone(),
    };
    let (sweep, path) = (table.take("sweep"), table.take("path"));
    let motion = match (sweep, path) {
        (Some(_), Some(path)) => {
            let help = "a test moves one axis (`sweep`) or several together (`path`)";
            return Err(path.source.error(
                path.key_span.clone(),
                format!("test \"{name}\" has both `sweep` and `path`"),
                Some(help.into()),
            ));
        }
        (Some(sweep), None) => Some(movement::sweep(context, sweep, &station)?),
        (None, Some(path)) => Some(movement::path(context, path, &station)?),
        (None, None) => None,
    };
    let data = table.take("data");
    if data.is_none() && matches!(motion, None | Some(Motion::List)) {
        let help = "add `data = \"….csv\"`, or the motion of the axes: `sweep = { … }` or `path = { … }`";
        return Err(table.error(format!("test \"{name}\" has neither data nor a motion"), Some(help.into())));
    }
    let span = table.span.clone();
    let source = table.source;
    table.finish()?;
    planned::centre_circle(context.machine, &station, motion.as_ref(), &listed, &mut at);

    let mut test = Test {
        name: name.to_string(),
        station,
        geometry,
        priors,
        setup,
        spindle_setup,
        bar_setup,
        socket,
        motion,
        at,
        at_written,
        readings: None,
    };
    let here = |(message, help): (String, String)| source.error(span.clone(), message, Some(help));
    let Some(data) = data else {
        check::plan(context.machine, &test).map_err(here)?;
        return Ok(vec![test]);
    };
    if !context.options.read_data {
        return Ok(vec![test]);
    }
    let request = Request {
        machine: context.machine,
        test: &test,
        store: &context.options.store,
        at_listed: &listed,
        format,
        // An empty table maps no column: the file has the default names.
        columns: columns.as_deref().filter(|columns| !columns.is_empty()),
    };
    let (by_socket, warnings) = match context.memory {
        Some(columns) => memory::read(columns, &request)?,
        None => {
            let data = table::read(&data_file(context, &data)?, &request)?;
            found.stamps.push(data.stamp);
            (data.by_socket, data.warnings)
        }
    };
    found.warnings.extend(warnings);
    let mut tests = Vec::new();
    for (socket, readings) in by_socket {
        let doubts = check::readings(context.machine, &test, &readings).map_err(here)?;
        found.warnings.extend(doubts);
        let Some(socket) = socket else {
            test.readings = Some(Arc::new(readings));
            return Ok(vec![test]);
        };
        if test.socket.is_some() {
            return Err(here((
                format!("test \"{name}\" names a socket, and a column of its data names sockets too"),
                "keep one of them".into(),
            )));
        }
        tests.push(Test {
            name: format!("{name}/{socket}"),
            socket: Some(socket),
            readings: Some(Arc::new(readings)),
            ..test.clone()
        });
    }
    Ok(tests)
}

/// Positions at which a test holds its axes, by axis.
struct HeldPositions {
    at: Vec<f64>,
    /// As written, for linear axes stated in mm.
    written: Vec<Option<Length>>,
    /// Whether the test states the position.
    listed: Vec<bool>,
}

/// `at = { x_mm = 0, … }`.
fn at(context: &Context<'_>, table: &mut Table<'_>) -> Result<HeldPositions, ModelError> {
    let machine = context.machine;
    let axes = machine.axes.len();
    let mut held = HeldPositions { at: vec![0.0; axes], written: vec![None; axes], listed: vec![false; axes] };
    let Some(value) = table.take("at") else {
        return Ok(held);
    };
    for entry in value.table("`at`".into())?.remaining_values()? {
        let Some((axis, unit)) = quantity::axis_position(machine, &entry.key) else {
            let known: Vec<String> = machine.axes.iter().map(|axis| axis.column("")).collect();
            let message = format!("`at` has the unknown position `{}`", entry.key);
            let help = format!("known: {}", known.join(", "));
            return Err(entry.source.error(entry.key_span.clone(), message, Some(help)));
        };
        if held.listed[axis] {
            let message = format!("`at` gives the position of axis `{}` twice", machine.axes[axis].name);
            return Err(entry.source.error(entry.key_span.clone(), message, None));
        }
        let (written, number) = context.length(&entry)?;
        held.at[axis] = unit.to_internal(number);
        let in_mm = machine.axes[axis].kind == AxisKind::Linear && unit == quantity::Unit::Times(1.0);
        held.written[axis] = in_mm.then_some(written);
        held.listed[axis] = true;
    }
    Ok(held)
}

/// The data file: in the data directory if one is given, else beside the session file.
fn data_file(context: &Context<'_>, data: &Value<'_>) -> Result<PathBuf, ModelError> {
    let named = data.text()?;
    let beside = context.file.parent().unwrap_or(Path::new("")).join(&named);
    let elsewhere = context.options.data_directory.as_ref().map(|folder| folder.join(&named));
    if let Some(found) = elsewhere.iter().chain([&beside]).find(|file| context.options.store.exists(file)) {
        data_folder::check(context.file, context.options, data, found)?;
        return Ok(found.clone());
    }
    let (looked, help) = match &elsewhere {
        Some(elsewhere) => (
            format!("{} and {}", elsewhere.display(), beside.display()),
            "check that the data folder is the one to which `data` is relative",
        ),
        None => (beside.display().to_string(), "state the data folder if the data are not beside the session file"),
    };
    let message = format!("the data file `{named}` does not exist; looked for {looked}");
    Err(data.file_error(message, help))
}
