//! The error type of this crate.

use crate::symbol::Unary;

/// What can keep an equation from being written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CodegenError {
    /// An exponential, a sign, a step or a whole number of an error: it has no derivative that the chain could carry.
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
    /// An error or unknown that was asked for more than once.
    #[error("`{name}` is named twice; name it once")]
    Twice {
        /// The error or unknown.
        name: String,
    },
    /// Derivatives that are not written out for a reader.
    #[error(
        "the derivatives of {what} are written as code only: as rust, c, python or matlab; at the machine without errors they are the coefficients of first order"
    )]
    GradientForReaders {
        /// What they are of.
        what: &'static str,
    },
    /// A curve, which is hundreds of pieces, for a reader.
    #[error(
        "the curve `{effect}` is written as code only: as rust, c, python or matlab; name what to keep with --errors to leave it out"
    )]
    CurveForReaders {
        /// The effect.
        effect: String,
    },
    /// A stated probing direction whose angle with the artefact's axis changes as the axes move.
    #[error(
        "the first order of a distance has no short form where the angle between the stated probing `direction` and the artefact's \
         axis changes as the axes move; `--order exact` and `--order bilinear` have one"
    )]
    ObliqueProbing,
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
    /// An effect that has no closed form.
    #[error(
        "the effect `{effect}` cannot be written: {why}; name the errors to keep with --errors to leave it out"
    )]
    EffectWithoutForm {
        /// The effect.
        effect: String,
        /// What stands in the way.
        why: String,
    },
    /// An effect of more coefficients than an equation can carry.
    #[error(
        "the effect `{effect}` has {coefficients} coefficients, more than the {most} that an equation is written with; \
         give its shape fewer intervals, steps or powers, or name what to keep with --errors to leave it out"
    )]
    EffectTooLong {
        /// The effect.
        effect: String,
        /// How many it has.
        coefficients: usize,
        /// How many are written.
        most: usize,
    },
    /// A program that the chain with dual numbers does not confirm; it is not written.
    #[error(
        "the equation is not written: over {points} points it differs from the chain with dual numbers by {value:.1e} (value) \
         and {gradient:.1e} (derivatives), relative, where 1e-12 is allowed"
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
