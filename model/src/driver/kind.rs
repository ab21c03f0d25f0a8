//! What a driver consists of: each file of this folder holds one driver and implements these traits.

use super::quantity::DriverQuantity;
use super::sample::{DriverPart, DriverSample};
use super::unit::DriverUnit;
use super::{Driver, Reference};
use crate::Diagnostic;
use crate::axis::AxisKind;
use crate::chain::{AxisPosition, Machine};
#[cfg(doc)]
use crate::effect::shape::ShapeKind;
use crate::scalar::Nominal;
use crate::sensitivity::TestModel;
use crate::session::readings::Readings;

/// A driver in the registry.
pub struct Entry {
    /// The word in files; `None` for an axis, whose word is its name. Of columns, the word of one that has its own.
    pub word: Option<&'static str>,
    /// The driver of that word.
    pub driver: fn(&str) -> Driver,
    /// The units that its numbers can have.
    pub units: &'static [DriverUnit],
}

/// A test in numbers, with what the values of drivers depend on.
#[derive(Clone, Copy)]
pub struct DriverInput<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The chain and the instrument of the test.
    pub model: &'a TestModel,
    /// The readings of the test.
    pub readings: &'a Readings,
    /// Reference values of the session.
    pub reference: &'a Reference,
    /// The axis of the effect's component, if it has one.
    pub component_axis: Option<usize>,
    /// Time constant of the first-order lag by which the effect follows the driver, s: [`ShapeKind::lag_s`].
    pub lag_s: Option<f64>,
}

/// A reading in symbols.
pub struct SymbolInput<'a, N> {
    /// The machine.
    pub machine: &'a Machine,
    /// Positions of the axes.
    pub state: &'a [AxisPosition<N>],
    /// The axes that the test holds fixed; those have no direction and no rate.
    pub held: &'a [bool],
    /// The axis of the effect's component, if it has one.
    pub component_axis: Option<usize>,
    /// The quantities of the driver that the shape uses. Only those are named.
    pub uses: DriverPart,
    /// Time constant of the first-order lag by which the effect follows the driver, s.
    pub lag_s: Option<f64>,
}

/// What a session records, as far as drivers depend on it.
#[derive(Clone, Copy, Debug)]
pub struct Recorded<'a> {
    /// Whether all readings have a time.
    pub time: bool,
    /// The driver columns that all readings have, `NAME_unit`.
    pub columns: &'a [&'a str],
    /// Whether an axis is swept, so that its speed is known where there is a time.
    pub swept: bool,
}

/// Everything that is particular to one driver, except its symbols: see [`Symbols`].
///
/// `axis` is the kind of the axis that the driver is about: the one that it names, or else that of the effect's
/// component.
pub trait DriverKind {
    /// The unit of its numbers.
    fn unit(&self, axis: Option<AxisKind>) -> DriverUnit;
    /// The values of the driver in a test, row by row; `None` if the data lack what it depends on.
    fn samples(&self, input: &DriverInput<'_>) -> Option<Vec<DriverSample<f64>>>;
    /// The driver as the object of a sentence: `time`, `the temperature`.
    fn phrase(&self) -> String;
    /// Whether a session can have effects of this driver on a component whose axis is of this kind.
    fn is_observable(&self, recorded: &Recorded<'_>, axis: Option<AxisKind>) -> bool;

    /// The divisor of the driver in polynomials and powers if a session states no `scale_…`, in the driver's internal
    /// unit. Coefficients of one name are then comparable between tests of different travel.
    fn default_scale(&self, axis: Option<AxisKind>) -> f64 {
        let _ = axis;
        1.0
    }
    /// A column that it needs besides the axis positions and that some readings may lack.
    fn missing_column(&self, readings: &Readings) -> Option<String> {
        let _ = readings;
        None
    }
    /// The unit of powers of the driver in the units of coefficients, at a scale of 1: `um/K`; `None`: coefficients
    /// have the unit of the component.
    fn per(&self) -> Option<&'static str> {
        None
    }
    /// The words for proportionality to this driver, if it has its own.
    fn proportional(&self) -> Option<String> {
        None
    }
    /// Whether its values differ from component to component, as those of a driver about the component's own axis do.
    fn is_of_component(&self) -> bool {
        false
    }
    /// Whether a second feed separates it from what depends on the position.
    fn changes_with_feed(&self) -> bool {
        false
    }
    /// Checks that a component can follow it; `axis` is the kind of the component's axis, `component` its name.
    ///
    /// # Errors
    /// If it cannot.
    fn check_component(&self, component: &str, axis: Option<AxisKind>) -> Result<(), Diagnostic> {
        let _ = (component, axis);
        Ok(())
    }
}

/// The state of a driver in symbols.
pub trait Symbols {
    /// The state at a reading; `named` gives the symbol of a quantity. `None` if the effect lacks an axis that the
    /// driver needs.
    fn symbols<N: Nominal>(
        &self,
        input: &SymbolInput<'_, N>,
        named: &impl Fn(DriverQuantity) -> N,
    ) -> Option<DriverSample<N>>;
}
