//! Sentences about an equation, common to all printers.

use abbe_model::driver::DriverPart;
use abbe_model::frames::Rotation;
use abbe_model::words::with_exponent;

use crate::check::Checked;
use crate::equation::Equation;
use crate::first_order::Column;
use crate::form::{Form, Kind, Order};
use crate::variable::Variable;

/// The title: two lines.
pub(crate) fn title(equation: &Equation) -> Vec<String> {
    let what = match equation.kind {
        Kind::Length => "Length read by a ball bar",
        Kind::Distance => "Distance from a probe to the surface of its artefact",
        Kind::Coordinates => "Coordinates read by the instrument",
        Kind::Volumetric => "Error vector of the tool in the table frame",
    };
    let order = match equation.options.order {
        Order::Exact => "exact in the errors",
        Order::Bilinear => "up to products of two errors",
        Order::First => "first order in the errors",
    };
    let order = match &equation.form {
        Form::Groups { complete: true, .. } => "up to products of two errors, which is complete",
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
        name => format!("{}, ", in_comment(name)),
    };
    vec![format!("{what}: {name}{code}; {order}{rotation}."), format!("Written by Abbe {}.", env!("CARGO_PKG_VERSION"))]
}

/// A text of the session in a comment or a string of documentation, without what ends one in a language (`*/`, `\"\"\"`),
/// joins it with the next line (`\`) or turns the direction of writing.
fn in_comment(text: &str) -> String {
    let is_harmless = |c: char| match c {
        '*' | '"' | '\\' | '`' => false,
        c if c.is_ascii() => !c.is_ascii_control(),
        c => c.is_alphanumeric() || "°·−×±–²³″′".contains(c),
    };
    text.chars().map(|c| if is_harmless(c) { c } else { '_' }).collect()
}

/// The label of the reading: `eq:ldbb-C150`.
pub(crate) fn label(equation: &Equation) -> String {
    let quantity = match equation.kind {
        Kind::Length => "ldbb",
        Kind::Distance => "distance",
        Kind::Coordinates => "coordinates",
        Kind::Volumetric => "volumetric",
    };
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
    let test = equation.name.iter().map(|name| format!("-{}", name.chars().map(plain).collect::<String>()));
    format!("eq:{quantity}{}", test.collect::<String>())
}

/// The notes: the check, the truncation error, and the parameters that the equation does not contain.
pub(crate) fn notes(checked: &Checked<'_>) -> Vec<String> {
    let symbols = checked.equation.options.symbols;
    let name = |variable: &Variable| variable.text(symbols);
    let (equation, check) = (checked.equation, &checked.agreement);
    let of = match equation.options.order {
        Order::Exact => "the chain",
        Order::Bilinear => "the second-order series of the chain",
        Order::First => "the first-order series of the chain",
    };
    let mut notes = vec![format!(
        "Checked against {of} with dual numbers at {} points, errors to ±10 mm and ±0.1 rad: \
         largest relative difference {} (value), {} (gradient).",
        check.points,
        with_exponent(check.value, 0),
        with_exponent(check.gradient, 0)
    )];
    if !checked.deviations.is_empty() {
        let found = checked.deviations.iter().map(|deviation| {
            format!(
                "{} µm at errors of ±{} µm and ±{}°",
                two_digits(deviation.largest_um),
                deviation.shift_um,
                deviation.tilt_deg,
            )
        });
        let found = found.collect::<Vec<_>>().join(", ");
        let over = range(checked);
        notes.push(format!("Largest deviation from the exact chain{over}: {found}."));
    }
    if !checked.absent.is_empty() {
        let names: Vec<String> = checked.absent.iter().map(name).collect();
        notes.push(format!("Not contained: {}.", names.join(", ")));
    }
    if let Form::First(first, _) = &equation.form {
        for sensitivity in &first.sensitivities {
            if let Column::Multiple { of, .. } = &sensitivity.column {
                notes.push(format!(
                    "{} is confounded with {}: a constant multiple at all positions of the axes.",
                    name(&sensitivity.parameter),
                    name(of)
                ));
            }
        }
    }
    notes
}

/// The range over which the truncation error was evaluated: moving axes, and lengths that the session does not state.
fn range(checked: &Checked<'_>) -> String {
    let degrees = |angle: f64| two_places(angle.to_degrees());
    let axes = checked.range.iter().filter_map(|(variable, [low, high])| match variable {
        Variable::Position { axis, .. } if low == high && variable.is_angle() => {
            Some(format!("{axis} {}°", degrees(*low)))
        }
        Variable::Position { axis, .. } if low == high => Some(format!("{axis} {} mm", two_places(*low))),
        Variable::Position { axis, .. } if variable.is_angle() => {
            Some(format!("{axis} {}° to {}°", degrees(*low), degrees(*high)))
        }
        Variable::Position { axis, .. } => Some(format!("{axis} {} mm to {} mm", two_places(*low), two_places(*high))),
        Variable::Driver(quantity) if quantity.part == DriverPart::Direction => None,
        Variable::Driver(followed) => Some(format!(
            "{} {low} {unit} to {high} {unit}",
            followed.text,
            low = two_places(*low),
            high = two_places(*high),
            unit = followed.unit
        )),
        Variable::Length(name) if checked.equation.kind == Kind::Volumetric => {
            Some(format!("{name} {} mm", two_places(*low)))
        }
        _ => None,
    });
    let axes: Vec<String> = axes.collect();
    if axes.is_empty() { String::new() } else { format!(" over {}", axes.join(", ")) }
}

/// A number rounded to two decimals, without trailing zeros.
fn two_places(value: f64) -> String {
    let rounded = (value * 100.0).round() / 100.0;
    format!("{}", rounded + 0.0).replace('-', "−")
}

/// A positive number with two significant digits; a value below 1e-6 is rounding.
fn two_digits(value: f64) -> String {
    if value < 1e-6 {
        return "less than 0.000001".to_string();
    }
    let exponent = value.abs().log10().floor();
    let decimals = (1.0 - exponent).max(0.0) as usize;
    format!("{value:.decimals$}")
}

/// The meaning of a variable; in the error vector of the tool, lengths are the coordinates of a point.
pub(crate) fn meaning(equation: &Equation, variable: &Variable) -> String {
    match variable {
        Variable::Length(name) if equation.kind == Kind::Volumetric => {
            let coordinate = name.split('_').next().unwrap_or_default();
            format!("{coordinate} of the tool point in the tool frame")
        }
        Variable::Length(name) => {
            let stated = equation.meanings.iter().find(|(known, _)| known == name);
            stated.map_or_else(|| variable.meaning(), |(_, meaning)| in_comment(meaning))
        }
        other => match equation.held.iter().find(|(held, _)| held == other) {
            Some((_, at)) if other.is_angle() => {
                format!("{}, held at {}°", other.meaning(), two_places(at.to_degrees()))
            }
            Some((_, at)) => format!("{}, held at {} mm", other.meaning(), two_places(*at)),
            None => other.meaning(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::in_comment;

    #[test]
    fn a_name_does_not_end_its_comment() {
        assert_eq!(in_comment("x */ int evil(); /*"), "x _/ int evil(); /_");
        assert_eq!(in_comment("\"\"\"\nimport os\\"), "____import os_");
        assert_eq!(in_comment("R\u{202e}fliame"), "R_fliame");
        assert_eq!(in_comment("Länge in µm, 90° (A/B)"), "Länge in µm, 90° (A/B)");
    }
}
