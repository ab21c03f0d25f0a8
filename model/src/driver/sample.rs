//! The state of a driver at one reading, over an open scalar.

use crate::scalar::Nominal;

/// State of a driver at one reading, in the units of [`super::Driver`]: mm or rad for an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriverSample<N> {
    /// The value of the driver.
    pub value: N,
    /// Direction of its last movement: −1, 0 or 1.
    pub direction: N,
    /// Its rate per second.
    pub rate: N,
    /// Distance travelled since the last reversal, in the driver's unit; 0 at the reversal, never negative.
    pub since_reversal: N,
    /// Seconds since the last reversal.
    pub since_reversal_s: N,
}

impl<N: Nominal> DriverSample<N> {
    /// A driver that has a value and a rate but no direction of travel.
    pub fn plain(value: N, rate: N) -> Self {
        let zero = N::constant(0.0);
        DriverSample { value, rate, direction: N::constant(1.0), since_reversal: zero, since_reversal_s: zero }
    }
}

/// A part of a driver's state: what the basis functions of a shape use, or what a variable of an equation stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriverPart {
    /// Its value.
    Value,
    /// Its direction of travel.
    Direction,
    /// Its rate.
    Rate,
    /// The distance since the last reversal, with the direction of travel.
    SinceReversal,
}
