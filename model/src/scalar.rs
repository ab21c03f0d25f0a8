//! The open scalar: the kinematic chain is written once, and what a number *is* decides what the chain yields.
//!
//! With `f64` the chain simulates, with a symbol it yields the closed form and, recorded and replayed over columns, every Jacobian; with dual numbers it
//! yields the derivatives that both are held to.
//! Two kinds of quantity meet in a chain. *Nominal* ones (axis positions, origins, ball positions) are never
//! differentiated; *errors* are. A [`Scalar`] is the type of an error, [`Scalar::Nominal`] that of a nominal quantity,
//! so that a product of two nominal quantities costs no derivative:
//!
//! | scalar | nominal | the chain yields |
//! |---|---|---|
//! | `f64` | `f64` | readings |
//! | a num-dual number over `f64` | `f64` | readings and derivatives |
//! | a [symbol](crate::expression) | the same symbol | the closed form, and what is [replayed](crate::replay) |

use std::ops::{Add, Div, Mul, Neg, Sub};

use num_dual::DualNum;

/// A quantity that is never differentiated: an axis position, an origin, a sine of a commanded angle.
pub trait Nominal:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// The constant `value`.
    fn constant(value: f64) -> Self;
    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
    /// The non-negative square root.
    fn sqrt(self) -> Self;
    /// The exponential function.
    fn exp(self) -> Self;
    /// −1, 0 or 1 by sign; a direction of travel.
    fn signum(self) -> Self;
    /// 0 below zero, 1 at and above it.
    fn step(self) -> Self;
    /// The greatest whole number that is not above it.
    fn floor(self) -> Self;
    /// The nearest whole number.
    fn round(self) -> Self;
    /// A whole power, at least 1.
    fn power(self, exponent: i32) -> Self {
        (1..exponent).fold(self, |power, _| power * self)
    }
    /// The value, or `limit` where it is above that.
    fn at_most(self, limit: f64) -> Self {
        let beyond = self - Self::constant(limit);
        self - beyond.step() * beyond
    }
    /// The value, or `limit` where it is below that.
    fn at_least(self, limit: f64) -> Self {
        let missing = Self::constant(limit) - self;
        self + missing.step() * missing
    }
    /// The value where it is a known constant: what lets an exact zero drop out of a printed equation.
    fn known(self) -> Option<f64>;
}

impl Nominal for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn exp(self) -> Self {
        f64::exp(self)
    }
    fn signum(self) -> Self {
        if self == 0.0 { 0.0 } else { f64::signum(self) }
    }
    fn step(self) -> Self {
        if self >= 0.0 { 1.0 } else { 0.0 }
    }
    fn floor(self) -> Self {
        f64::floor(self)
    }
    fn round(self) -> Self {
        f64::round(self)
    }
    fn power(self, exponent: i32) -> Self {
        self.powi(exponent)
    }
    fn at_most(self, limit: f64) -> Self {
        self.min(limit)
    }
    fn at_least(self, limit: f64) -> Self {
        self.max(limit)
    }
    fn known(self) -> Option<f64> {
        Some(self)
    }
}

/// The type of an error: what a Jacobian is taken with respect to.
pub trait Scalar:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<Self::Nominal, Output = Self>
    + Sub<Self::Nominal, Output = Self>
    + Mul<Self::Nominal, Output = Self>
{
    /// The type of the quantities that are not differentiated.
    type Nominal: Nominal;
    /// A nominal quantity as a scalar whose derivatives are zero.
    fn nominal(value: Self::Nominal) -> Self;
    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
    /// The non-negative square root. Its derivative at zero is not finite.
    fn sqrt(self) -> Self;
    /// The constant `value`.
    fn constant(value: f64) -> Self {
        Self::nominal(Self::Nominal::constant(value))
    }
}

impl<D: DualNum<Primitive = f64> + Copy> Scalar for D {
    type Nominal = f64;
    fn nominal(value: f64) -> Self {
        Self::from(value)
    }
    fn sin_cos(self) -> (Self, Self) {
        DualNum::sin_cos(&self)
    }
    fn sqrt(self) -> Self {
        DualNum::sqrt(&self)
    }
}
