//! Plain descriptions of effects for work at the machine: `C table: axial motion twice per turn`.
//!
//! A description follows from component × driver × shape, so every effect of the library has its own. Machine parts are
//! named by their position in the chain. A rotary axis on the workpiece side is a table, on the tool side a head. A
//! linear axis is a slide, an axis of a robot a joint.

use std::fmt;

use super::{Component, Effect, Shape};
use crate::axis::{Axis, AxisKind};
use crate::chain::Machine;
use crate::component::{ErrorKind, ErrorName, Freedom};
use crate::driver::Driver;
use crate::effect::shape::EffectWords;

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
    Meaning { part: terms.part(), what: format!("{}{tests}", terms.what()) }
}

/// The description of a component on a machine, without a driver: `C table: axial motion`.
pub fn component_meaning(machine: &Machine, component: &Component) -> Meaning {
    let effect = constant(component.clone());
    let terms = EffectTerms { machine, effect: &effect };
    Meaning { part: terms.part(), what: terms.motion() }
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
    Effect::new(component, Driver::None, Shape::Constant)
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
        self.effect.component.axis(self.machine)
    }

    fn axis_of_driver(&self) -> Option<usize> {
        self.effect.driver.axis(self.machine)
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
            Component::TriggerDelay | Component::Reading(_) => "readings".to_string(),
        }
    }

    /// The motion of the part.
    fn motion(&self) -> String {
        match &self.effect.component {
            Component::Axis(name) => self.axis_motion(name),
            Component::Instrument { thing, coordinate } => match (thing.as_str(), coordinate.as_str()) {
                ("bar", _) => "length".to_string(),
                // The channel whose zero it is.
                ("zero", channel) if !channel.is_empty() => channel.to_string(),
                (thing, "") => thing.replace('_', " "),
                (_, "a" | "b" | "c") => {
                    let about = ["a", "b", "c"].iter().position(|letter| letter == coordinate);
                    format!("tilt about {}", Freedom::ALL[about.unwrap_or(0)].letter())
                }
                (_, "x" | "y" | "z") => format!("shift in {}", coordinate.to_uppercase()),
                (_, angle) => format!("angle {angle}"),
            },
            Component::TriggerDelay => "delay behind the positions".to_string(),
            Component::Reading(test) => format!("additive term in {test}"),
        }
    }

    fn axis_motion(&self, name: &ErrorName) -> String {
        let own =
            self.axis_of_component().map(|axis| (self.machine.axes[axis].kind, self.machine.axes[axis].own_freedom()));
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
        match self.axis_of_driver() {
            Some(axis) if self.follows_its_own_axis() => format!("its {}", quantity(axis)),
            Some(axis) => format!("the {} of the {}", quantity(axis), part_of_axis(self.machine, axis)),
            None => self.effect.driver.kind().phrase(),
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

    /// The motion and its dependence on the driver.
    fn what(&self) -> String {
        self.effect.shape.describe(&EffectWords {
            motion: self.motion(),
            driver: self.driver_phrase(),
            of_another_axis: self.of_another_axis(),
            proportional: self.effect.driver.kind().proportional(),
            is_positioning: self.is_positioning(),
            unit: self.effect.driver_unit(self.machine),
        })
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
}
