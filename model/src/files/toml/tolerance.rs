//! Reader of `[tolerance]`: the limits of a session.

use super::quantity;
use crate::chain::Machine;
use crate::component::ErrorName;
use crate::error::ModelError;
use crate::files::spelling::known_names;
use crate::files::toml::document::{Table, Value};
use crate::session::tolerance::{Limit, TestFigure, Tolerance, Toleranced};
use crate::words;

/// The suffixes of limits of parameters, with their units. A slope of 1 µm/m is an angle of 1 µrad.
const UNITS: [(&str, &str); 6] =
    [("_um_m", "urad"), ("_um", "um"), ("_mm", "mm"), ("_arcsec", "arcsec"), ("_deg", "deg"), ("_mrad", "mrad")];

/// Reads `[tolerance]`. `unknowns` are the errors that the session estimates, `tests` the names of its tests.
pub(super) fn tolerance(
    machine: &Machine,
    unknowns: &[ErrorName],
    tests: &[&str],
    root: &mut Table<'_>,
) -> Result<Option<Tolerance>, ModelError> {
    let Some(value) = root.take("tolerance") else {
        return Ok(None);
    };
    let (source, span) = (value.source, value.key_span.clone());
    let mut table = value.table("[tolerance]".into())?;
    let probability = match table.take("probability") {
        None => Tolerance::PROBABILITY,
        Some(value) => {
            let probability = value.number()?;
            if !(probability > 0.5 && probability < 1.0) {
                let help = "the probability with which a pass or a fail is true: above 0.5 and below 1, usually 0.95";
                return Err(value.error(format!("`probability` is {probability}"), Some(help.into())));
            }
            probability
        }
    };
    let mut limits = Vec::new();
    if let Some(errors) = table.take("errors") {
        for entry in errors.table("[tolerance.errors]".into())?.remaining_values()? {
            let (source, span) = (entry.source, entry.key_span.clone());
            let limit = of_parameter(machine, unknowns, entry)?;
            if limits.iter().any(|other: &Limit| other.of == limit.of) {
                let message = format!("{} has two limits; each quantity has one", limit.of);
                return Err(source.error(span, message, None));
            }
            limits.push(limit);
        }
    }
    if let Some(value) = table.take("tests") {
        for entry in value.table("[tolerance.tests]".into())?.remaining_values()? {
            limits.extend(of_test(tests, entry)?);
        }
    }
    table.finish()?;
    if limits.is_empty() {
        let help = "add a limit, such as `EC0Y_um_m = 20` to [tolerance.errors] or `circular_deviation_um = 10` to the \
                    table of a test in [tolerance.tests], or remove [tolerance]";
        return Err(source.error(span, "[tolerance] states no limit".to_string(), Some(help.into())));
    }
    Ok(Some(Tolerance { probability, limits }))
}

fn of_parameter(machine: &Machine, unknowns: &[ErrorName], entry: Value<'_>) -> Result<Limit, ModelError> {
    let fault =
        |message: String, help: &str| entry.source.error(entry.key_span.clone(), message, Some(help.to_string()));
    let split = |(suffix, unit): &(&str, &'static str)| Some((entry.key.strip_suffix(suffix)?, *unit));
    let Some((id, unit)) = UNITS.iter().find_map(split) else {
        return Err(fault(
            format!("`{}` of [tolerance.errors] has no unit", entry.key),
            "add the unit to the name: EX0C_um, EB0A_arcsec, EC0Y_um_m; the units are um, mm, arcsec, deg, mrad, um_m",
        ));
    };
    // Errors of effects are named as in results; whether they exist is known after the fit.
    let id = if id.contains('~') {
        id.to_string()
    } else {
        let mut name = ErrorName::parse(id).ok_or_else(|| {
            let help = "an error such as EX0C or EZC, or a parameter of an effect such as \"EZC~C:h2.amplitude_um\"";
            fault(format!("`{id}` of [tolerance.errors] is not the name of an error"), help)
        })?;
        if let Some(index) = quantity::axis_index(machine, &name.axis) {
            name.axis.clone_from(&machine.axes[index].name);
        }
        if !unknowns.contains(&name) {
            let estimated: Vec<String> = unknowns.iter().map(ToString::to_string).collect();
            let estimated: Vec<&str> = estimated.iter().map(String::as_str).collect();
            return Err(fault(
                format!("`{name}` has a limit, but the session does not estimate it"),
                &format!("add it to `errors` of [unknowns], or remove its limit; {}", known_names(id, &estimated)),
            ));
        }
        let angle_unit = matches!(unit, "arcsec" | "deg" | "mrad" | "urad");
        if name.freedom.is_angle() != angle_unit {
            let (is, of) =
                if angle_unit { ("a length", "um or mm") } else { ("an angle", "arcsec, deg, mrad or um_m") };
            return Err(fault(format!("`{}`: `{name}` is {is}", entry.key), &format!("give its limit in {of}")));
        }
        name.to_string()
    };
    let of = Toleranced::Parameter(id);
    let [lower, upper] = interval(entry)?;
    Ok(Limit { of, lower: Some(lower), upper, unit })
}

fn of_test(tests: &[&str], entry: Value<'_>) -> Result<Vec<Limit>, ModelError> {
    let test = entry.key.clone();
    if !tests.contains(&test.as_str()) {
        let message = format!("[tolerance.tests] names the test `{test}`, which the session does not have");
        return Err(entry.source.error(entry.key_span.clone(), message, Some(known_names(&test, tests))));
    }
    let mut table = entry.table(format!("[tolerance.tests] \"{test}\""))?;
    let instrument_u_um = match table.take("instrument_u_um") {
        None => 0.0,
        Some(value) => {
            let u = value.number()?;
            if u < 0.0 {
                return Err(
                    value.error(format!("`instrument_u_um` is {}; it cannot be negative", words::number(u)), None)
                );
            }
            u
        }
    };
    let mut limits = Vec::new();
    for figure in TestFigure::ALL {
        let Some(value) = table.take(format!("{}_um", figure.word())) else { continue };
        let (lower, upper) = if figure.is_signed() {
            let [lower, upper] = interval(value)?;
            (Some(lower), upper)
        } else {
            (None, value.positive()?)
        };
        let of = Toleranced::Figure { test: test.clone(), figure, instrument_u_um };
        limits.push(Limit { of, lower, upper, unit: "um" });
    }
    table.finish()?;
    Ok(limits)
}

/// A number above 0 for both sides of zero, or a list of the least and the largest permitted value.
fn interval(value: Value<'_>) -> Result<[f64; 2], ModelError> {
    if !value.is_list() {
        let limit = value.positive()?;
        return Ok([-limit, limit]);
    }
    let (source, span, key) = (value.source, value.span.clone(), value.key.clone());
    let ends = value.list("a list of the least and the largest permitted value")?;
    match ends.iter().map(Value::number).collect::<Result<Vec<_>, _>>()?[..] {
        [lower, upper] if lower < upper => Ok([lower, upper]),
        _ => Err(source.error(
            span,
            format!("`{key}` is not a number above 0 or a list of the least and the largest permitted value"),
            Some("write 20 for -20 to 20, or [-5, 20]".into()),
        )),
    }
}
