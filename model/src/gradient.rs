//! A dual number with a dense gradient of fixed length, the scalar of Jacobians.
//!
//! `a + Σ aᵢ εᵢ`, `εᵢ εⱼ = 0`. Every operation is a loop of fixed length over plain arrays, which the compiler vectorises without link-time
//! optimisation; num-dual's `DualSVec64` is the same number, and the tests hold the two together.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::Scalar;

/// A value and its derivatives by `N` components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradient<const N: usize> {
    /// The value.
    pub value: f64,
    /// The derivatives.
    pub by: [f64; N],
}

impl<const N: usize> Gradient<N> {
    /// A value that no component moves.
    pub fn constant(value: f64) -> Self {
        Gradient { value, by: [0.0; N] }
    }

    /// A component: derivative 1 by itself.
    pub fn seed(value: f64, place: usize) -> Self {
        let mut seeded = Self::constant(value);
        seeded.by[place] = 1.0;
        seeded
    }

    #[inline(always)]
    fn chain(self, value: f64, slope: f64) -> Self {
        Gradient {
            value,
            by: std::array::from_fn(|i| slope * self.by[i]),
        }
    }
}

impl<const N: usize> Add for Gradient<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Gradient {
            value: self.value + other.value,
            by: std::array::from_fn(|i| self.by[i] + other.by[i]),
        }
    }
}

impl<const N: usize> Sub for Gradient<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Gradient {
            value: self.value - other.value,
            by: std::array::from_fn(|i| self.by[i] - other.by[i]),
        }
    }
}

#[allow(clippy::suspicious_arithmetic_impl)] // the rule of derivatives
impl<const N: usize> Mul for Gradient<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let by = std::array::from_fn(|i| self.value * other.by[i] + other.value * self.by[i]);
        Gradient {
            value: self.value * other.value,
            by,
        }
    }
}

#[allow(clippy::suspicious_arithmetic_impl)] // the rule of derivatives
impl<const N: usize> Div for Gradient<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let by = std::array::from_fn(|i| (self.by[i] - value * other.by[i]) / other.value);
        Gradient { value, by }
    }
}

impl<const N: usize> Neg for Gradient<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Gradient {
            value: -self.value,
            by: self.by.map(|d| -d),
        }
    }
}

impl<const N: usize> Add<f64> for Gradient<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: f64) -> Self {
        Gradient {
            value: self.value + other,
            by: self.by,
        }
    }
}

impl<const N: usize> Sub<f64> for Gradient<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        Gradient {
            value: self.value - other,
            by: self.by,
        }
    }
}

impl<const N: usize> Mul<f64> for Gradient<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        self.chain(self.value * other, other)
    }
}

impl<const N: usize> Scalar for Gradient<N> {
    type Nominal = f64;
    #[inline(always)]
    fn nominal(value: f64) -> Self {
        Gradient::constant(value)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root)
    }
}
