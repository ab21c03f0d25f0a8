//! The error type of this crate.

use abbe_model::chain::Machine;
use abbe_model::expression::Unary;

/// Reasons why an equation cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CodegenError {
    /// The states of a test cannot be made.
    #[error(transparent)]
    Model(#[from] abbe_model::ModelError),
    /// An exponential, a sign, a step or a rounding of an error; the chain cannot differentiate it.
    #[error("the function {function:?} is applied to an error; only nominal quantities are allowed")]
    FunctionOfError {
        /// The function.
        function: Unary,
    },
    /// An error of an axis that the machine does not have.
    #[error("`{error}` is an error of axis `{axis}`, which `{machine}` does not have")]
    NoSuchAxis {
        /// The error.
        error: String,
        /// Its axis.
        axis: String,
        /// The structural code.
        machine: String,
    },
    /// An axis to keep as a symbol that the machine does not have.
    #[error("`{machine}` has no axis `{axis}` that could stay a symbol; its axes are {axes}")]
    NoAxisToKeep {
        /// The axis.
        axis: String,
        /// The structural code.
        machine: String,
        /// The axes of the machine.
        axes: String,
    },
    /// A parameter that the instrument does not have.
    #[error("the instrument has no parameter {parameter}")]
    NoSuchParameter {
        /// The parameter.
        parameter: String,
    },
    /// An error or parameter that is requested more than once.
    #[error("`{name}` is named twice; name it once")]
    Twice {
        /// The error or parameter.
        name: String,
    },
    /// Derivatives that are not printed in mathematical notation.
    #[error(
        "the derivatives of {what} are written as code only: as {languages}; at zero errors they equal the \
         first-order coefficients"
    )]
    GradientForReaders {
        /// The quantity that is differentiated.
        what: &'static str,
        /// The languages that carry them.
        languages: String,
    },
    /// A form that an equation does not have, or that is too long for a reader.
    #[error("the form `{form}` {why}")]
    NoSuchForm {
        /// The form.
        form: &'static str,
        /// The obstacle, and what to request instead.
        why: String,
    },
    /// A curve, which has hundreds of terms, in mathematical notation.
    #[error("the curve `{effect}` is written as code only: as {languages}; to omit it, name the errors to keep")]
    CurveForReaders {
        /// The effect.
        effect: String,
        /// The languages that carry it.
        languages: String,
    },
    /// A test that cannot be an NC program as asked for.
    #[error("{message}; {help}")]
    Nc {
        /// What was found.
        message: String,
        /// What to do.
        help: String,
    },
    /// A word that names no language.
    #[error("no output language is called `{word}`; the languages are {known}")]
    NoSuchLanguage {
        /// The word.
        word: String,
        /// The known words.
        known: String,
    },
    /// A stated probing direction whose angle with the artefact's axis changes as the axes move.
    #[error(
        "the first order of a distance has no short form where the angle between the stated probing `direction` \
         and the artefact's axis changes as the axes move; use the exact or the bilinear order"
    )]
    ObliqueProbing,
    /// An expression that has no normal form.
    #[error("{what} cannot be represented in the polynomial normal form")]
    NoPolynomial {
        /// The obstacle.
        what: String,
    },
    /// A truncation order that no printed form has.
    #[error("order {order} in the errors is not available; the orders are first, bilinear and exact")]
    OrderTooHigh {
        /// The requested order.
        order: u32,
    },
    /// An effect that has no closed form.
    #[error("the effect `{effect}` cannot be written: {why}; to omit it, name the errors to keep")]
    EffectWithoutForm {
        /// The effect.
        effect: String,
        /// The obstacle.
        why: String,
    },
    /// An effect with more coefficients than an equation can contain.
    #[error(
        "the effect `{effect}` has {coefficients} coefficients, more than the limit of {most}; \
         give its shape fewer intervals, steps or powers, or omit it by naming the errors to keep"
    )]
    EffectTooLong {
        /// The effect.
        effect: String,
        /// Its number of coefficients.
        coefficients: usize,
        /// Largest number of coefficients.
        most: usize,
    },
    /// A program that the check against the chain over dual numbers does not confirm; it is not written.
    #[error(
        "the equation is not written: over {points} points it differs from the chain with dual numbers by \
         {value:.1e} (value) and {gradient:.1e} (derivatives), relative; the limit is 1e-12"
    )]
    Unconfirmed {
        /// Number of points compared.
        points: usize,
        /// Largest relative difference of a value.
        value: f64,
        /// Largest relative difference of a derivative.
        gradient: f64,
    },
}

impl CodegenError {
    /// The error named `error` belongs to an axis that the machine does not have.
    pub(crate) fn no_axis(machine: &Machine, error: String, axis: &str) -> Self {
        CodegenError::NoSuchAxis { error, axis: axis.to_string(), machine: machine.code() }
    }
}
