//! What is done with an instrument at the machine: what a pose must meet, how a path keeps two points together, which set-up
//! reads a move, and the words of a set-up sheet.

use super::Station;
use crate::chain::Machine;
use crate::frames::{Point, cross};
use crate::rotation_error::Body;
use crate::words::number;

/// What a pose that the instrument measures has to meet.
#[derive(Clone, Copy, Debug)]
pub enum Contact {
    /// Nothing: a line of sight or a direction is all that it needs.
    None,
    /// The tool's point is at a point of R, mm.
    InR([f64; 3]),
    /// The tool's point is at this distance from the point of the table, mm.
    AtDistance(f64),
    /// A stylus touches its artefact.
    Touching,
}

/// How the tool point follows the instrument's point of the table on a path of kind `follow`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Following {
    /// At the length of a bar, whose direction the path states.
    AtBar,
    /// The two points coincide: a path that states a direction is refused with this message and help.
    Touching(&'static str, &'static str),
    /// At no fixed distance.
    Apart,
}

/// What an operator does with an instrument, in the words of a set-up sheet.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Handling {
    /// What stands beside the machine and is set up there: `Laser tracker, where it sees the target at every position`.
    pub beside: Option<String>,
    /// The object on the table whose centre the machine probes to find R if no axis of the table gives it.
    pub probed: Option<&'static str>,
    /// What is taken off when a program runs for the first time: `the bar`.
    pub taken_off: Option<&'static str>,
    /// What is done between tests beside mounting objects: `changes of the bar`.
    pub changes: Option<&'static str>,
    /// What is done at the start of the motion, before the recording starts: `Mount the optics, and align the beam`.
    pub begins: Option<&'static str>,
    /// Whether it reads while the axes rest, at each target (ISO 230-1, ISO 230-2), and not along the motion.
    pub reads_at_rest: bool,
}

/// A move of one axis, for which an instrument is set up.
#[derive(Clone, Copy)]
pub struct Travel<'m> {
    /// The machine.
    pub machine: &'m Machine,
    /// The axis, by index.
    pub axis: usize,
    /// Its direction in R where the other axes stand, of unit length.
    pub direction: [f64; 3],
}

impl Travel<'_> {
    /// Whether the axis moves the body that an instrument reads.
    pub(super) fn moves(&self, body: Body) -> bool {
        let on_table = self.axis < self.machine.workpiece_side;
        match body {
            Body::Relative => true,
            Body::Tool => !on_table,
            Body::Table => on_table,
        }
    }

    /// The direction of the axis with its largest component positive.
    pub(super) fn positive(&self) -> [f64; 3] {
        let largest = |a: f64, b: f64| if b.abs() > a.abs() + 1e-9 { b } else { a };
        let sign = self.direction.iter().copied().fold(0.0, largest).signum();
        self.direction.map(|x| x * sign + 0.0)
    }

    /// Two directions across the axis, perpendicular to each other, as near to R's directions as they can be.
    pub(super) fn across(&self) -> [[f64; 3]; 2] {
        let along = self.direction;
        let farthest = (1..3).fold(0, |best, i| if along[i].abs() < along[best].abs() - 1e-9 { i } else { best });
        let share = along[farthest];
        let first: [f64; 3] = std::array::from_fn(|i| f64::from(u8::from(i == farthest)) - share * along[i]);
        let length = first.iter().map(|x| x * x).sum::<f64>().sqrt();
        let first = first.map(|x| x / length);
        let second = cross(along, Point(first)).0;
        [first, Travel { direction: second, ..*self }.positive()]
    }
}

/// A set-up of an instrument that reads a motion.
#[derive(Clone, Debug)]
pub struct Aligned {
    /// The set-up.
    pub station: Station<f64>,
    /// What differs from the present one, in words; empty if nothing does.
    pub words: String,
    /// Whether the instrument has to be set up anew.
    pub is_new: bool,
}

impl Aligned {
    /// A set-up that stays.
    pub(super) fn as_it_stands(station: impl Into<Station<f64>>) -> Vec<Aligned> {
        vec![Aligned { station: station.into(), words: String::new(), is_new: false }]
    }
}

/// A direction of R for an operator: `−X`, or its components.
pub(super) fn direction_in_words(direction: [f64; 3]) -> String {
    let principal = (0..3).find(|i| direction[*i].abs() > 1.0 - 1e-9);
    match principal {
        Some(i) => format!("{}{}", if direction[i] < 0.0 { "−" } else { "" }, ["X", "Y", "Z"][i]),
        None => format!("[{}]", direction.map(|x| number((x * 1e4).round() / 1e4)).join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_component_of_a_direction_becomes_positive() {
        let machine = Machine::from_code("w b X Y Z t").unwrap();
        let positive = |direction: [f64; 3]| Travel { machine: &machine, axis: 0, direction }.positive();
        assert_eq!(positive([-0.8, 0.6, 0.0]), [0.8, -0.6, 0.0]);
        assert_eq!(positive([0.6, -0.8, 0.0]), [-0.6, 0.8, 0.0]);
        assert_eq!(positive([0.6, 0.0, 0.8]), [0.6, 0.0, 0.8]);
    }
}
