//! Reasons why an equation cannot be written.

use std::fmt::Display;

use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use abbe_model::diagnostic::{Area, Code};

/// An expression has no normal form.
pub const NO_POLYNOMIAL: Code = Code { area: Area::Equation, word: "no-polynomial" };

/// [`NO_POLYNOMIAL`] with the obstacle.
pub(crate) fn no_polynomial(what: &str) -> Diagnostic {
    Diagnostic::coded(NO_POLYNOMIAL, format!("{what} cannot be represented in the polynomial normal form"))
}

/// An error is of an axis that the machine does not have.
pub(crate) fn no_axis(machine: &Machine, error: impl Display, axis: &str) -> Diagnostic {
    let machine = machine.code();
    Diagnostic::equation(format!("`{error}` is an error of axis `{axis}`, which `{machine}` does not have"))
}

/// A parameter that the instrument does not have.
pub(crate) fn no_parameter(parameter: impl Display) -> Diagnostic {
    Diagnostic::equation(format!("the instrument has no parameter {parameter}"))
}

/// An error or parameter that is requested more than once.
pub(crate) fn twice(name: impl Display) -> Diagnostic {
    Diagnostic::equation(format!("`{name}` is named twice; name it once"))
}

/// A form that an equation does not have, or that is too long for a reader; what to request instead.
pub(crate) fn no_form(form: &str, why: impl Display) -> Diagnostic {
    Diagnostic::equation(format!("the form `{form}` {why}"))
}

/// An effect that has no closed form.
pub(crate) fn effect_without_form(effect: impl Display, why: impl Display) -> Diagnostic {
    Diagnostic::equation(format!("the effect `{effect}` cannot be written: {why}; to omit it, name the errors to keep"))
}

/// A test that cannot be an NC program as asked for, and what to do.
pub(crate) fn nc(message: impl Display, help: impl Display) -> Diagnostic {
    Diagnostic::equation(format!("{message}; {help}"))
}
