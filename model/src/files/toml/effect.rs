//! Reader of `[[effect]]`: component × driver × shape.

use super::shape::{self, DriverUnit};
use super::{Context, Declared, quantity};
use crate::axis::AxisKind;
use crate::component::ErrorKind;
use crate::effect::{Component, Driver, Effect, Shape};
use crate::error::ModelError;
use crate::files::spelling::known_names;
use crate::files::toml::document::{Table, Value};

/// Reads one `[[effect]]`.
pub(super) fn effect(
    context: &Context<'_>,
    declared: &[Declared],
    item: Value<'_>,
) -> Result<Effect, ModelError> {
    let mut table = item.table("[[effect]]".into())?;
    let component = component(context, &mut table)?;
    let word_value = table.require(
        "shape",
        "the dependence of the component on the driver, such as \"harmonic\"",
    )?;
    let word = word_value.text()?;
    let driver = driver(context, &mut table, &component, &word)?;
    let unit = DriverUnit::of(context, &driver);
    let shape = shape::shape(
        &mut table,
        &word_value,
        &word,
        unit,
        driver.default_scale(context.machine),
    )?;
    check_compatible(context, &word_value, &shape, &driver)?;
    let tests = tests(&mut table, declared)?;
    shape
        .check()
        .map_err(|fault| word_value.error(fault.to_string(), None))?;
    table.finish()?;
    Ok(Effect {
        component,
        driver,
        shape,
        tests,
    })
}

fn component(context: &Context<'_>, table: &mut Table<'_>) -> Result<Component, ModelError> {
    let value = table.require(
        "component",
        "the component, such as \"EZC\" or \"workpiece_ball.x\"",
    )?;
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
                let message = format!(
                    "effect on \"{text}\", which a {} does not have",
                    context.instrument.word()
                );
                return Err(value.error(message, Some(format!("it has {}", instrument()))));
            }
            Ok(Component::Instrument { thing, coordinate })
        }
        Some(Component::TriggerDelay) => Ok(Component::TriggerDelay),
        None => {
            let help = format!(
                "errors of axes according to ISO 230-1, such as EZC or EX0C; parameters of the instrument: {}; or trigger",
                instrument()
            );
            Err(value.error(format!("\"{text}\" is not a component"), Some(help)))
        }
    }
}

/// The driver. The default is the own axis for an error motion, and time for a drift or warm-up.
fn driver(
    context: &Context<'_>,
    table: &mut Table<'_>,
    component: &Component,
    shape: &str,
) -> Result<Driver, ModelError> {
    let Some(value) = table.take("driver") else {
        return match component {
            _ if matches!(shape, "drift" | "warmup") => Ok(Driver::Time),
            _ if shape == "constant" => Ok(Driver::None),
            Component::Axis(name) if name.kind == ErrorKind::Motion => Ok(Driver::Axis(name.axis.clone())),
            _ => {
                let help = "add `driver`: an axis, \"time\", \"temperature\" or \"gravity\"";
                Err(table.error("[[effect]] has no `driver`", Some(help.into())))
            }
        };
    };
    let text = value.text()?;
    match Driver::parse(&text) {
        Driver::Axis(name) => match quantity::axis_index(context.machine, &name) {
            Some(index) => Ok(Driver::Axis(context.machine.axes[index].name.clone())),
            None => {
                let (message, help) = quantity::no_axis(context.machine, &name);
                let help = format!("{help}; other drivers are time, temperature and gravity");
                Err(value.error(format!("effect driven by \"{text}\": {message}"), Some(help)))
            }
        },
        Driver::Gravity => {
            let rotary = match component {
                Component::Axis(name) => context
                    .machine
                    .axis_index(&name.axis)
                    .is_some_and(|index| context.machine.axes[index].kind == AxisKind::Rotary),
                _ => false,
            };
            if !rotary {
                let help = "gravity acts on the errors of rotary axes, by a moment about the axis";
                return Err(value.error(
                    format!("gravity exerts no moment about \"{component}\""),
                    Some(help.into()),
                ));
            }
            Ok(Driver::Gravity)
        }
        other => Ok(other),
    }
}

/// Checks that a shape and a driver are compatible.
fn check_compatible(
    context: &Context<'_>,
    word: &Value<'_>,
    shape: &Shape,
    driver: &Driver,
) -> Result<(), ModelError> {
    if (*driver == Driver::None) != (*shape == Shape::Constant) {
        let message = format!(
            "the shape \"{}\" cannot have the driver \"{driver}\"",
            shape.word()
        );
        let help = "a constant has the driver \"none\" (omit `driver`); every other shape needs a driver";
        return Err(word.error(message, Some(help.to_string())));
    }
    let axis = match driver {
        Driver::Axis(name) => context
            .machine
            .axis_index(name)
            .map(|i| context.machine.axes[i].kind),
        _ => None,
    };
    let fault = |help: &str| {
        let message = format!(
            "the shape \"{}\" cannot have the driver \"{driver}\"",
            shape.word()
        );
        Err(word.error(message, Some(help.to_string())))
    };
    match shape {
        Shape::Harmonic { .. } if axis != Some(AxisKind::Rotary) => {
            fault("a harmonic needs a rotary axis; for other drivers use \"periodic\" with its period")
        }
        Shape::Backlash | Shape::Lag | Shape::ReversalSpike { .. } if axis.is_none() => {
            fault("its driver must be an axis")
        }
        Shape::Drift | Shape::Warmup { .. } if *driver != Driver::Time => {
            fault("its driver must be \"time\"")
        }
        _ => Ok(()),
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
