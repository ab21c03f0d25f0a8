//! Effects: `component × driver × shape`.
//!
//! A *component* is the error or set-up quantity that changes (an error of an axis, a ball, the bar). A *driver* is the independent
//! variable (an axis position, its direction, time, temperature, the gravity moment). A *shape* is the functional form. The chain depends
//! on components only, so the Jacobian column of an effect is the sensitivity to its component times the shape's basis function: `∂L/∂k =
//! (∂L/∂component) · b_k(driver)`. A PIGE is `component × constant`.

mod basis;
mod shape;

pub use shape::{Shape, ShapeFault};

use std::fmt;

use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::component::ErrorName;

/// The quantity that an effect changes.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Component {
    /// An error of an axis.
    Axis(ErrorName),
    /// One of the instrument's parameters: `workpiece_ball.x`, `bar`.
    Instrument {
        /// The object, as in [`crate::instrument::InstrumentParameter::thing`].
        thing: String,
        /// Its coordinate, or empty.
        coordinate: String,
    },
    /// A delay between the axis positions and the reading, in seconds: every moving axis has an error of its speed times the delay.
    TriggerDelay,
}

impl Component {
    /// Parses `EZC`, `e_x0c`, `workpiece_ball.x`, `bar`, `trigger`.
    pub fn parse(text: &str) -> Option<Component> {
        if text == "trigger" {
            return Some(Component::TriggerDelay);
        }
        let (thing, coordinate) = text.split_once('.').unwrap_or((text, ""));
        let known = crate::instrument::InstrumentKind::ALL
            .iter()
            .flat_map(|kind| kind.unknowns())
            .any(|unknown| unknown.thing == thing && unknown.coordinate == coordinate);
        if known {
            return Some(Component::Instrument {
                thing: thing.to_string(),
                coordinate: coordinate.to_string(),
            });
        }
        ErrorName::parse(text).map(Component::Axis)
    }
}

impl fmt::Display for Component {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Component::Axis(name) => name.fmt(formatter),
            Component::Instrument { thing, coordinate } if coordinate.is_empty() => {
                formatter.write_str(thing)
            }
            Component::Instrument { thing, coordinate } => write!(formatter, "{thing}.{coordinate}"),
            Component::TriggerDelay => formatter.write_str("trigger"),
        }
    }
}

/// The independent variable of an effect.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Driver {
    /// No driver, for a constant.
    None,
    /// The position of an axis, with its direction and speed.
    Axis(String),
    /// Time since the session's first reading, s.
    Time,
    /// A temperature column, °C above the session's mean.
    Temperature,
    /// The moment of a unit weight about the component's own axis, in m. For an axis on the tool side the weight acts at the instrument's
    /// point in the tool frame (spindle ball, stylus, target). For an axis on the workpiece side it acts at the instrument's point in the
    /// table frame (workpiece ball, point of the artefact), not at the centre of mass of table and workpiece.
    Gravity,
}

impl Driver {
    /// Parses `none`, `time`, `temperature`, `gravity`; any other text is the name of an axis.
    pub fn parse(text: &str) -> Driver {
        match text {
            "none" => Driver::None,
            "time" => Driver::Time,
            "temperature" => Driver::Temperature,
            "gravity" => Driver::Gravity,
            axis => Driver::Axis(axis.to_string()),
        }
    }

    /// The divisor of the driver in polynomials and powers if a session states no `scale_…`, in the driver's internal unit: 100 mm for a
    /// linear axis, half a revolution for a rotary one, an hour, 1 °C, 1 m. Coefficients of one name are then comparable between tests of
    /// different travel.
    pub fn default_scale(&self, machine: &Machine) -> f64 {
        match self {
            Driver::Axis(name) => match machine.axis_index(name).map(|index| machine.axes[index].kind) {
                Some(AxisKind::Rotary) => std::f64::consts::PI,
                _ => 100.0,
            },
            Driver::Time => 3600.0,
            Driver::Temperature | Driver::Gravity | Driver::None => 1.0,
        }
    }
}

impl fmt::Display for Driver {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Driver::None => "none",
            Driver::Axis(axis) => axis,
            Driver::Time => "time",
            Driver::Temperature => "temperature",
            Driver::Gravity => "gravity",
        })
    }
}

/// State of a driver at one reading, in the units of [`Driver`]: mm or rad for an axis.
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

/// An effect: component × driver × shape.
///
/// ```
/// use abbe_model::effect::{Component, Driver, DriverSample, Effect, Shape};
///
/// let effect = Effect {
///     component: Component::parse("EZC").unwrap(),
///     driver: Driver::parse("C"),
///     shape: Shape::Harmonic { order: 2.0 },
///     tests: Vec::new(),
/// };
/// assert_eq!(effect.id(), "EZC~C:h2");
/// // Cosine and sine of 2 C, at C = 30°.
/// let at = DriverSample { value: 30_f64.to_radians(), ..DriverSample::default() };
/// let mut basis = Vec::new();
/// effect.shape.basis(&at, &mut basis);
/// assert!((basis[0] - 0.5).abs() < 1e-15 && (basis[1] - 0.75_f64.sqrt()).abs() < 1e-15);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// The component.
    pub component: Component,
    /// The driver.
    pub driver: Driver,
    /// The shape.
    pub shape: Shape,
    /// The tests in which the effect acts; empty for all.
    pub tests: Vec<String>,
}

impl Effect {
    /// Whether the effect acts in a test of this name.
    pub fn acts_in(&self, test: &str) -> bool {
        self.tests.is_empty() || self.tests.iter().any(|name| name == test)
    }

    /// The identifier used in results: `EZC~C:h2` (component, driver, shape).
    pub fn id(&self) -> String {
        let tests = if self.tests.is_empty() {
            String::new()
        } else {
            format!("[{}]", self.tests.join("+"))
        };
        format!("{}~{}:{}{tests}", self.component, self.driver, self.shape.tag())
    }
}
