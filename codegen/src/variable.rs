//! Variables of expressions: their meaning, unit and names.

use abbe_model::axis::AxisKind;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::driver::DriverQuantity;
use abbe_model::instrument::InstrumentParameter;
use abbe_model::unit::InternalUnit;

use crate::coefficient::Coefficient;

/// A variable of an expression.
#[derive(Clone, Debug, PartialEq)]
pub enum Variable {
    /// A named length of the session, mm: `R`, `Z_CA`.
    Length(String),
    /// The position of an axis, mm or rad.
    Position {
        /// The axis.
        axis: String,
        /// Linear or rotary.
        kind: AxisKind,
    },
    /// An error of the machine, mm or rad.
    Error(ErrorName),
    /// A parameter of the instrument, mm, rad or a ratio.
    Instrument(InstrumentParameter),
    /// The driver of an effect, if it is not the position of an axis.
    Driver(DriverQuantity),
    /// A coefficient of an effect.
    Coefficient(Coefficient),
}

/// Naming convention of the errors in print.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Symbols {
    /// The short names of the literature: `e_y0a`, `θ_z0c`.
    #[default]
    Literature,
    /// The names of ISO 230-1: `EY0A`, `EC0C`.
    Iso,
}

impl Variable {
    /// Whether it is small, so that expressions are truncated in it: an error, a parameter of the instrument, a
    /// coefficient of an effect.
    pub fn is_small(&self) -> bool {
        matches!(self, Variable::Error(_) | Variable::Instrument(_) | Variable::Coefficient(_))
    }

    /// Whether it varies from reading to reading.
    pub fn moves(&self) -> bool {
        matches!(self, Variable::Position { .. } | Variable::Driver(_))
    }

    /// Whether it is an angle; for a coefficient, whether its component is one.
    pub fn is_angle(&self) -> bool {
        match self {
            Variable::Length(_) | Variable::Driver(_) => false,
            Variable::Coefficient(coefficient) => coefficient.component == Some(InternalUnit::Radian),
            Variable::Position { kind, .. } => *kind == AxisKind::Rotary,
            Variable::Error(name) => name.freedom.is_angle(),
            Variable::Instrument(unknown) => unknown.unit == InternalUnit::Radian,
        }
    }

    /// The unit of its values.
    pub fn unit(&self) -> &'static str {
        match self {
            Variable::Instrument(unknown) if unknown.unit == InternalUnit::Ratio => "1",
            Variable::Driver(followed) => followed.unit,
            Variable::Coefficient(coefficient) => coefficient.unit(),
            _ if self.is_angle() => "rad",
            _ => "mm",
        }
    }

    /// The meaning in words.
    pub fn meaning(&self) -> String {
        match self {
            Variable::Length(_) => "length of the set-up".to_string(),
            Variable::Position { axis, kind } => match kind {
                AxisKind::Linear => format!("position of axis {axis}"),
                AxisKind::Rotary => format!("angle of axis {axis}"),
            },
            Variable::Error(name) => {
                let coordinate = ["X", "Y", "Z"][name.freedom.index() % 3];
                let what = match (name.kind, name.freedom.is_angle()) {
                    (ErrorKind::Location, false) => format!("location of {} in {coordinate}", name.axis),
                    (ErrorKind::Location, true) => format!("orientation of {} about {coordinate}", name.axis),
                    (ErrorKind::Motion, false) => format!("error motion of {} in {coordinate}", name.axis),
                    (ErrorKind::Motion, true) => format!("error motion of {} about {coordinate}", name.axis),
                };
                format!("{what} ({name})")
            }
            Variable::Instrument(unknown) => {
                let thing = unknown.thing.replace('_', " ");
                match unknown.coordinate {
                    "" => format!("error of the {thing}"),
                    coordinate => format!("error of the {thing} in {coordinate}"),
                }
            }
            Variable::Driver(followed) => followed.meaning.clone(),
            Variable::Coefficient(coefficient) => coefficient.meaning(),
        }
    }

    /// The name in requests: `EY0A`, `workpiece_ball.x`, `bar`.
    pub fn name(&self) -> String {
        match self {
            Variable::Length(name) => name.clone(),
            Variable::Position { axis, .. } => axis.clone(),
            Variable::Error(name) => name.to_string(),
            Variable::Instrument(unknown) => unknown.id("").to_string(),
            Variable::Driver(followed) => followed.meaning.clone(),
            Variable::Coefficient(coefficient) => coefficient.id(),
        }
    }

    /// The symbol in plain text: `R`, `θ_a`, `e_y0a`.
    pub fn text(&self, symbols: Symbols) -> String {
        match self {
            Variable::Length(name) => name.clone(),
            Variable::Position { axis, kind } => match kind {
                AxisKind::Linear => axis.to_lowercase(),
                AxisKind::Rotary => format!("θ_{}", axis.to_lowercase()),
            },
            Variable::Error(name) => match symbols {
                Symbols::Literature => name.literature(),
                Symbols::Iso => name.to_string(),
            },
            Variable::Instrument(unknown) => match unknown.coordinate {
                "" => format!("δ_{}", unknown.thing),
                coordinate => format!("δ_{}_{coordinate}", unknown.thing),
            },
            Variable::Driver(followed) => followed.text.clone(),
            Variable::Coefficient(coefficient) => format!("k_{}", coefficient.number),
        }
    }

    /// Letter and subscript for typeset output: `("e", "y0a")`, `("θ", "a")`, `("R", "")`.
    pub fn letter_and_subscript(&self, symbols: Symbols) -> (String, String) {
        let split = |text: String| match text.split_once('_') {
            Some((letter, subscript)) => (letter.to_string(), subscript.replace('_', " ")),
            None => (text, String::new()),
        };
        match self {
            Variable::Error(name) if symbols == Symbols::Iso => ("E".to_string(), name.to_string()[1..].to_string()),
            _ => split(self.text(symbols)),
        }
    }

    /// The name in code: ASCII, lower case.
    pub fn identifier(&self, symbols: Symbols) -> String {
        let text = match self {
            Variable::Position { axis, kind } => match kind {
                AxisKind::Linear => format!("pos_{}", axis.to_lowercase()),
                AxisKind::Rotary => format!("angle_{}", axis.to_lowercase()),
            },
            Variable::Instrument(_) => self.text(symbols).replace('δ', "delta"),
            Variable::Driver(followed) => followed.identifier.clone(),
            _ => self.text(symbols).replace('θ', "theta"),
        };
        identifier(&text)
    }
}

/// `text` in lower case, with every character except ASCII letters, digits and underscores replaced.
pub fn identifier(text: &str) -> String {
    let mut clean: String =
        text.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' }).collect();
    if !clean.starts_with(|c: char| c.is_ascii_alphabetic()) {
        clean.insert(0, 'v');
    }
    clean
}
