//! What a shape consists of: each file of this folder holds one shape and implements these traits.

use crate::axis::AxisKind;
use crate::document::Fault;
use crate::driver::{Driver, DriverPart, DriverSample};
use crate::effect::keys::{Key, KeyReader, KeyWriter};
use crate::effect::sampled::Sampled;
use crate::effect::shape::Shape;
use crate::effect::shape::words::EffectWords;
use crate::scalar::Nominal;

/// A shape in the registry: what is known of it without its numbers.
pub struct Entry {
    /// The word in files.
    pub word: &'static str,
    /// Its keys in files.
    pub keys: &'static [Key],
    /// The drivers that it can have.
    pub follows: Follows,
    /// Reads it from its keys.
    pub read: fn(&KeyReader<'_>) -> Result<Shape, Fault>,
    /// Its members in the library of the search for a driver as a session samples it, each with a cost in addition to
    /// that of its family, in natural-logarithm units. A shape without members is one that only users declare.
    pub members: fn(&Sampled) -> Vec<(Shape, f64)>,
}

/// The drivers that a shape can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Follows {
    /// None.
    Nothing,
    /// Any driver.
    Anything,
    /// The position of an axis.
    Axis,
    /// The position of a rotary axis.
    RotaryAxis,
    /// Time.
    Time,
    /// A column of the data.
    Column,
}

impl Follows {
    /// What is wrong with a driver, as advice; `kind` is that of the axis, if the driver is the position of one.
    ///
    /// # Errors
    /// If the shape cannot have the driver.
    pub fn check(self, driver: &Driver, kind: Option<AxisKind>) -> Result<(), &'static str> {
        if (*driver == Driver::None) != (self == Follows::Nothing) {
            return Err("a constant has the driver \"none\" (omit `driver`); every other shape needs a driver");
        }
        match self {
            Follows::RotaryAxis if kind != Some(AxisKind::Rotary) => {
                Err("it needs a rotary axis; for waves over other drivers use \"periodic\" with its period")
            }
            Follows::Axis if kind.is_none() => Err("its driver must be an axis"),
            Follows::Time if *driver != Driver::Time => Err("its driver must be \"time\""),
            Follows::Column if !matches!(driver, Driver::Column(_)) => {
                Err("its driver must be a column of the data, such as \"spindle_temperature_c\"")
            }
            _ => Ok(()),
        }
    }

    /// The driver if a file states none and the shape determines it.
    pub fn default_driver(self) -> Option<Driver> {
        match self {
            Follows::Time => Some(Driver::Time),
            Follows::Nothing => Some(Driver::None),
            Follows::Anything | Follows::Axis | Follows::RotaryAxis | Follows::Column => None,
        }
    }
}

/// The dimension of a coefficient: that of the component over this.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Per {
    /// 1: the coefficient is the value of the component where the basis function is 1.
    One,
    /// The rate of the driver.
    Rate,
    /// An hour.
    Hour,
    /// The driver to this power, in its internal unit.
    Power(usize),
    /// The driver over this scale, alone: over a linear axis a coefficient per length, such as a scale error.
    Slope(f64),
}

/// A shape of the registry.
pub trait Registered {
    /// Its entry in the registry.
    fn entry(&self) -> &'static Entry;
}

/// Everything that is particular to one shape, except its basis functions: see [`Basis`].
pub trait ShapeKind: Registered {
    /// The motion of a component and its dependence on the driver, in words.
    fn describe(&self, words: &EffectWords) -> String;

    /// Writes its numbers to a file.
    fn write(&self, keys: &mut KeyWriter) {
        let _ = keys;
    }
    /// Checks its numbers.
    ///
    /// # Errors
    /// The message names the invalid number and the requirement.
    fn check(&self) -> Result<(), String> {
        Ok(())
    }
    /// The word in results; that of files unless it says otherwise.
    fn word(&self) -> &'static str {
        self.entry().word
    }
    /// A short tag for identifiers: `h2`, `p3`, `backlash`.
    fn tag(&self) -> String {
        self.word().to_string()
    }
    /// The order of a harmonic or the degree of a polynomial; of a precession negative if it turns against the axis.
    fn order(&self) -> Option<f64> {
        None
    }
    /// Number of coefficients.
    fn coefficients(&self) -> usize {
        if self.is_wave() { 2 } else { 1 }
    }
    /// Names of the coefficients in identifiers: `cos`, `sin`, `1`, …; empty for a single coefficient.
    fn coefficient_names(&self) -> Vec<String> {
        match self.coefficients() {
            1 => vec![String::new()],
            _ if self.is_wave() => vec!["cos".into(), "sin".into()],
            several => (1..=several).map(|k| k.to_string()).collect(),
        }
    }
    /// Whether the coefficients are a cosine and a sine, reported as amplitude and phase.
    fn is_wave(&self) -> bool {
        false
    }
    /// For a wave whose direction turns: the sense in which the error at right angles to the component follows it by a
    /// quarter of a cycle, 1 with the axis, −1 against it ([`crate::effect::Effect::parts`]). `None` for a shape of the
    /// component alone.
    fn turns(&self) -> Option<f64> {
        None
    }
    /// Whether its coefficients need a prior, because readings over part of the travel leave them undetermined.
    fn needs_prior(&self) -> bool {
        false
    }
    /// The quantities of the driver that its basis functions use.
    fn uses(&self) -> DriverPart {
        DriverPart::Value
    }
    /// Time constant of the first-order lag by which the effect follows its driver, s; `None` for an effect that follows
    /// it without delay.
    fn lag_s(&self) -> Option<f64> {
        None
    }
    /// The dimension of coefficient `k`.
    fn per(&self, k: usize) -> Per {
        let _ = k;
        Per::One
    }
    /// Whether a table over the position of the axis that it follows can represent it.
    fn fits_position_table(&self) -> bool {
        true
    }
    /// The interval of what it uses of the driver in which it differs from a constant; `None` for everywhere.
    fn varies_within(&self) -> Option<[f64; 2]> {
        None
    }

    /// The shape parameters in results: name and values, in the unit of the driver.
    fn reported(&self) -> Vec<(&'static str, Vec<f64>)> {
        Vec::new()
    }
    /// Number of shape parameters that a search varies, besides the coefficients: a period, a time constant, a width, a
    /// position. The positions of several steps are not counted.
    fn numbers(&self) -> usize {
        self.number_names().len()
    }
    /// Spacing of its members in the library in the first of these numbers, for a travel of this length; 0 if there is
    /// none.
    fn spacing(&self, span: f64) -> f64 {
        let _ = span;
        0.0
    }
    /// The interval in which each of these numbers is tuned, if the members of the library are `spacing` apart.
    fn brackets(&self, spacing: f64) -> Vec<[f64; 2]> {
        let _ = spacing;
        Vec::new()
    }
    /// The names of the numbers that have a bracket, in their order: those of [`ShapeKind::reported`], as one word.
    fn number_names(&self) -> &'static [&'static str] {
        &[]
    }
    /// Sets one of the numbers that have a bracket.
    fn set_number(&mut self, which: usize, value: f64) {
        let _ = (which, value);
    }
    /// The positions of which a search selects some, one coefficient each; empty for other shapes.
    fn positions(&self) -> &[f64] {
        &[]
    }
    /// Sets these positions.
    fn set_positions(&mut self, positions: Vec<f64>) {
        let _ = positions;
    }
    /// The ends of a nonparametric curve; `None` for other shapes.
    fn curve_ends(&self) -> Option<[f64; 2]> {
        None
    }
}

/// The basis functions of a shape over an open scalar: numbers for a fit, symbols for a printed equation. Numbers
/// select one piece of a piecewise function. Symbols cannot, so a symbolic basis function contains every piece times a
/// step of 0 or 1.
pub trait Basis {
    /// Appends the values of the basis functions at one reading to `basis`, in the order of the coefficients.
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>);
}

/// Checks that a number is positive; `what` is its name in the message.
pub(super) fn positive(value: f64, what: &str) -> Result<(), String> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(format!("{what} is {}; it must be a positive number", crate::words::number(value)))
    }
}
