//! Sentences about an equation that every printer needs.

use abbe_model::frames::Rotation;

use crate::equation::{Equation, Form, Kind, Order};
use crate::first::Column;
use crate::variable::Variable;

/// What it is: two lines.
pub(crate) fn title(equation: &Equation) -> Vec<String> {
    let what = match equation.kind {
        Kind::Length => "Length read by a ball bar",
        Kind::Coordinates => "Coordinates read by the instrument",
        Kind::Volumetric => "Error vector of the tool in the table frame",
    };
    let order = match equation.options.order {
        Order::Exact => "exact in the errors",
        Order::Bilinear => "up to products of two errors",
        Order::First => "first order in the errors",
    };
    let order = match &equation.form {
        Form::Groups { complete: true, .. } => "up to products of two errors, which is all there is",
        _ => order,
    };
    let rotation = match (equation.options.order, equation.machine.rotation) {
        (Order::First, _) => "",
        (_, Rotation::Exact) => ", exact rotations Rx·Ry·Rz",
        (_, Rotation::SmallAngle) => ", small-angle rotations I + [θ]×",
    };
    let code = equation.machine.code();
    let name = match &equation.machine.name {
        name if *name == code || name.is_empty() => String::new(),
        name => format!("{name}, "),
    };
    vec![
        format!("{what}: {name}{code}; {order}{rotation}."),
        format!("Written by Abbe {}.", env!("CARGO_PKG_VERSION")),
    ]
}

/// What it was checked against, what it leaves out, what it does not contain, in plain text.
pub(crate) fn notes(equation: &Equation) -> Vec<String> {
    let symbols = equation.options.symbols;
    notes_spelt(equation, &str::to_string, &|variable| variable.text(symbols))
}

/// The same, `escape` spelling the words and `name` the names.
pub(crate) fn notes_spelt(
    equation: &Equation,
    escape: &dyn Fn(&str) -> String,
    name: &dyn Fn(&Variable) -> String,
) -> Vec<String> {
    let check = &equation.check;
    let of = match equation.options.order {
        Order::Exact => "the chain",
        Order::Bilinear => "the second-order series of the chain",
        Order::First => "the first-order series of the chain",
    };
    let mut notes = vec![escape(&format!(
        "Checked against {of} with dual numbers at {} points, errors to ±10 mm and ±0.1 rad: largest relative difference {:.0e} (value), {:.0e} (gradient).",
        check.points, check.value, check.gradient
    ))];
    for deviation in &equation.deviations {
        notes.push(escape(&format!(
            "Errors of {} µm and {}°, all signs: at most {} µm from the exact chain.",
            deviation.shift_um,
            deviation.tilt_deg,
            two_digits(deviation.largest_um)
        )));
    }
    if !equation.absent.is_empty() {
        let names: Vec<String> = equation.absent.iter().map(name).collect();
        notes.push(format!("Not contained: {}.", names.join(", ")));
    }
    if let Form::First(first, _) = &equation.form {
        for sensitivity in &first.sensitivities {
            if let Column::Multiple { of, .. } = &sensitivity.column {
                notes.push(format!(
                    "{} {} {}{}",
                    name(&sensitivity.parameter),
                    escape("cannot be told from"),
                    name(of),
                    escape(": a fixed multiple wherever the axes stand.")
                ));
            }
        }
    }
    notes
}

/// A positive number with two digits that count, without an exponent where it is of ordinary size.
fn two_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".to_string();
    }
    let exponent = value.abs().log10().floor();
    if exponent < -6.0 {
        return format!("{value:.1e}");
    }
    let decimals = (1.0 - exponent).max(0.0) as usize;
    format!("{value:.decimals$}")
}
