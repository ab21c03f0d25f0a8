//! The error type of this crate.

use crate::symbol::Unary;

/// What can keep an equation from being written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CodegenError {
    /// An exponential or a sign of an error: it has no derivative that the chain could carry.
    #[error("{function:?} is taken of an error; only nominal quantities may go through it")]
    FunctionOfError {
        /// The function.
        function: Unary,
    },
    /// An error of an axis that the machine lacks.
    #[error("`{error}` is an error of axis `{axis}`, which `{machine}` does not have")]
    NoSuchAxis {
        /// The error.
        error: String,
        /// Its axis.
        axis: String,
        /// The structural code.
        machine: String,
    },
    /// An unknown that the instrument lacks.
    #[error("the instrument has no unknown {unknown}")]
    NoSuchUnknown {
        /// The unknown.
        unknown: String,
    },
    /// An instrument whose readings have no printed form.
    #[error(
        "the readings of a {instrument} have no printed form; those of a ball bar, a tracker and a socket have"
    )]
    NoForm {
        /// The instrument.
        instrument: &'static str,
    },
    /// An expression that has no normal form.
    #[error("{what} has no place in the polynomial normal form")]
    NoPolynomial {
        /// What stands in the way.
        what: String,
    },
    /// A truncation that no printed form has.
    #[error("order {order} in the errors is not offered; the orders are first, bilinear and exact")]
    OrderTooHigh {
        /// What was asked for.
        order: u32,
    },
    /// A program that the chain with dual numbers does not confirm; it is not written.
    #[error(
        "the equation is not written: over {points} points it differs from the chain with dual numbers by {value:.1e} (value) and {gradient:.1e} (derivatives), relative, where 1e-12 is allowed"
    )]
    Unconfirmed {
        /// Points compared.
        points: usize,
        /// Largest relative difference of a value.
        value: f64,
        /// Largest relative difference of a derivative.
        gradient: f64,
    },
}
