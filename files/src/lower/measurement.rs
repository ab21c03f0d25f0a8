//! A test with its data: one, or one for each socket in its data.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use abbe_model::axis::AxisKind;
use abbe_model::document::fault::{Fault, Within};
use abbe_model::document::measurement as document;
use abbe_model::document::node::{Named, Node};
use abbe_model::document::print;
use abbe_model::document::schema;
use abbe_model::document::value;
use abbe_model::instrument::set_up::SetUp;
use abbe_model::instrument::{InstrumentKind, Station, kinds};
use abbe_model::session::Contributors;
use abbe_model::session::expression::Length;
use abbe_model::session::{Test, planned};
use abbe_model::unit::Unit;
use abbe_model::words::with_article;

use super::Data;
use super::{Context, Found, layout, movement};
use crate::access;
use crate::axes;
use crate::check;
use crate::table::fill::Filling;
use crate::table::{self, memory, request::Request};

/// The tests of one `[[test]]`, the `item`th of its document.
pub(super) fn tests(
    context: &Context<'_>,
    item: usize,
    document: &document::Test,
    found: &mut Found,
) -> Result<Vec<Test>, Fault> {
    let name = &document.name;
    // A test that names the session's instrument has its targets too.
    let other = document.kind.filter(|kind| kind.word() != context.instrument.word());
    let kind = other.unwrap_or(context.instrument);
    let common = context.targets.entries().iter();
    let common = common.filter(|entry| other.is_none() && document.set_up.get(&entry.key).is_none());
    let keys = document.set_up.entries().iter().chain(common).map(|entry| (entry.key.clone(), entry.node.clone()));
    let SetUp { station: written, priors, socket, bar_setup } = set_up(kind, &Node::table(keys), context)?;
    let (station, geometry) = (written.map(|length| length.mm), written.map(|length| length.length.clone()));
    let HeldPositions { mut at, written: at_written, listed } = at(context, &document.at).within("at")?;
    let format = document.format.as_ref().map(|format| layout::format(format).within("format")).transpose()?;
    let columns = document.columns.as_ref().map(|columns| {
        layout::columns(columns, |path| (context.from.place)(&["test"], Some(item), &[&["columns"], path].concat()))
    });
    let motion = match (&document.sweep, &document.path) {
        (Some(_), Some(_)) => {
            let help = "a test moves one axis (`sweep`) or several together (`path`)";
            let message = format!("test \"{name}\" has both `sweep` and `path`");
            return Err(Fault::new(message, help).on_key().at("path"));
        }
        (Some(sweep), None) => Some(movement::sweep(context, sweep, &station).within("sweep")?),
        (None, Some(path)) => movement::path(context, path, &station).within("path")?,
        (None, None) => None,
    };
    let contributors = document.contributors.map(|of| contributors(of, &station).within("contributors")).transpose()?;
    let is_measured = document.data.is_some() || matches!(context.from.data, Data::Columns([_, ..]));
    if !is_measured && motion.is_none() {
        let help = "add `data = \"….csv\"`, or the motion of the axes: `sweep = { … }` or `path = { … }`";
        return Err(Fault::of_table("has neither data nor a motion", help));
    }

    planned::centre_circle(context.machine, &station, motion.as_ref(), &listed, &mut at);
    let mut test = Test {
        name: name.clone(),
        station,
        geometry,
        priors,
        setup: document.setup.clone().unwrap_or_else(|| name.clone()),
        spindle_setup: document.spindle_setup.clone().unwrap_or_else(|| kind.spindle_setup(name).to_string()),
        bar_setup: bar_setup.unwrap_or_else(|| name.clone()),
        socket,
        motion,
        at,
        at_written,
        contributors,
        readings: None,
    };
    if !is_measured {
        check::plan(context.machine, &test)?;
    }
    if !is_measured || matches!(context.from.data, Data::None) {
        return Ok(vec![test]);
    }

    let columns = columns.as_ref().or(context.columns.as_ref());
    let request = Request {
        machine: context.machine,
        test: &test,
        store: &context.from.options.store,
        at_listed: &listed,
        format: format.unwrap_or_else(|| context.format.clone()),
        // An empty table maps no column: the file has the default names.
        columns: columns.map(Vec::as_slice).filter(|columns| !columns.is_empty()),
    };
    let Filling { by_socket, quantities, warnings } = match context.from.data {
        Data::Columns(columns) => memory::read(columns, &request)?,
        _ => {
            let named = document.data.as_deref().unwrap_or_default();
            let (stamp, filling) = table::read(&data_file(context, named).within("data")?, &request)?;
            found.stamps.push(stamp);
            filling
        }
    };
    let has = |quantity| quantities.contains(&quantity);
    test.station.keep_channels(&has);
    test.geometry.keep_channels(&has);
    test.station.absent_channels_known(&mut test.priors);
    found.warnings.extend(warnings);
    let mut tests = Vec::new();
    for (socket, readings) in by_socket {
        let doubts = check::readings(context.machine, &test, &readings)?;
        found.warnings.extend(doubts);
        let Some(socket) = socket else {
            test.readings = Some(Arc::new(readings));
            return Ok(vec![test]);
        };
        if test.socket.is_some() {
            let what = "names a socket, and a column of its data names sockets too";
            return Err(Fault::of_table(what, "keep one of them"));
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

/// The instrument's keys of a test.
fn set_up(kind: InstrumentKind, keys: &Node, context: &Context<'_>) -> Result<SetUp, Fault> {
    let own = kind.entry();
    kind.set_up(keys, context.constants, context.machine).map_err(|fault| {
        let Some(key) = fault.unknown().map(str::to_string) else { return fault };
        match kinds().iter().find(|kind| kind.entry().keys().contains_key(&key)) {
            Some(other) => {
                let whose = if kind == context.instrument { "session" } else { "test" };
                let what = format!(
                    "belongs to {}; this {whose}'s instrument is {}",
                    with_article(other.word()),
                    with_article(own.word)
                );
                Fault::of_key(what, None).on_key().at(&key)
            }
            None => fault.also_known(schema::fields::<document::Test>()),
        }
    })
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
fn at(context: &Context<'_>, entries: &Named<value::Length>) -> Result<HeldPositions, Fault> {
    let machine = context.machine;
    let axes = machine.axes.len();
    let mut held = HeldPositions { at: vec![0.0; axes], written: vec![None; axes], listed: vec![false; axes] };
    for (key, length) in &entries.0 {
        let Some((axis, unit)) = axes::axis_position(machine, key) else {
            let known: Vec<String> = machine.axes.iter().map(|axis| axis.column("")).collect();
            let help = format!("known: {}", known.join(", "));
            return Err(Fault::new(format!("`at` has the unknown position `{key}`"), help).on_key().at(key));
        };
        if held.listed[axis] {
            let message = format!("`at` gives the position of axis `{}` twice", machine.axes[axis].name);
            return Err(Fault::new(message, None).on_key().at(key));
        }
        let (written, number) = length.evaluated(key, context.constants).within(key)?;
        held.at[axis] = unit.to_internal(number);
        let in_mm = machine.axes[axis].kind == AxisKind::Linear && unit == Unit::Millimetre;
        held.written[axis] = in_mm.then_some(written);
        held.listed[axis] = true;
    }
    Ok(held)
}

/// The contributors to the uncertainty of positioning figures, if the instrument reads such figures in their units.
fn contributors(document: Contributors, station: &Station<f64>) -> Result<Contributors, Fault> {
    if station.positioning().is_none() {
        let help = "a laser with a displacement and a sensor of angles have figures of positioning: remove the table";
        let message = format!("{} has no figures of positioning", station.kind().entry().phrase);
        return Err(Fault::new(message, help).on_key());
    }
    let is_angle = station.channels().first().is_some_and(|channel| channel.is_angle());
    let stated = print::json_of(&document)?;
    let mut keys = stated.as_object().into_iter().flatten().map(|(key, _)| key);
    match keys.find(|key| key.ends_with("_arcsec") != is_angle) {
        Some(key) => {
            let [of, reads] = if is_angle { ["lengths", "angles"] } else { ["angles", "lengths"] };
            Err(Fault::of_key(format!("is of {of}; the figures of this test are of {reads}"), None).on_key().at(key))
        }
        None => Ok(document),
    }
}

/// The data file: in the data directory if one is given, else beside the session file.
fn data_file(context: &Context<'_>, named: &str) -> Result<PathBuf, Fault> {
    let beside = context.from.file.parent().unwrap_or(Path::new("")).join(named);
    let elsewhere = context.from.options.data_directory.as_ref().map(|folder| folder.join(named));
    if let Some(found) = elsewhere.iter().chain([&beside]).find(|file| context.from.options.store.exists(file)) {
        access::check(context.from.file, context.from.options, ("data", named), found)?;
        return Ok(found.clone());
    }
    let (looked, help) = match &elsewhere {
        Some(elsewhere) => (
            format!("{} and {}", elsewhere.display(), beside.display()),
            "check that the data folder is the one to which `data` is relative",
        ),
        None => (beside.display().to_string(), "state the data folder if the data are not beside the session file"),
    };
    Err(Fault::file(format!("the data file `{named}` does not exist; looked for {looked}"), help))
}
