//! The set-up of an instrument in files: the keys of a test that only some instruments have. Each instrument states its
//! own as a type of documents.

use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::Station;
use super::target::{self, Target};
use crate::chain::{Frame, Machine};
use crate::document::fault::{Fault, Within};
use crate::document::node::{Entry, Node, Value};
use crate::document::print::node_of;
use crate::document::value::{self as document, Point, Three, Uncertainties, Uncertainty};
use crate::document::{from_node, schema};
use crate::session::Prior;
use crate::session::expression::{Constant, Length};
use crate::session::limits;
use crate::unit::Unit;

/// A nominal length, as written and in mm.
#[derive(Clone, Debug)]
pub struct Written {
    /// As an expression in the session's constants.
    pub length: Length,
    /// Its value, mm.
    pub mm: f64,
}

impl Written {
    /// A number.
    pub const fn number(value: f64) -> Written {
        Written { length: Length::Number(value), mm: value }
    }
}

/// The set-up of a test as read.
pub struct SetUp {
    /// The nominal geometry.
    pub station: Station<Written>,
    /// The prior of each parameter of the instrument, in their order.
    pub priors: Vec<Prior>,
    /// The socket, if the test states one.
    pub socket: Option<String>,
    /// The group of tests that share the assembled bar, if the test states one.
    pub bar_setup: Option<String>,
}

impl SetUp {
    /// A set-up without a socket and without a group of its own.
    pub(super) fn new(station: Station<Written>, priors: Vec<Prior>) -> SetUp {
        SetUp { station, priors, socket: None, bar_setup: None }
    }
}

/// The keys of a set-up as they stand in a file. Uncertainties of zero are left out, those of the keys `unknown` where they are
/// infinite: what the reader takes without them.
pub(super) fn written(keys: &impl Serialize, unknown: &[&str]) -> Option<Node> {
    let is_default = |key: &str, node: &Node| {
        let numbers = match &node.value {
            Value::Number(number, _) => vec![*number],
            Value::List(items) => items.iter().filter_map(Node::as_number).collect(),
            _ => return false,
        };
        let default = if unknown.contains(&key) { f64::INFINITY } else { 0.0 };
        key.contains("_u_") && numbers.iter().all(|number| *number == default)
    };
    let node = node_of(keys)?;
    let kept = node.entries().iter().filter(|entry| !is_default(&entry.key, &entry.node));
    // What is set up, then how well it is known.
    let (of_u, values): (Vec<_>, Vec<_>) = kept.partition(|entry| entry.key.contains("_u_"));
    Some(Node::table(values.into_iter().chain(of_u).map(|entry| (entry.key.clone(), entry.node.clone()))))
}

/// A number with nine decimals at most: far below what a control resolves.
pub(crate) fn rounded(value: f64) -> f64 {
    // Zero has no sign.
    format!("{value:.9}").parse().unwrap_or(value) + 0.0
}

/// A point as it is written.
pub(super) fn written_point(point: [f64; 3]) -> Point {
    Three(point.map(|mm| document::Length::Number(rounded(mm))))
}

/// A direction as it is written.
pub(super) fn written_direction(direction: [f64; 3]) -> document::Direction {
    document::Direction(direction.map(rounded))
}

/// The uncertainty of a length, µm, or of an angle, arcsec, from its prior.
pub(super) fn written_u(prior: Option<&Prior>, unit: Unit) -> Uncertainty {
    Uncertainty(match prior {
        None | Some(Prior::Known) => 0.0,
        Some(Prior::Gaussian(u)) => rounded(unit.to_display(*u)),
        Some(Prior::Free) => f64::INFINITY,
    })
}

/// The uncertainties of three parameters from the first, lengths in µm.
pub(super) fn written_lengths(priors: &[Prior], first: usize) -> Uncertainties {
    Uncertainties([0, 1, 2].map(|i| written_u(priors.get(first + i), Unit::Micrometre)))
}

/// The same of angles, arcsec.
pub(super) fn written_angles(priors: &[Prior], first: usize) -> Uncertainties {
    Uncertainties([0, 1, 2].map(|i| written_u(priors.get(first + i), Unit::Arcsecond)))
}

/// The end of the key that states the frame of a point.
pub(crate) const FRAME: &str = "_frame";

/// What the frames of points are in a schema.
pub(super) fn frame_schema() -> serde_json::Value {
    serde_json::json!({
        "type": "string",
        "description": "The body on which the point is fixed: \"table\", \"tool\", \"bed\", or \"axis A\" for what an axis \
                        carries."
    })
}

/// A set-up as a file states it, with what its lengths and frames refer to.
pub struct Stated<'a> {
    /// The keys without those of frames.
    keys: Node,
    frames: Vec<(&'static str, Frame)>,
    constants: &'a [Constant],
}

impl<'a> Stated<'a> {
    /// The keys of a set-up; `points` are those of the instrument, each in its default frame.
    pub(super) fn new(
        points: &[(&'static str, Frame)],
        keys: &Node,
        constants: &'a [Constant],
        machine: &Machine,
    ) -> Result<Stated<'a>, Fault> {
        let (mut frames, mut own) = (points.to_vec(), Vec::new());
        for Entry { key, node, .. } in keys.entries() {
            let stem = key.strip_suffix(FRAME);
            match frames.iter_mut().find(|(name, _)| Some(*name) == stem) {
                Some((_, frame)) => *frame = target::frame(node, machine).within(key)?,
                None => own.push((key.clone(), node.clone())),
            }
        }
        Ok(Stated { keys: Node::table(own), frames, constants })
    }

    /// The keys that are not frames. A missing one is explained by its documentation.
    pub(super) fn keys<T: DeserializeOwned + JsonSchema>(&self) -> Result<T, Fault> {
        let frames = self.frames.iter().map(|(name, _)| format!("{name}{FRAME}"));
        let explained = |fault: Fault| fault.explained(|key| schema::description::<T>(key)).also_known(frames);
        from_node(&self.keys).map_err(explained)
    }

    /// The value of a key, if it is stated.
    pub(super) fn value<T: DeserializeOwned>(&self, key: &str) -> Result<Option<T>, Fault> {
        self.keys.get(key).map(|node| from_node(node).within(key)).transpose()
    }

    /// Checks that no other key is stated.
    pub(super) fn only(&self, known: Vec<String>) -> Result<(), Fault> {
        match self.keys.entries().iter().find(|entry| !known.contains(&entry.key)) {
            Some(other) => {
                let frames = self.frames.iter().map(|(name, _)| format!("{name}{FRAME}"));
                Err(Fault::unknown_key(&other.key, known.into_iter().chain(frames).collect()))
            }
            None => Ok(()),
        }
    }

    /// A length above zero.
    pub(super) fn positive(&self, key: &str, length: &document::Length) -> Result<Written, Fault> {
        let written = self.length(key, length)?;
        limits::positive(written.mm).within(key)?;
        Ok(written)
    }

    /// A length of any sign.
    pub(super) fn length(&self, key: &str, length: &document::Length) -> Result<Written, Fault> {
        let (length, mm) = length.evaluated(key, self.constants).within(key)?;
        Ok(Written { length, mm })
    }

    /// Three coordinates.
    pub(super) fn coordinates(&self, key: &str, Three(point): &Point) -> Result<[Written; 3], Fault> {
        let mut coordinates = [const { Written::number(0.0) }; 3];
        for (item, (coordinate, length)) in coordinates.iter_mut().zip(point).enumerate() {
            let (length, mm) = length.evaluated(key, self.constants).within_item(item).within(key)?;
            *coordinate = Written { length, mm };
        }
        Ok(coordinates)
    }

    /// The frame of a point or a direction.
    pub(super) fn frame(&self, name: &str) -> Frame {
        self.frames.iter().find(|(known, _)| *known == name).map_or(Frame::Bed, |(_, frame)| *frame)
    }

    /// A point of the instrument, the origin of its frame where none is stated.
    pub(super) fn point<'p>(&self, name: &str, mm: impl Into<Option<&'p Point>>) -> Result<Target<Written>, Fault> {
        let frame = self.frame(name);
        let mm = match mm.into() {
            Some(mm) => self.coordinates(&format!("{name}_mm"), mm)?,
            None => [const { Written::number(0.0) }; 3],
        };
        Ok(Target { frame, mm })
    }
}

/// Priors of lengths from their uncertainties, µm.
pub(super) fn lengths(Uncertainties(u): &Uncertainties) -> impl Iterator<Item = Prior> {
    u.map(length).into_iter()
}

/// The prior of a length from its uncertainty, µm.
pub(super) fn length(u: Uncertainty) -> Prior {
    prior(u, Unit::Micrometre)
}

/// Priors of angles from their uncertainties, arcsec.
pub(super) fn angles(Uncertainties(u): &Uncertainties) -> impl Iterator<Item = Prior> {
    u.map(angle).into_iter()
}

/// The prior of an angle from its uncertainty, arcsec.
pub(super) fn angle(u: Uncertainty) -> Prior {
    prior(u, Unit::Arcsecond)
}

fn prior(Uncertainty(u): Uncertainty, unit: Unit) -> Prior {
    match u {
        0.0 => Prior::Known,
        u if u.is_infinite() => Prior::Free,
        u => Prior::Gaussian(unit.to_internal(u)),
    }
}
