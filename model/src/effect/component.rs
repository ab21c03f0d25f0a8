//! Components: the error or set-up quantity that an effect changes.

use std::fmt;

use crate::chain::Machine;
use crate::component::ErrorName;
use crate::instrument::{InstrumentParameter, composed, kinds};
use crate::session::readings::Readings;
use crate::unit::InternalUnit;

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
    /// A delay between the axis positions and the reading, in seconds: every moving axis has an error of its speed
    /// times the delay.
    TriggerDelay,
    /// An additive term of the readings of the test of this name, without a cause in the machine. Searches use it to
    /// compare effects with what the readings show. No file declares it, and no parameter of a fit is one.
    Reading(String),
}

impl Component {
    /// Parses `EZC`, `e_x0c`, `workpiece_ball.x`, `bar`, `trigger`.
    pub fn parse(text: &str) -> Option<Component> {
        if text == "trigger" {
            return Some(Component::TriggerDelay);
        }
        let (thing, coordinate) = text.split_once('.').unwrap_or((text, ""));
        let known = kinds()
            .iter()
            .flat_map(|kind| kind.unknowns())
            .any(|unknown| unknown.thing == thing && unknown.coordinate == coordinate);
        if known || composed::is_parameter(thing, coordinate) {
            return Some(Component::Instrument { thing: thing.to_string(), coordinate: coordinate.to_string() });
        }
        ErrorName::parse(text).map(Component::Axis)
    }

    /// The axis of an error; `None` for other components.
    pub fn axis(&self, machine: &Machine) -> Option<usize> {
        match self {
            Component::Axis(name) => machine.axis_index(&name.axis),
            _ => None,
        }
    }

    /// Its place among the parameters of an instrument.
    pub fn place(&self, parameters: &[InstrumentParameter]) -> Option<usize> {
        let Component::Instrument { thing, coordinate } = self else {
            return None;
        };
        let own = |parameter: &InstrumentParameter| parameter.thing == thing && parameter.coordinate == coordinate;
        parameters.iter().position(own)
    }

    /// The internal unit; `None` for a delay, for a term of the readings, and for a parameter that the instrument does
    /// not have.
    pub fn unit(&self, parameters: &[InstrumentParameter]) -> Option<InternalUnit> {
        match self {
            Component::Axis(name) => Some(name.freedom.unit()),
            Component::Instrument { .. } => self.place(parameters).map(|place| parameters[place].unit),
            Component::TriggerDelay | Component::Reading(_) => None,
        }
    }

    /// Whether it is an angle, of an axis or of any instrument.
    pub fn is_angle(&self) -> bool {
        match self {
            Component::Axis(name) => name.freedom.is_angle(),
            Component::Instrument { .. } => {
                kinds().iter().any(|kind| self.unit(kind.unknowns()) == Some(InternalUnit::Radian))
            }
            Component::TriggerDelay | Component::Reading(_) => false,
        }
    }

    /// The slots that it changes (machine errors first), with what multiplies the basis function in each (`None`: 1). A
    /// delay changes the errors along every axis: `rate` is the rate of an axis, `None` if it stands; `times` is a rate
    /// times a number.
    pub fn slots<R>(
        &self,
        machine: &Machine,
        parameters: &[InstrumentParameter],
        rate: impl Fn(usize) -> Option<R>,
        times: impl Fn(&R, f64) -> R,
    ) -> Vec<(usize, Option<R>)> {
        match self {
            Component::Axis(name) => machine.error_slot(name).map(|slot| (slot, None)).into_iter().collect(),
            Component::Instrument { .. } => {
                self.place(parameters).map(|place| (machine.error_slots() + place, None)).into_iter().collect()
            }
            Component::TriggerDelay => {
                let mut slots = Vec::new();
                for axis in 0..machine.axes.len() {
                    let Some(rate) = rate(axis) else { continue };
                    for (slot, along) in machine.slots_along(axis) {
                        slots.push((slot, Some(times(&rate, along))));
                    }
                }
                slots
            }
            Component::Reading(_) => Vec::new(),
        }
    }

    /// The slots that it changes in a test, with what multiplies the basis function row by row (`None`: 1).
    pub fn slots_in(
        &self,
        machine: &Machine,
        parameters: &[InstrumentParameter],
        readings: &Readings,
    ) -> Vec<(usize, Option<Vec<f64>>)> {
        let rates = |axis: usize| -> Option<Vec<f64>> {
            let samples = readings.axis_samples(axis, machine.axes[axis].kind);
            let rates: Vec<f64> = samples.iter().map(|sample| sample.rate).collect();
            rates.iter().any(|rate| *rate != 0.0).then_some(rates)
        };
        let times = |rates: &Vec<f64>, along: f64| rates.iter().map(|rate| rate * along).collect();
        self.slots(machine, parameters, rates, times)
    }
}

impl fmt::Display for Component {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Component::Axis(name) => name.fmt(formatter),
            Component::Instrument { thing, coordinate } if coordinate.is_empty() => formatter.write_str(thing),
            Component::Instrument { thing, coordinate } => write!(formatter, "{thing}.{coordinate}"),
            Component::TriggerDelay => formatter.write_str("trigger"),
            Component::Reading(test) => write!(formatter, "reading[{test}]"),
        }
    }
}
