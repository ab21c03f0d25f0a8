//! From a document to the domain, in one pass.

pub(crate) mod body;
mod effect;
mod head;
mod layout;
mod machine;
mod measurement;
mod movement;
mod tolerance;

use std::collections::BTreeSet;
use std::path::Path;

use abbe_model::chain::Machine;
use abbe_model::diagnostic::Location;
use abbe_model::document::effect as effect_document;
use abbe_model::document::fault::{Fault, Within};
use abbe_model::document::node::Node;
use abbe_model::document::session::{self as document, Parts};
use abbe_model::driver::column;
use abbe_model::effect::Effect;
use abbe_model::instrument::{InstrumentKind, InstrumentParameter, composed, kinds};
use abbe_model::session::expression::Constant;
use abbe_model::session::{self, Session, Test};
use rayon::prelude::*;

use crate::access::ReadOptions;
use crate::check;
use crate::stamp::FileStamp;
use crate::table::memory::MemoryColumn;
use crate::table::request::{ColumnMapping, Format};
pub(crate) use machine::machine;

/// Where the readings of tests with `data` are.
#[derive(Clone, Copy)]
pub(crate) enum Data<'a> {
    /// In their files.
    Files,
    /// In these columns, whatever the names of the files.
    Columns(&'a [MemoryColumn<'a>]),
    /// Nowhere: the session is only a plan.
    None,
}

/// What a document does not say of itself.
pub(crate) struct Surroundings<'a> {
    /// The session file.
    pub file: &'a Path,
    /// Where its files lie.
    pub options: &'a ReadOptions,
    /// The readings.
    pub data: Data<'a>,
    /// The place of a key: the table, the item if it is a list, and the keys in it.
    pub place: &'a (dyn Fn(&[&str], Option<usize>, &[&str]) -> Location + Sync),
}

/// Context of the session for tests.
struct Context<'a> {
    from: &'a Surroundings<'a>,
    machine: &'a Machine,
    /// The instrument of tests that name no other.
    instrument: InstrumentKind,
    constants: &'a [Constant],
    /// The targets of a composed measurement.
    targets: &'a Node,
    format: Format,
    columns: Option<Vec<ColumnMapping>>,
}

/// What was found while the tests were read, beside the tests.
#[derive(Default)]
pub(crate) struct Found {
    /// Warnings about usable tests.
    pub warnings: Vec<String>,
    /// The data files.
    pub stamps: Vec<FileStamp>,
}

/// The name of a `[[test]]`, with the tests that it declares: one for each socket, else one.
struct Declared {
    name: String,
    parts: Vec<String>,
}

/// A session without tests and effects: machine, instrument, constants, notes, the errors to estimate.
pub(crate) fn head(
    machine: Machine,
    document: &document::Session,
    comment: &dyn Fn(&[&str]) -> Option<String>,
) -> Result<Session, Fault> {
    let constants = head::constants(&document.constants, |name| comment(&["constants", name])).within("constants")?;
    let (kind, targets) = composed::composed(document.instrument.kind, &document.parts, &machine)?;
    let [noise_mm, noise_rad, resolution_mm, resolution_rad] =
        head::noise(&document.instrument).within("instrument")?;
    let about = head::about(&document.about).within("about")?;
    let unknowns = head::unknowns(&machine, kind, &document.unknowns).within("errors").within("unknowns")?;
    Ok(Session {
        constants,
        noise_mm,
        noise_rad,
        resolution_mm,
        resolution_rad,
        unknowns,
        about,
        targets,
        ..Session::new(machine, kind)
    })
}

/// Adds tests, effects, distances of sockets, limits, sizes. After an error the session is unchanged.
pub(crate) fn add(session: &mut Session, parts: &Parts, surroundings: &Surroundings<'_>) -> Result<Found, Fault> {
    let mut found = Found::default();
    let format = parts.format.as_ref().map(|format| layout::format(format).within("format")).transpose()?;
    let columns = parts.columns.as_ref();
    let columns =
        columns.map(|columns| layout::columns(columns, |path| (surroundings.place)(&["columns"], None, path)));
    let context = Context {
        from: surroundings,
        machine: &session.machine,
        instrument: session.instrument,
        constants: &session.constants,
        targets: &session.targets,
        format: format.unwrap_or_default(),
        columns,
    };
    let mut declared = declared(session);
    let mut tests = session.tests.clone();
    // Their data files are read side by side. Errors and warnings are in the order of the tests.
    let read = parts.test.par_iter().enumerate().map(|(item, document)| {
        let mut found = Found::default();
        measurement::tests(&context, item, document, &mut found).map(|parts| (parts, found))
    });
    let read: Vec<Result<_, Fault>> = read.collect();
    for ((item, document), read) in parts.test.iter().enumerate().zip(read) {
        let others = declared.iter().map(|test| test.name.as_str());
        check::name(&document.name, others).within("name").within_item(item).within("test")?;
        let (parts, of_test) = read.within_item(item).within("test")?;
        found.warnings.extend(of_test.warnings);
        found.stamps.extend(of_test.stamps);
        declared.push(Declared {
            name: document.name.clone(),
            parts: parts.iter().map(|test| test.name.clone()).collect(),
        });
        for test in parts {
            found.warnings.extend(check::differing(&tests, &test));
            found.warnings.extend(check::repeated(&tests, &test));
            tests.push(test);
        }
    }
    let of_effects = effect::Context {
        machine: &session.machine,
        instrument: session.instrument,
        of_instruments: &session::instrument_parameters(session.instrument, &tests),
        declared: &declared,
        columns: driver_columns(&context, &tests),
    };
    let effects = parts.effect.iter().enumerate();
    let effects = effects.map(|(item, effect)| effect::effect(&of_effects, effect).within_item(item));
    let effects = effects.collect::<Result<Vec<_>, _>>().within("effect")?;
    let read = !matches!(surroundings.data, Data::None);
    let distances = head::socket_distances(session.instrument, &tests, &parts.socket_distance, read);
    let distances = distances.within("socket_distance")?;
    let names: Vec<&str> = tests.iter().map(|test| test.name.as_str()).collect();
    let tolerance = parts
        .tolerance
        .as_ref()
        .map(|limits| tolerance::tolerance(&session.machine, &session.unknowns, &names, limits).within("tolerance"));
    let tolerance = tolerance.transpose()?;
    session.tests = tests;
    session.effects.extend(effects);
    session.socket_distances.extend(distances);
    session.clearance = parts.clearance.or(session.clearance);
    session.tolerance = tolerance.or(session.tolerance.take());
    session.warnings.extend(found.warnings.iter().cloned());
    if !parts.test.is_empty() {
        session.warnings.extend(check::noise_of_no_channel(session));
    }
    session.lever_mm = session.stated_lever_mm().unwrap_or(session.lever_mm);
    Ok(found)
}

/// An effect of a session with this machine, instrument and names of tests.
pub(crate) fn effect_of(
    machine: &Machine,
    of_instruments: &[InstrumentParameter],
    tests: &[String],
    document: &effect_document::Effect,
) -> Result<Effect, Fault> {
    let declared: Vec<Declared> =
        tests.iter().map(|name| Declared { name: name.clone(), parts: vec![name.clone()] }).collect();
    // Messages name it for a component that is not among the parameters.
    let instrument = kinds()[0];
    let columns = BTreeSet::new();
    effect::effect(&effect::Context { machine, instrument, of_instruments, declared: &declared, columns }, document)
}

/// The driver columns of the data, and those that `[columns]` names.
fn driver_columns(context: &Context<'_>, tests: &[Test]) -> BTreeSet<String> {
    let recorded = tests.iter().filter_map(|test| test.readings.as_ref()).flat_map(|readings| readings.drivers.keys());
    let named = context.columns.iter().flatten().filter_map(|entry| column::of_files(&entry.own));
    recorded.cloned().chain(named.map(str::to_string)).collect()
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
