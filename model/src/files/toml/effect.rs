//! Reader of `[[effect]]`: component × driver × shape, and of its aliases `[[effect.alias]]`.

use std::collections::BTreeSet;

use super::shape::ShapeKeys;
use super::{Context, Declared, prior, quantity};
use crate::component::ErrorKind;
use crate::driver::{Driver, column};
use crate::effect::shape::{Entry, SHAPES};
use crate::effect::{Component, Effect, Shape};
use crate::error::ModelError;
use crate::files::spelling::known_names;
use crate::files::toml::document::{Table, Value};

/// Reads one `[[effect]]`.
///
/// `columns` are the driver columns of the data, `NAME_unit`.
pub(super) fn effect(
    context: &Context<'_>,
    declared: &[Declared],
    columns: &BTreeSet<String>,
    item: Value<'_>,
) -> Result<Effect, ModelError> {
    let mut table = item.table("[[effect]]".into())?;
    let aliases = match table.take("alias") {
        Some(value) => value.list("tables [[effect.alias]]")?,
        None => Vec::new(),
    };
    let alias = |item: Value<'_>| one(context, declared, columns, item.table("[[effect.alias]]".into())?);
    let aliases = aliases.into_iter().map(alias).collect::<Result<_, _>>()?;
    let assumed = match table.take("assumed") {
        Some(value) => value.boolean()?,
        None => false,
    };
    Ok(Effect { aliases, assumed, ..one(context, declared, columns, table)? })
}

/// Reads an effect without aliases.
fn one(
    context: &Context<'_>,
    declared: &[Declared],
    columns: &BTreeSet<String>,
    mut table: Table<'_>,
) -> Result<Effect, ModelError> {
    let component = component(context, &mut table)?;
    let word_value = table.require("shape", "the dependence of the component on the driver, such as \"harmonic\"")?;
    let word = word_value.text()?;
    let entry = Shape::entry_of(&word);
    let driver = driver(context, &mut table, &component, entry, columns)?;
    let Some(entry) = entry else {
        let words: Vec<&str> = SHAPES.iter().map(|entry| entry.word).collect();
        return Err(word_value.error(format!("\"{word}\" is not a shape"), Some(known_names(&word, &words))));
    };
    let axis = driver.kind_of_axis(context.machine, component.axis(context.machine));
    let kind = driver.kind();
    let (unit, default_scale) = (kind.unit(axis), kind.default_scale(axis));
    let shape = (entry.read)(&mut ShapeKeys::new(&mut table, &word_value, &word, unit, default_scale))?;
    drop(kind);
    entry.follows.check(&driver, driver.axis_kind(context.machine)).map_err(|help| {
        let message = format!("the shape \"{}\" cannot have the driver \"{driver}\"", shape.word());
        word_value.error(message, Some(help.to_string()))
    })?;
    let tests = tests(&mut table, declared)?;
    let prior = prior::read(&mut table, &component, &shape, context.instrument.unknowns())?;
    shape.check().map_err(|fault| word_value.error(fault.to_string(), None))?;
    table.finish()?;
    Ok(Effect { tests, prior, ..Effect::new(component, driver, shape) })
}

fn component(context: &Context<'_>, table: &mut Table<'_>) -> Result<Component, ModelError> {
    let value = table.require("component", "the component, such as \"EZC\" or \"workpiece_ball.x\"")?;
    let text = value.text()?;
    let instrument = || {
        let own = context.instrument.unknowns().iter();
        let names: Vec<String> = own
            .map(|unknown| match unknown.coordinate {
                "" => unknown.thing.to_string(),
                coordinate => format!("{}.{coordinate}", unknown.thing),
            })
            .collect();
        names.join(", ")
    };
    match Component::parse(&text) {
        Some(Component::Axis(mut name)) => {
            let Some(index) = quantity::axis_index(context.machine, &name.axis) else {
                let (message, help) = quantity::no_axis(context.machine, &name.axis);
                return Err(value.error(format!("effect on \"{text}\": {message}"), Some(help)));
            };
            name.axis.clone_from(&context.machine.axes[index].name);
            Ok(Component::Axis(name))
        }
        Some(Component::Instrument { thing, coordinate }) => {
            let own = context
                .instrument
                .unknowns()
                .iter()
                .any(|unknown| unknown.thing == thing && unknown.coordinate == coordinate);
            if !own {
                let message = format!("effect on \"{text}\", which a {} does not have", context.instrument.word());
                return Err(value.error(message, Some(format!("it has {}", instrument()))));
            }
            Ok(Component::Instrument { thing, coordinate })
        }
        Some(Component::TriggerDelay) => Ok(Component::TriggerDelay),
        Some(Component::Reading(_)) | None => {
            let help = format!(
                "errors of axes according to ISO 230-1, such as EZC or EX0C; parameters of the instrument: {}; or trigger",
                instrument()
            );
            Err(value.error(format!("\"{text}\" is not a component"), Some(help)))
        }
    }
}

/// The driver. By default it is the one that the shape determines, or else the own axis of an error motion.
fn driver(
    context: &Context<'_>,
    table: &mut Table<'_>,
    component: &Component,
    shape: Option<&Entry>,
    columns: &BTreeSet<String>,
) -> Result<Driver, ModelError> {
    let Some(value) = table.take("driver") else {
        return match (shape.and_then(|entry| entry.follows.default_driver()), component) {
            (Some(driver), _) => Ok(driver),
            (None, Component::Axis(name)) if name.kind == ErrorKind::Motion => Ok(Driver::Axis(name.axis.clone())),
            _ => {
                let words: Vec<String> = Driver::words().iter().map(|word| format!("\"{word}\"")).collect();
                let help = format!("add `driver`: an axis, {}", listed(&words, "or"));
                Err(table.error("[[effect]] has no `driver`", Some(help)))
            }
        };
    };
    let text = value.text()?;
    let axis = quantity::axis_index(context.machine, &text);
    // A column may be named without its unit if no other column has its name.
    let of_quantity: Vec<&String> = columns.iter().filter(|name| column::quantity(name) == text).collect();
    let driver = match (Driver::parse(&text), axis, &of_quantity[..]) {
        (Driver::Axis(_) | Driver::Column(_), Some(index), _) => Driver::Axis(context.machine.axes[index].name.clone()),
        (Driver::Axis(_), None, [name]) => Driver::Column((*name).clone()),
        (Driver::Axis(_), None, _) => {
            let (message, help) = quantity::no_axis(context.machine, &text);
            let columns = columns.iter().map(String::as_str);
            let others: Vec<&str> = Driver::words().into_iter().chain(columns).collect();
            let help = format!("{help}; other drivers are {}, and columns as NAME_unit", listed(&others, "and"));
            return Err(value.error(format!("effect driven by \"{text}\": {message}"), Some(help)));
        }
        (other, ..) => other,
    };
    let own = component.axis(context.machine).map(|axis| context.machine.axes[axis].kind);
    let checked = driver.kind().check_component(&component.to_string(), own);
    checked.map_err(|fault| value.error(fault.message, Some(fault.help.into())))?;
    Ok(driver)
}

/// `a, b and c`.
pub(super) fn listed(words: &[impl AsRef<str>], joint: &str) -> String {
    let words: Vec<&str> = words.iter().map(AsRef::as_ref).collect();
    match words.split_last() {
        Some((last, [_, ..])) => format!("{} {joint} {last}", words[..words.len() - 1].join(", ")),
        _ => words.concat(),
    }
}

/// The tests in which an effect acts. A test that its data split by socket stands for all its parts.
fn tests(table: &mut Table<'_>, declared: &[Declared]) -> Result<Vec<String>, ModelError> {
    let Some(value) = table.take("tests") else {
        return Ok(Vec::new());
    };
    let mut tests = Vec::new();
    for item in value.list("a list of test names")? {
        let name = item.text()?;
        match declared.iter().find(|test| test.name == name) {
            Some(test) => tests.extend(test.parts.iter().cloned()),
            None if declared.iter().any(|test| test.parts.contains(&name)) => tests.push(name),
            None => {
                let names: Vec<&str> = declared.iter().map(|test| test.name.as_str()).collect();
                let message = format!("no test has the name \"{name}\"");
                return Err(item.error(message, Some(known_names(&name, &names))));
            }
        }
    }
    Ok(tests)
}
