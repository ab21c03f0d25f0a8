//! Plain descriptions of effects for work at the machine: `C table: axial motion twice per turn`.
//!
//! A description follows from component × driver × shape, so every effect of the library has its own. Machine parts are named by their
//! position in the chain. A rotary axis on the workpiece side is a table, on the tool side a head. A linear axis is a slide, an axis of a
//! robot a joint.

use std::fmt;

use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName, Freedom};
use abbe_model::effect::{Component, Driver, Effect, Shape};

/// The description of an effect: the part of the machine or instrument, and its error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Meaning {
    /// `C table`, `X slide`, `joint J2`, `workpiece ball`.
    pub part: String,
    /// `axial motion twice per turn`.
    pub what: String,
}

impl fmt::Display for Meaning {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: {}", self.part, self.what)
    }
}

/// The description of an effect on a machine.
pub fn meaning(machine: &Machine, effect: &Effect) -> Meaning {
    let terms = EffectTerms { machine, effect };
    let tests = match effect.tests.as_slice() {
        [] => String::new(),
        [test] => format!(", in test {test}"),
        tests => format!(", in tests {}", tests.join(", ")),
    };
    Meaning {
        part: terms.part(),
        what: format!("{}{tests}", terms.what()),
    }
}

/// The description of a component on a machine, without a driver: `C table: axial motion`.
pub(crate) fn component_meaning(machine: &Machine, component: &Component) -> Meaning {
    let effect = constant(component.clone());
    let terms = EffectTerms {
        machine,
        effect: &effect,
    };
    Meaning {
        part: terms.part(),
        what: terms.motion(),
    }
}

/// Joins several explanations into one phrase. Each part of the machine occurs once, in the order of first occurrence.
pub fn explanations(meanings: &[Meaning]) -> String {
    let mut parts: Vec<(&str, Vec<&str>)> = Vec::new();
    for Meaning { part, what } in meanings {
        match parts.iter_mut().find(|(name, _)| name == part) {
            Some((_, of_part)) => of_part.push(what),
            None => parts.push((part, vec![what])),
        }
    }
    let of_part = |(part, what): &(&str, Vec<&str>)| format!("{part}: {}", what.join(", or "));
    let parts: Vec<String> = parts.iter().map(of_part).collect();
    parts.join("; or ")
}

/// A constant effect on a component.
fn constant(component: Component) -> Effect {
    Effect {
        component,
        driver: Driver::None,
        shape: Shape::Constant,
        tests: Vec::new(),
    }
}

/// The name of an axis as a machine part.
fn part_of_axis(machine: &Machine, axis: usize) -> String {
    let Axis { name, kind, .. } = &machine.axes[axis];
    let has = |kind: AxisKind| machine.axes.iter().any(|axis| axis.kind == kind);
    let is_letter = |letters: &str| name.starts_with(|first: char| letters.contains(first));
    match kind {
        AxisKind::Linear if is_letter("XYZUVW") => format!("{name} slide"),
        AxisKind::Linear => format!("slide {name}"),
        AxisKind::Rotary if !is_letter("ABC") || !has(AxisKind::Linear) => format!("joint {name}"),
        AxisKind::Rotary if axis < machine.workpiece_side => format!("{name} table"),
        AxisKind::Rotary => format!("{name} head"),
    }
}

/// X, Y or Z: the direction of a translation, or the axis of a rotation.
fn direction(freedom: Freedom) -> char {
    Freedom::ALL[freedom.index() % 3].letter()
}

struct EffectTerms<'w> {
    machine: &'w Machine,
    effect: &'w Effect,
}

impl EffectTerms<'_> {
    fn axis_of_component(&self) -> Option<usize> {
        match &self.effect.component {
            Component::Axis(name) => self.machine.axis_index(&name.axis),
            _ => None,
        }
    }

    fn axis_of_driver(&self) -> Option<usize> {
        match &self.effect.driver {
            Driver::Axis(name) => self.machine.axis_index(name),
            _ => None,
        }
    }

    fn follows_its_own_axis(&self) -> bool {
        self.axis_of_driver().is_some() && self.axis_of_driver() == self.axis_of_component()
    }

    /// The part that moves.
    fn part(&self) -> String {
        match &self.effect.component {
            Component::Axis(name) => match self.axis_of_component() {
                Some(axis) => part_of_axis(self.machine, axis),
                None => format!("axis {}", name.axis),
            },
            Component::Instrument { thing, .. } => match thing.as_str() {
                "gain" => "sensor".to_string(),
                "radius" | "form" => "artefact".to_string(),
                thing => thing.replace('_', " "),
            },
            Component::TriggerDelay => "readings".to_string(),
        }
    }

    /// The motion of the part.
    fn motion(&self) -> String {
        match &self.effect.component {
            Component::Axis(name) => self.axis_motion(name),
            Component::Instrument { thing, coordinate } => match (thing.as_str(), coordinate.as_str()) {
                ("bar", _) => "length".to_string(),
                (thing, "") => thing.replace('_', " "),
                (_, "a" | "b" | "c") => {
                    let about = ["a", "b", "c"].iter().position(|letter| letter == coordinate);
                    format!("tilt about {}", Freedom::ALL[about.unwrap_or(0)].letter())
                }
                (_, "x" | "y" | "z") => format!("shift in {}", coordinate.to_uppercase()),
                (_, angle) => format!("angle {angle}"),
            },
            Component::TriggerDelay => "delay behind the positions".to_string(),
        }
    }

    fn axis_motion(&self, name: &ErrorName) -> String {
        let own = self.axis_of_component().map(|axis| {
            (
                self.machine.axes[axis].kind,
                self.machine.axes[axis].own_freedom(),
            )
        });
        let rotary = own.is_some_and(|(kind, _)| kind == AxisKind::Rotary);
        let is_own = own.is_some_and(|(_, freedom)| freedom == name.freedom);
        let is_along = own.is_some_and(|(_, freedom)| direction(freedom) == direction(name.freedom));
        let letter = direction(name.freedom);
        match (name.kind, rotary, name.freedom.is_angle()) {
            (ErrorKind::Motion, true, _) if is_own => "angular positioning error".to_string(),
            (ErrorKind::Motion, false, _) if is_own => "positioning error".to_string(),
            (ErrorKind::Motion, true, false) if is_along => "axial motion".to_string(),
            (ErrorKind::Motion, true, false) => format!("radial motion in {letter}"),
            (ErrorKind::Motion, false, false) => format!("straightness error in {letter}"),
            (ErrorKind::Motion, false, true) if is_along => "roll".to_string(),
            (ErrorKind::Motion, _, true) => format!("tilt about {letter}"),
            (ErrorKind::Location, true, _) if is_own => "zero angle".to_string(),
            (ErrorKind::Location, true, false) if is_along => "position along its axis".to_string(),
            (ErrorKind::Location, true, false) => format!("position of the axis in {letter}"),
            (ErrorKind::Location, true, true) => format!("inclination of the axis about {letter}"),
            (ErrorKind::Location, false, false) => format!("zero position in {letter}"),
            (ErrorKind::Location, false, true) => format!("squareness error about {letter}"),
        }
    }

    /// The driver as the object of a sentence: `its angle`, `the position of the X slide`, `time`.
    fn driver_phrase(&self) -> String {
        let quantity = |axis: usize| match self.machine.axes[axis].kind {
            AxisKind::Rotary => "angle",
            AxisKind::Linear => "position",
        };
        match (&self.effect.driver, self.axis_of_driver()) {
            (_, Some(axis)) if self.follows_its_own_axis() => format!("its {}", quantity(axis)),
            (_, Some(axis)) => format!(
                "the {} of the {}",
                quantity(axis),
                part_of_axis(self.machine, axis)
            ),
            (Driver::Axis(name), None) => format!("axis {name}"),
            (Driver::None, _) => "nothing".to_string(),
            (Driver::Time, _) => "time".to_string(),
            (Driver::Temperature, _) => "the temperature".to_string(),
            (Driver::Gravity, _) => "the moment of gravity".to_string(),
        }
    }

    /// ` of the X slide` if the effect follows another axis.
    fn of_another_axis(&self) -> String {
        match self.axis_of_driver() {
            Some(axis) if !self.follows_its_own_axis() => {
                format!(" of the {}", part_of_axis(self.machine, axis))
            }
            _ => String::new(),
        }
    }

    /// A position, period or width of the driver, with its unit.
    fn at_value(&self, value: f64) -> String {
        let rotary = self
            .axis_of_driver()
            .is_some_and(|axis| self.machine.axes[axis].kind == AxisKind::Rotary);
        match self.effect.driver {
            Driver::Time => format!("{} s", four_digits(value)),
            Driver::Temperature => format!("{} °C", four_digits(value)),
            Driver::Gravity => format!("{} m", four_digits(value)),
            _ if rotary => format!("{}°", four_digits(value.to_degrees())),
            _ => format!("{} mm", four_digits(value)),
        }
    }

    /// The motion and its dependence on the driver.
    fn what(&self) -> String {
        let motion = self.motion();
        match &self.effect.shape {
            Shape::Constant => format!("{motion}, constant"),
            Shape::Power { degree, .. } => format!("{motion}{}", self.power(*degree)),
            Shape::Polynomial { degree, .. } => {
                format!(
                    "{motion}, a polynomial of degree {degree} in {}",
                    self.driver_phrase()
                )
            }
            Shape::Harmonic { order } => {
                format!("{motion} {} per turn{}", times(*order), self.of_another_axis())
            }
            Shape::Periodic { period } => {
                format!(
                    "{motion}, repeating every {}{}",
                    self.at_value(*period),
                    self.of_another_axis()
                )
            }
            Shape::Curve { intervals, .. } => {
                format!(
                    "{motion}, a nonparametric curve over {} in {intervals} intervals",
                    self.driver_phrase()
                )
            }
            Shape::Backlash => self.backlash(motion),
            Shape::Lag => self.lag(motion),
            Shape::ReversalSpike { width } => format!(
                "{motion}, a spike after reversal{} that decays over {}",
                self.of_another_axis(),
                self.at_value(*width)
            ),
            Shape::Drift => format!("{motion}, drifting with {}", self.driver_phrase()),
            Shape::Warmup { tau_s } => {
                format!(
                    "{motion}, warming up with a time constant of {} s",
                    four_digits(*tau_s)
                )
            }
            Shape::Steps { at } => format!("{motion}, {}{}", self.steps(at), self.of_another_axis()),
            Shape::Local {
                centre,
                width,
                recurs,
            } => {
                let each_turn = if recurs.is_some() { " of each turn" } else { "" };
                format!(
                    "{motion}, a local feature at {}{each_turn}{}, {} to either side",
                    self.at_value(*centre),
                    self.of_another_axis(),
                    self.at_value(*width)
                )
            }
        }
    }

    fn power(&self, degree: usize) -> String {
        let driver_phrase = self.driver_phrase();
        match (degree, &self.effect.driver) {
            (1, Driver::Temperature) => ", following the temperature".to_string(),
            (1, Driver::Gravity) => " under gravity (compliance)".to_string(),
            (1, _) => format!(" in proportion to {driver_phrase}"),
            (2, _) => format!(" with the square of {driver_phrase}"),
            (3, _) => format!(" with the cube of {driver_phrase}"),
            (degree, _) => format!(" with {driver_phrase} to the power of {degree}"),
        }
    }

    /// Whether the component is the positioning error of its axis.
    fn is_positioning(&self) -> bool {
        let Component::Axis(name) = &self.effect.component else {
            return false;
        };
        let own = self.axis_of_component();
        name.kind == ErrorKind::Motion
            && self.follows_its_own_axis()
            && own.is_some_and(|axis| self.machine.axes[axis].own_freedom() == name.freedom)
    }

    fn backlash(&self, motion: String) -> String {
        if self.is_positioning() {
            "lost motion (backlash) at reversal".to_string()
        } else {
            format!(
                "{motion} that changes at reversal{} (backlash)",
                self.of_another_axis()
            )
        }
    }

    fn lag(&self, motion: String) -> String {
        if self.is_positioning() {
            "lag behind the command in proportion to the speed".to_string()
        } else {
            format!("{motion} in proportion to the speed{}", self.of_another_axis())
        }
    }

    fn steps(&self, at: &[f64]) -> String {
        match at {
            [one] => format!("a step at {}", self.at_value(*one)),
            [first, .., last] if at.len() > MAX_LISTED_STEPS => {
                format!(
                    "{} steps from {} to {}",
                    at.len(),
                    self.at_value(*first),
                    self.at_value(*last)
                )
            }
            several => {
                let values: Vec<String> = several.iter().map(|step| self.at_value(*step)).collect();
                format!("steps at {}", values.join(", "))
            }
        }
    }
}

/// Maximum number of steps in a list.
const MAX_LISTED_STEPS: usize = 6;

/// `once`, `twice`, `17 times`.
fn times(order: f64) -> String {
    if order == 1.0 {
        "once".to_string()
    } else if order == 2.0 {
        "twice".to_string()
    } else {
        format!("{order} times")
    }
}

/// Four significant digits, at most four decimals.
fn four_digits(value: f64) -> String {
    let magnitude = value.abs().max(1e-3).log10().floor() as i32;
    let text = format!("{value:.*}", (3 - magnitude).clamp(0, 4) as usize);
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|digit| matches!(digit, b'0' | b'.')) => zero.to_string(),
        Some(positive) => format!("−{positive}"),
        None => text,
    }
}
