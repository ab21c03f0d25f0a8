//! The limits of a session.

use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::document::fault::{Fault, Within};
use abbe_model::document::from_node;
use abbe_model::document::node::{Node, Value};
use abbe_model::document::tolerance as document;
use abbe_model::document::value::Positive;
use abbe_model::parameter_id::ParameterId;
use abbe_model::session::limits;
use abbe_model::session::tolerance::{Limit, TestFigure, Tolerance, Toleranced};

use crate::axes;
use crate::spelling::known_names;

/// The suffixes of limits of parameters, with their units. A slope of 1 µm/m is an angle of 1 µrad.
const UNITS: [(&str, &str); 6] =
    [("_um_m", "urad"), ("_um", "um"), ("_mm", "mm"), ("_arcsec", "arcsec"), ("_deg", "deg"), ("_mrad", "mrad")];

/// The limits. `unknowns` are the errors that the session estimates, `tests` the names of its tests.
pub(super) fn tolerance(
    machine: &Machine,
    unknowns: &[ErrorName],
    tests: &[&str],
    document: &document::Tolerance,
) -> Result<Tolerance, Fault> {
    let probability = document.probability.unwrap_or(Tolerance::PROBABILITY);
    if !(probability > 0.5 && probability < 1.0) {
        let help = "the probability with which a pass or a fail is true: above 0.5 and below 1, usually 0.95";
        return Err(Fault::of_key(format!("is {probability}"), help).at("probability"));
    }
    let mut limits: Vec<Limit> = Vec::new();
    for (key, node) in &document.errors.0 {
        let limit = of_parameter(machine, unknowns, key, node).within("errors")?;
        if limits.iter().any(|other| other.of == limit.of) {
            let message = format!("{} has two limits; each quantity has one", limit.of);
            return Err(Fault::new(message, None).on_key().at(key).at("errors"));
        }
        limits.push(limit);
    }
    for (test, figures) in &document.tests.0 {
        if !tests.contains(&test.as_str()) {
            let message = format!("[tolerance.tests] names the test `{test}`, which the session does not have");
            return Err(Fault::new(message, known_names(test, tests)).on_key().at(test).at("tests"));
        }
        limits.extend(of_test(test, figures).within(test).within("tests")?);
    }
    if limits.is_empty() {
        let help = "add a limit, such as `EC0Y_um_m = 20` to [tolerance.errors] or `circular_deviation_um = 10` to the \
                    table of a test in [tolerance.tests], or remove [tolerance]";
        return Err(Fault::new("[tolerance] states no limit", help).on_key());
    }
    Ok(Tolerance { probability, limits })
}

fn of_parameter(machine: &Machine, unknowns: &[ErrorName], key: &str, node: &Node) -> Result<Limit, Fault> {
    let fault = |message: String, help: &str| Fault::new(message, help).on_key().at(key);
    let split = |(suffix, unit): &(&str, &'static str)| Some((key.strip_suffix(suffix)?, *unit));
    let Some((id, unit)) = UNITS.iter().find_map(split) else {
        return Err(fault(
            format!("`{key}` of [tolerance.errors] has no unit"),
            "add the unit to the name: EX0C_um, EB0A_arcsec, EC0Y_um_m; the units are um, mm, arcsec, deg, mrad, um_m",
        ));
    };
    // Errors of effects are named as in results; whether they exist is known after the fit.
    let id = if let Ok(id @ ParameterId::Effect(..)) = id.parse::<ParameterId>() {
        id.to_string()
    } else {
        let mut name = ErrorName::parse(id).ok_or_else(|| {
            let help = "an error such as EX0C or EZC, or a parameter of an effect such as \"EZC~C:h2.amplitude_um\"";
            fault(format!("`{id}` of [tolerance.errors] is not the name of an error"), help)
        })?;
        if let Some(index) = axes::axis_index(machine, &name.axis) {
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
            return Err(fault(format!("`{key}`: `{name}` is {is}"), &format!("give its limit in {of}")));
        }
        name.to_string()
    };
    let [lower, upper] = interval(node).within(key)?;
    Ok(Limit { of: Toleranced::Parameter(id), lower: Some(lower), upper, unit })
}

fn of_test(test: &str, document: &document::TestLimits) -> Result<Vec<Limit>, Fault> {
    let instrument_u_um = document.instrument_u_um.unwrap_or_default().0;
    let number = |number: Option<Positive>| number.map(|number| Node::from(number.0));
    let mut limits = Vec::new();
    for (figure, node) in [
        (TestFigure::CircularDeviation, number(document.circular_deviation_um)),
        (TestFigure::BidirectionalCircularDeviation, number(document.bidirectional_circular_deviation_um)),
        (TestFigure::RadialDeviation, document.radial_deviation_um.clone()),
        (TestFigure::MeanBidirectionalRadialDeviation, document.mean_bidirectional_radial_deviation_um.clone()),
        (TestFigure::Hysteresis, number(document.hysteresis_um)),
        (TestFigure::SynchronousErrorMotion, number(document.synchronous_error_motion_um)),
        (TestFigure::AsynchronousErrorMotion, number(document.asynchronous_error_motion_um)),
    ] {
        let Some(node) = node else { continue };
        let [lower, upper] = interval(&node).within(&format!("{}_um", figure.word()))?;
        let of = Toleranced::Figure { test: test.to_string(), figure, instrument_u_um };
        limits.push(Limit { of, lower: figure.is_signed().then_some(lower), upper, unit: "um" });
    }
    Ok(limits)
}

/// A number above 0 for both sides of zero, or a list of the least and the largest permitted value.
fn interval(node: &Node) -> Result<[f64; 2], Fault> {
    if !matches!(node.value, Value::List(_)) {
        let limit = limits::positive(from_node(node)?).map_err(Fault::is)?;
        return Ok([-limit, limit]);
    }
    match from_node::<Vec<f64>>(node)?[..] {
        [lower, upper] if lower < upper => Ok([lower, upper]),
        _ => Err(Fault::of_key(
            "is not a number above 0 or a list of the least and the largest permitted value",
            "write 20 for -20 to 20, or [-5, 20]",
        )),
    }
}
