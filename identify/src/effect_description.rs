//! Effects in words for whoever works on the machine: `C table: axial motion twice per turn`.
//!
//! The words follow from component × driver × shape, so that every effect of the library has them, and no two have the same. Parts are named by their place
//! in the chain: a rotary axis on the workpiece side is a table, on the tool side a head, a linear axis a slide, an axis of a robot a joint.

use std::fmt;

use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName, Freedom};
use abbe_model::effect::{Component, Driver, Effect, Shape};

/// What an effect means: the part of the machine or instrument, and what it does.
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

/// What an effect means on a machine.
pub fn meaning(machine: &Machine, effect: &Effect) -> Meaning {
    let words = Words { machine, effect };
    let tests = match effect.tests.as_slice() {
        [] => String::new(),
        [test] => format!(", in test {test}"),
        tests => format!(", in tests {}", tests.join(", ")),
    };
    Meaning {
        part: words.part(),
        what: format!("{}{tests}", words.what()),
    }
}

/// What a component is on a machine, whatever it follows: `C table: axial motion`.
pub(crate) fn component_meaning(machine: &Machine, component: &Component) -> Meaning {
    let effect = constant(component.clone());
    let words = Words {
        machine,
        effect: &effect,
    };
    Meaning {
        part: words.part(),
        what: words.motion(),
    }
}

/// Several explanations in one phrase, each part of the machine once, in the order in which the parts first occur.
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

/// A component that follows nothing, as an effect.
fn constant(component: Component) -> Effect {
    Effect {
        component,
        driver: Driver::None,
        shape: Shape::Constant,
        tests: Vec::new(),
    }
}

/// The name of an axis as a part of its machine.
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

/// X, Y or Z: the direction of a translation, or the one that a rotation turns about.
fn direction(freedom: Freedom) -> char {
    Freedom::ALL[freedom.index() % 3].letter()
}

struct Words<'w> {
    machine: &'w Machine,
    effect: &'w Effect,
}

impl Words<'_> {
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

    /// What moves.
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

    /// In which way it moves.
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

    /// What it follows, as the object of a sentence: `its angle`, `the position of the X slide`, `time`.
    fn followed(&self) -> String {
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

    /// ` of the X slide` where it follows another axis.
    fn of_another(&self) -> String {
        match self.axis_of_driver() {
            Some(axis) if !self.follows_its_own_axis() => {
                format!(" of the {}", part_of_axis(self.machine, axis))
            }
            _ => String::new(),
        }
    }

    /// A position, period or width of what it follows, with its unit.
    fn place(&self, value: f64) -> String {
        let rotary = self
            .axis_of_driver()
            .is_some_and(|axis| self.machine.axes[axis].kind == AxisKind::Rotary);
        match self.effect.driver {
            Driver::Time => format!("{} s", digits(value)),
            Driver::Temperature => format!("{} °C", digits(value)),
            Driver::Gravity => format!("{} m", digits(value)),
            _ if rotary => format!("{}°", digits(value.to_degrees())),
            _ => format!("{} mm", digits(value)),
        }
    }

    /// In which way it moves, and how that follows its driver.
    fn what(&self) -> String {
        let motion = self.motion();
        match &self.effect.shape {
            Shape::Constant => format!("{motion}, constant"),
            Shape::Power { degree, .. } => format!("{motion}{}", self.power(*degree)),
            Shape::Polynomial { degree, .. } => {
                format!("{motion}, a polynomial of degree {degree} in {}", self.followed())
            }
            Shape::Harmonic { order } => format!("{motion} {} per turn{}", times(*order), self.of_another()),
            Shape::Periodic { period } => {
                format!(
                    "{motion}, repeating every {}{}",
                    self.place(*period),
                    self.of_another()
                )
            }
            Shape::Curve { intervals, .. } => {
                format!(
                    "{motion}, a free curve over {} in {intervals} intervals",
                    self.followed()
                )
            }
            Shape::Backlash => self.backlash(motion),
            Shape::Lag => self.lag(motion),
            Shape::ReversalSpike { width } => format!(
                "{motion}, a spike after reversal{} that dies away over {}",
                self.of_another(),
                self.place(*width)
            ),
            Shape::Drift => format!("{motion}, drifting with {}", self.followed()),
            Shape::Warmup { tau_s } => {
                format!(
                    "{motion}, warming up with a time constant of {} s",
                    digits(*tau_s)
                )
            }
            Shape::Steps { at } => format!("{motion}, {}{}", self.steps(at), self.of_another()),
            Shape::Local {
                centre,
                width,
                recurs,
            } => {
                let each_turn = if recurs.is_some() { " of each turn" } else { "" };
                format!(
                    "{motion}, a local feature at {}{each_turn}{}, {} to either side",
                    self.place(*centre),
                    self.of_another(),
                    self.place(*width)
                )
            }
        }
    }

    fn power(&self, degree: usize) -> String {
        let followed = self.followed();
        match (degree, &self.effect.driver) {
            (1, Driver::Temperature) => ", following the temperature".to_string(),
            (1, Driver::Gravity) => " under gravity (compliance)".to_string(),
            (1, _) => format!(" in proportion to {followed}"),
            (2, _) => format!(" with the square of {followed}"),
            (3, _) => format!(" with the cube of {followed}"),
            (degree, _) => format!(" with {followed} to the power of {degree}"),
        }
    }

    /// Whether the component is the error of the axis in the very freedom that it moves in.
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
                self.of_another()
            )
        }
    }

    fn lag(&self, motion: String) -> String {
        if self.is_positioning() {
            "lag behind the command in proportion to the speed".to_string()
        } else {
            format!("{motion} in proportion to the speed{}", self.of_another())
        }
    }

    fn steps(&self, at: &[f64]) -> String {
        match at {
            [one] => format!("a step at {}", self.place(*one)),
            [first, .., last] if at.len() > MAX_PLACES => {
                format!(
                    "{} steps from {} to {}",
                    at.len(),
                    self.place(*first),
                    self.place(*last)
                )
            }
            several => {
                let places: Vec<String> = several.iter().map(|place| self.place(*place)).collect();
                format!("steps at {}", places.join(", "))
            }
        }
    }
}

/// Steps that are listed one by one.
const MAX_PLACES: usize = 6;

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
fn digits(value: f64) -> String {
    let magnitude = value.abs().max(1e-3).log10().floor() as i32;
    let text = format!("{value:.*}", (3 - magnitude).clamp(0, 4) as usize);
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|digit| matches!(digit, b'0' | b'.')) => zero.to_string(),
        Some(positive) => format!("−{positive}"),
        None => text,
    }
}
