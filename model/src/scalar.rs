//! The open scalar: the kinematic chain is written once, and the numeric type decides what it computes.
//!
//! Over `f64` the chain simulates. Over a symbol it gives the closed form and, recorded and evaluated over columns,
//! every Jacobian. Over dual numbers it gives the reference derivatives for both. Two kinds of quantity occur in a
//! chain. *Nominal* quantities (axis positions, origins, ball positions) are never differentiated; *errors* are. A
//! [`Scalar`] is the type of an error, [`Scalar::Nominal`] that of a nominal quantity, so that a product of two nominal
//! quantities carries no derivatives:
//!
//! | scalar | nominal | result of the chain |
//! |---|---|---|
//! | `f64` | `f64` | readings |
//! | a num-dual number over `f64` | `f64` | readings and derivatives |
//! | a [symbol](crate::expression) | the same symbol | the closed form, and the recording for [`replay`](crate::replay) |

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
    /// The sign: −1, 0 or 1; the direction of travel.
    fn signum(self) -> Self;
    /// The unit step: 0 below zero, 1 at and above zero.
    fn step(self) -> Self;
    /// The greatest integer that is not greater.
    fn floor(self) -> Self;
    /// The nearest integer.
    fn round(self) -> Self;
    /// An integer power, at least 1.
    fn power(self, exponent: i32) -> Self {
        (1..exponent).fold(self, |power, _| power * self)
    }
    /// The lesser of the value and `limit`.
    fn at_most(self, limit: f64) -> Self {
        let beyond = self - Self::constant(limit);
        self - beyond.step() * beyond
    }
    /// The greater of the value and `limit`.
    fn at_least(self, limit: f64) -> Self {
        let missing = Self::constant(limit) - self;
        self + missing.step() * missing
    }
    /// The value of a known constant. It lets exact zeros vanish from printed equations.
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

/// The type of an error, by which Jacobians are taken.
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
    /// The type of nominal quantities.
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
