//! An effect: component × driver × shape, the prior of its coefficients, and its aliases.

use std::collections::BTreeSet;

use abbe_model::chain::Machine;
use abbe_model::component::ErrorKind;
use abbe_model::diagnostic::Help;
use abbe_model::document::effect::{self as document, SCALES};
use abbe_model::document::fault::{Fault, Within};
use abbe_model::document::schema;
use abbe_model::document::value::Positive;
use abbe_model::driver::{Driver, column};
use abbe_model::effect::keys::KeyReader;
use abbe_model::effect::shape::{Entry, SHAPES};
use abbe_model::effect::{CoefficientPrior, Component, Effect, EffectPart, Shape};
use abbe_model::instrument::{InstrumentKind, InstrumentParameter};
use abbe_model::session::limits::MIN_UM;
use abbe_model::words::{self, listed, with_article};

use super::Declared;
use crate::axes;
use crate::spelling::known_names;

/// What effects refer to.
pub(super) struct Context<'a> {
    pub machine: &'a Machine,
    /// The instrument of the session.
    pub instrument: InstrumentKind,
    /// The parameters of the instruments of the tests.
    pub of_instruments: &'a [InstrumentParameter],
    pub declared: &'a [Declared],
    /// The driver columns of the data, `NAME_unit`.
    pub columns: BTreeSet<String>,
}

/// The effect with its aliases.
pub(super) fn effect(context: &Context<'_>, document: &document::Effect) -> Result<Effect, Fault> {
    let alias = |alias: &document::Effect| {
        let own = [
            ("alias", !alias.alias.is_empty()),
            ("assumed", alias.assumed.is_some()),
            ("estimate", alias.estimate.is_some()),
        ];
        match own.iter().find(|(_, stated)| *stated) {
            Some((key, _)) => {
                let known = schema::fields::<document::Effect>().into_iter();
                Err(Fault::unknown_key(key, known.filter(|key| own.iter().all(|(own, _)| own != key)).collect()))
            }
            None => one(context, alias),
        }
    };
    let aliases = document.alias.iter().enumerate();
    let aliases = aliases.map(|(item, document)| alias(document).within_item(item));
    let aliases = aliases.collect::<Result<_, _>>().within("alias")?;
    let assumed = document.assumed.unwrap_or_default();
    let effect = one(context, document)?;
    let names = document.estimate.as_deref().unwrap_or_default();
    let mut estimated = estimated(&effect.shape, names).within("estimate")?;
    let numbers = effect.shape.number_names().len();
    let positions_estimated = estimated.pop_if(|which| *which >= numbers).is_some();
    let (positions, most) = (effect.shape.positions().len(), document::MAX_ESTIMATED_POSITIONS);
    if positions_estimated && positions > most {
        let help = "state fewer positions, or remove \"at\": they then stay where they are stated";
        return Err(Fault::of_key(format!("{positions} positions are to be estimated, at most {most} can be"), help))
            .within("estimate");
    }
    Ok(Effect { aliases, assumed, estimated, positions_estimated, ..effect })
}

/// The numbers of a shape that a fit estimates, by index, ascending. Positions come after the numbers.
fn estimated(shape: &Shape, names: &[String]) -> Result<Vec<usize>, Fault> {
    let positions = (!shape.positions().is_empty()).then_some(document::POSITIONS);
    let known: Vec<&str> = shape.number_names().iter().copied().chain(positions).collect();
    let mut estimated = Vec::with_capacity(names.len());
    for (item, name) in names.iter().enumerate() {
        let Some(which) = known.iter().position(|known| known == name) else {
            let message = format!("\"{name}\" is not a number of the shape \"{}\" that can be estimated", shape.word());
            let help: Help = match known.as_slice() {
                [] => "remove `estimate`: all of its coefficients are estimated anyway".into(),
                known => known_names(name, known).into(),
            };
            return Err(Fault::new(message, help).at_item(item));
        };
        if estimated.contains(&which) {
            return Err(Fault::new(format!("\"{name}\" stands twice"), None).at_item(item));
        }
        estimated.push(which);
    }
    estimated.sort_unstable();
    Ok(estimated)
}

/// An effect without its aliases.
fn one(context: &Context<'_>, document: &document::Effect) -> Result<Effect, Fault> {
    let component = component(context, &document.component).within("component")?;
    let word = &document.shape;
    let entry = Shape::entry_of(word);
    let driver = driver(context, document.driver.as_deref(), &component, entry)?;
    let Some(entry) = entry else {
        let words: Vec<&str> = SHAPES.iter().map(|entry| entry.word).collect();
        let message = format!("\"{word}\" is not a shape");
        return Err(Fault::new(message, known_names(word, &words)).at("shape"));
    };
    let own = schema::shape_keys(entry);
    if let Some((unknown, _)) = document.keys.0.iter().find(|(key, _)| !own.contains(key)) {
        let known = schema::fields::<document::Effect>().into_iter().chain(own).collect();
        return Err(Fault::unknown_key(unknown, known));
    }
    let axis = driver.kind_of_axis(context.machine, component.axis(context.machine));
    let kind = driver.kind();
    let keys = KeyReader::new(&document.keys, entry.word, kind.unit(axis), kind.default_scale(axis));
    let shape = (entry.read)(&keys)?;
    drop(kind);
    entry.follows.check(&driver, driver.axis_kind(context.machine)).map_err(|help| {
        let message = format!("the shape \"{}\" cannot have the driver \"{driver}\"", shape.word());
        Fault::new(message, help).at("shape")
    })?;
    if shape.turns().is_some() && !EffectPart::can_turn(context.machine, &component, &driver) {
        let message = format!("the shape \"{}\" for the component \"{component}\" over \"{driver}\"", shape.word());
        let help = "its component is an error motion of a rotary axis at right angles to it, tilt or radial, and its \
                    driver that axis, such as EAC over C";
        return Err(Fault::new(message, help).at("shape"));
    }
    let tests = tests(document.tests.as_deref().unwrap_or_default(), context.declared).within("tests")?;
    let prior = prior(document, &component, &shape, context.of_instruments)?;
    shape.check().map_err(|fault| Fault::new(fault, None).at("shape"))?;
    Ok(Effect { tests, prior, ..Effect::new(component, driver, shape) })
}

fn component(context: &Context<'_>, text: &str) -> Result<Component, Fault> {
    let instrument = || {
        let own = context.of_instruments.iter();
        let names: Vec<String> = own
            .map(|unknown| match unknown.coordinate {
                "" => unknown.thing.to_string(),
                coordinate => format!("{}.{coordinate}", unknown.thing),
            })
            .collect();
        names.join(", ")
    };
    match Component::parse(text) {
        Some(Component::Axis(mut name)) => {
            let index = axes::axis(context.machine, &name.axis)
                .map_err(|(message, help)| Fault::new(format!("effect on \"{text}\": {message}"), help))?;
            name.axis.clone_from(&context.machine.axes[index].name);
            Ok(Component::Axis(name))
        }
        Some(Component::Instrument { thing, coordinate }) => {
            let own =
                context.of_instruments.iter().any(|unknown| unknown.thing == thing && unknown.coordinate == coordinate);
            if !own {
                let message =
                    format!("effect on \"{text}\", which {} does not have", with_article(context.instrument.word()));
                return Err(Fault::new(message, format!("it has {}", instrument())));
            }
            Ok(Component::Instrument { thing, coordinate })
        }
        Some(Component::TriggerDelay) => Ok(Component::TriggerDelay),
        Some(Component::Reading(_)) | None => {
            let help = format!(
                "errors of axes according to ISO 230-1, such as EZC or EX0C; parameters of the instrument: {}; or trigger",
                instrument()
            );
            Err(Fault::new(format!("\"{text}\" is not a component"), help))
        }
    }
}

/// The driver. By default it is the one that the shape determines, or else the own axis of an error motion.
fn driver(
    context: &Context<'_>,
    stated: Option<&str>,
    component: &Component,
    shape: Option<&Entry>,
) -> Result<Driver, Fault> {
    let Some(text) = stated else {
        return match (shape.and_then(|entry| entry.follows.default_driver()), component) {
            (Some(driver), _) => Ok(driver),
            (None, Component::Axis(name)) if name.kind == ErrorKind::Motion => Ok(Driver::Axis(name.axis.clone())),
            _ => {
                let words: Vec<String> = Driver::words().iter().map(|word| format!("\"{word}\"")).collect();
                let help = format!("add `driver`: an axis, {}", listed(&words, "or"));
                Err(Fault::of_table("has no `driver`", help))
            }
        };
    };
    let axis = axes::axis_index(context.machine, text);
    // A column may be named without its unit if no other column has its name.
    let of_quantity: Vec<&String> = context.columns.iter().filter(|name| column::quantity(name) == text).collect();
    let driver = match (Driver::parse(text), axis, &of_quantity[..]) {
        (Driver::Axis(_) | Driver::Column(_), Some(index), _) => Driver::Axis(context.machine.axes[index].name.clone()),
        (Driver::Axis(_), None, [name]) => Driver::Column((*name).clone()),
        (Driver::Axis(_), None, _) => {
            let (message, help) = axes::no_axis(context.machine, text);
            let columns = context.columns.iter().map(String::as_str);
            let others: Vec<&str> = Driver::words().into_iter().chain(columns).collect();
            let help = format!("{help}; other drivers are {}, and columns as NAME_unit", listed(&others, "and"));
            return Err(Fault::new(format!("effect driven by \"{text}\": {message}"), help).at("driver"));
        }
        (Driver::GravityAt(name), ..) => weight_at(context, component, text, &name)?,
        (other, ..) => other,
    };
    let own = component.axis(context.machine).map(|axis| context.machine.axes[axis].kind);
    let checked = driver.kind().check_component(&component.to_string(), own);
    checked.map_err(|fault| Fault::new(fault.message, fault.help).at("driver"))?;
    Ok(driver)
}

/// The driver of a weight at an axis, which the axis of the component has to carry.
fn weight_at(context: &Context<'_>, component: &Component, text: &str, name: &str) -> Result<Driver, Fault> {
    let machine = context.machine;
    let Some(loaded) = axes::axis_index(machine, name) else {
        let (message, help) = axes::no_axis(machine, name);
        return Err(Fault::new(format!("effect driven by \"{text}\": {message}"), help).at("driver"));
    };
    match component.axis(machine) {
        Some(axis) if !machine.carries(axis, loaded) => {
            let (axis, loaded) = (&machine.axes[axis].name, &machine.axes[loaded].name);
            let message = format!("effect driven by \"{text}\": axis {axis} does not carry axis {loaded}");
            Err(Fault::new(message, format!("name an axis that {axis} carries, or \"gravity\"")).at("driver"))
        }
        _ => Ok(Driver::GravityAt(machine.axes[loaded].name.clone())),
    }
}

/// The tests in which an effect acts. A test that its data split by socket stands for all its parts.
fn tests(names: &[String], declared: &[Declared]) -> Result<Vec<String>, Fault> {
    let mut tests = Vec::new();
    for (item, name) in names.iter().enumerate() {
        match declared.iter().find(|test| test.name == *name) {
            Some(test) => tests.extend(test.parts.iter().cloned()),
            None if declared.iter().any(|test| test.parts.contains(name)) => tests.push(name.clone()),
            None => {
                let names: Vec<&str> = declared.iter().map(|test| test.name.as_str()).collect();
                let message = format!("no test has the name \"{name}\"");
                return Err(Fault::new(message, known_names(name, &names)).at_item(item));
            }
        }
    }
    Ok(tests)
}

/// Largest stated scale, µm or arcsec: wider than any error of a machine that a model of small errors describes.
const MAX_SCALE: f64 = 1e6;

/// The prior of the coefficients: `scale_um`, `scale_arcsec`, `family`. Without keys it is that of the shape.
fn prior(
    document: &document::Effect,
    component: &Component,
    shape: &Shape,
    parameters: &[InstrumentParameter],
) -> Result<CoefficientPrior, Fault> {
    let mut prior = CoefficientPrior::default_of(shape);
    let mut stated = false;
    for ((key, unit), scale) in SCALES.into_iter().zip([document.scale_um, document.scale_arcsec]) {
        let Some(Positive(scale)) = scale else { continue };
        if component.unit(parameters) != Some(unit) {
            let other = SCALES.iter().find(|(_, other)| component.unit(parameters) == Some(*other));
            let help = match other {
                Some((other, _)) => format!("use `{other}`"),
                None => "remove it: this component has no unit of length or angle".to_string(),
            };
            let message = format!("`{key}` for the component \"{component}\"");
            return Err(Fault::new(message, help).on_key().at(key));
        }
        if !(MIN_UM..=MAX_SCALE).contains(&scale) {
            return Err(
                Fault::is(format!("{}; it must be between {MIN_UM} and {MAX_SCALE}", words::number(scale))).at(key)
            );
        }
        prior = CoefficientPrior::Scale(unit.displayed().to_internal(scale));
        stated = true;
    }
    if let Some(name) = &document.family {
        if stated {
            let help = "omit `family` to use the stated scale, or omit the scale to estimate it for the family";
            return Err(Fault::new("`family` beside a stated scale", help).at("family"));
        }
        if name.is_empty() {
            let help = "such as \"compliance\"";
            return Err(Fault::new("the name of a family is empty", help).at("family"));
        }
        prior = CoefficientPrior::Family(name.clone());
    }
    Ok(prior)
}
