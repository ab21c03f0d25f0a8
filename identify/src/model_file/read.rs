//! A model from its JSON text, with the checks that a file of a user needs.

use std::path::Path;

use abbe_files::Source;
use abbe_files::read::{effect_of_document, machine_of_document};
use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::diagnostic::Location;
use abbe_model::document::fault::{Fault, Within};
use abbe_model::document::value::Long;
use abbe_model::driver::Driver;
use abbe_model::effect::Effect;
use abbe_model::instrument::kinds;
use abbe_model::session::parameters_of;
use faer::Mat;
use serde_json::Value;

use super::document::{Document, Role, SCHEMA, SCHEMA_VERSION};
use super::write::{CHECKSUM, checksum};
use super::{IdentifiedModel, ModelParameter};
use crate::numerics::symmetric::Symmetric;

/// Least eigenvalue of a covariance over its largest, in scaled parameters, below 0 by rounding.
const ROUNDING_OF_COVARIANCE: f64 = 1e-9;

/// What to do about a file that is no model.
const ANOTHER: &str = "name a file in which a fit was saved as a model";
/// What to do about a model that cannot be used.
const SAVE_AGAIN: &str = "save the model again";

/// Reads a model file.
///
/// # Errors
/// If the file cannot be read, is no model, is of a newer version, or was changed by hand: the file, the line, the key,
/// what was found and what to do.
pub fn read(path: &Path) -> Result<IdentifiedModel, Diagnostic> {
    of_source(&abbe_files::text(path, "the model file")?)
}

/// Whether a text is meant as a saved model rather than a session. A model is JSON; no session begins with a brace.
pub fn is_model(text: &str) -> bool {
    text.trim_start().starts_with('{')
}

/// As [`read`], from a file that has been read.
///
/// # Errors
/// As [`read`].
pub fn of_source(source: &Source) -> Result<IdentifiedModel, Diagnostic> {
    let whole: Value = serde_json::from_str(&source.text).map_err(|cause| not_json(source, &cause))?;
    let parsed = source.json()?;
    let here = |fault: Fault| helped(parsed.error_of(fault));
    header(&whole).map_err(here)?;
    let document: Document = parsed.document().map_err(helped)?;
    if document.sha256 != checksum(&whole) {
        let what = format!(
            "is \"{}\", but the checksum of the other keys is another: the file was changed after it was saved",
            document.sha256
        );
        return Err(here(Fault::of_key(what, None).at(CHECKSUM)));
    }
    model(document).map_err(here)
}

/// The error with what to do, which is the same about every value that a program wrote.
fn helped(mut error: Diagnostic) -> Diagnostic {
    if error.place.is_some() {
        error.help.get_or_insert_with(|| SAVE_AGAIN.to_string());
    }
    error
}

fn not_json(source: &Source, cause: &serde_json::Error) -> Diagnostic {
    let is_toml = ["[[test]]", "[machine]", "[axis."].iter().any(|header| source.text.contains(header));
    let (location, message) = if is_toml {
        (Location::file(&source.file), "this is a session or machine file, not a model".to_string())
    } else {
        (Location::line(&source.file, cause.line()), format!("not valid JSON: {cause}"))
    };
    Diagnostic::input(location, message, ANOTHER)
}

/// Checks that it is a model of a version that can be read.
fn header(whole: &Value) -> Result<(), Fault> {
    match whole.get("schema").and_then(Value::as_str) {
        Some(SCHEMA) => {}
        Some(other) => {
            return Err(Fault::of_key(format!("is \"{other}\"; \"{SCHEMA}\" is expected"), ANOTHER).at("schema"));
        }
        None if whole.get("command").is_some() => {
            return Err(Fault::new("this is the result of a command, not a model", ANOTHER));
        }
        None => return Err(Fault::new(format!("the file has no `schema`; \"{SCHEMA}\" is expected"), ANOTHER)),
    }
    match whole.get("schema_version").and_then(Value::as_u64) {
        Some(version) if version == u64::from(SCHEMA_VERSION) => Ok(()),
        Some(version) if version > u64::from(SCHEMA_VERSION) => {
            let what = format!(
                "is {version}; this program reads versions up to {SCHEMA_VERSION}: a newer program saved the model"
            );
            let help = "use a newer version of Abbe, or save the model again with this one";
            Err(Fault::of_key(what, help).at("schema_version"))
        }
        _ => {
            let what = format!("is missing or not a version; {SCHEMA_VERSION} is expected");
            Err(Fault::of_key(what, SAVE_AGAIN).at("schema_version"))
        }
    }
}

/// Checks what a file states, and brings machine, effects and covariance into the form in which they are used.
fn model(mut document: Document) -> Result<IdentifiedModel, Fault> {
    let machine = machine_of_document(&document.machine).within("machine")?;
    let mut tests: Vec<String> = document.effects.iter().flat_map(|of| of.tests.iter().flatten().cloned()).collect();
    tests.sort_unstable();
    tests.dedup();
    let effects = document.effects.iter().enumerate();
    let effects =
        effects.map(|(k, effect)| effect_of_document(effect, &machine, &parameters_of(kinds()), &tests).within_item(k));
    let effects = effects.collect::<Result<Vec<_>, _>>().within("effects")?;
    parameters(&document.parameters, &effects, &machine).within("parameters")?;
    let covariance = covariance(&document.covariance.0, &document.parameters).within("covariance")?;
    let count = document.parameters.len();
    if let Some((k, row)) = document.null_directions.iter().enumerate().find(|(_, row)| row.len() != count) {
        let what = format!("has {} numbers; one for each of the {count} parameters is expected", row.len());
        return Err(Fault::of_key(what, None).at_item(k).at("null_directions"));
    }
    for (k, id) in document.locations.iter().map(|location| &location.id).enumerate() {
        if ErrorName::parse(id).is_none_or(|name| machine.error_slot(&name).is_none()) {
            let what = format!("is \"{id}\", an error that the machine does not have");
            return Err(Fault::of_key(what, None).at("id").at_item(k).at("locations"));
        }
    }
    let inflation = document.noise.inflation;
    if inflation < 1.0 {
        return Err(Fault::is(format!("{inflation}; at least 1 is expected")).at("inflation").at("noise"));
    }
    document.parameters.iter_mut().for_each(|parameter| parameter.identifiable &= !parameter.held);
    for range in &mut document.ranges {
        range.driver = Driver::parse_on(&machine, &range.driver.to_string());
    }
    Ok(document.over(machine, effects, covariance))
}

fn parameters(entries: &[ModelParameter], effects: &[Effect], machine: &Machine) -> Result<(), Fault> {
    for (j, entry) in entries.iter().enumerate() {
        parameter(&entries[..j], entry, effects, machine).within_item(j)?;
    }
    for (k, effect) in effects.iter().enumerate() {
        let own = |own: &&ModelParameter| own.effect == Some(k) && own.id.is_coefficient();
        let (needed, found) = (effect.shape.coefficients(), entries.iter().filter(own).count());
        if found != needed {
            let what = format!("have {found} coefficients of `effects[{k}]`, whose shape has {needed}");
            return Err(Fault::of_key(what, None));
        }
        let numbers = entries.iter().filter(|own| own.effect == Some(k) && own.id.is_number());
        if !numbers.filter_map(|number| number.index).eq(effect.estimated.iter().copied()) {
            return Err(Fault::of_key(format!("do not have the numbers that `effects[{k}]` estimates"), None));
        }
    }
    Ok(())
}

/// Checks a parameter after the `others`.
fn parameter(
    others: &[ModelParameter],
    entry: &ModelParameter,
    effects: &[Effect],
    machine: &Machine,
) -> Result<(), Fault> {
    let fault = |what: &str| Err(Fault::of_key(format!("({}): {what}", entry.id), None));
    if others.iter().any(|other| other.id == entry.id) {
        return fault("another parameter has the same name");
    }
    let same = |other: &&ModelParameter| {
        entry.effect.is_some() && (other.role, other.effect, other.index) == (entry.role, entry.effect, entry.index)
    };
    if let Some(other) = others.iter().find(same) {
        return fault(&format!("it is the coefficient of an effect that {} is too", other.id));
    }
    if entry.role == Role::Location && entry.id.error().and_then(|name| machine.error_slot(name)).is_none() {
        return fault("the machine has no such error");
    }
    let effect = entry.effect.and_then(|effect| effects.get(effect));
    let is_known = match (entry.role, effect, entry.index) {
        (Role::Coefficient, Some(effect), Some(place)) => place < effect.shape.coefficients(),
        (Role::Number, Some(effect), Some(place)) => effect.estimated.contains(&place),
        (Role::Location | Role::SetUp, ..) => (entry.effect, entry.index) == (None, None),
        _ => false,
    };
    if !is_known || entry.role != Role::of(&entry.id) {
        return fault(
            "`role` is \"location\", \"set-up\", \"coefficient\" or \"number\", the last two with an index of `effects`",
        );
    }
    Ok(())
}

/// The covariance, which must be positive semidefinite.
fn covariance(rows: &[Long<Vec<f64>>], parameters: &[ModelParameter]) -> Result<Mat<f64>, Fault> {
    let count = parameters.len();
    if rows.len() != count || rows.iter().enumerate().any(|(i, Long(row))| row.len() != i + 1) {
        return Err(Fault::is(format!("no lower triangle of {count} rows, one for each parameter")));
    }
    let entry = |i: usize, j: usize| rows[i.max(j)].0[i.min(j)];
    // In units of the uncertainties the matrix has ones on its diagonal.
    let deviation: Vec<f64> = (0..count).map(|j| entry(j, j).max(0.0).sqrt()).collect();
    let scaled = Mat::from_fn(count, count, |i, j| match deviation[i] * deviation[j] {
        0.0 => entry(i, j) / (parameters[i].size * parameters[j].size),
        product => entry(i, j) / product,
    });
    let not_definite = |what: String| Fault::is(format!("not positive semidefinite: {what}"));
    if let Some(j) = (0..count).find(|j| entry(*j, *j) < 0.0) {
        return Err(not_definite(format!("the variance of {} is negative", parameters[j].id)).at_item(j).at_item(j));
    }
    let Symmetric { values, .. } =
        Symmetric::of(scaled.as_ref()).map_err(|_| not_definite("it has entries that are not finite".to_string()))?;
    let largest = values.last().copied().unwrap_or(0.0).max(1.0);
    if let Some(least) = values.first().filter(|least| **least < -ROUNDING_OF_COVARIANCE * largest) {
        return Err(not_definite(format!("its correlation matrix has the eigenvalue {least:.2e}")));
    }
    Ok(Mat::from_fn(count, count, entry))
}
