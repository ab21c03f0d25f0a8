//! The set-up of an instrument in files: the keys of a test that only some instruments have. Each instrument states its
//! own as a type of documents.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use super::Station;
use crate::document::fault::{Fault, Within};
use crate::document::node::Node;
use crate::document::value::{self as document, Point, Three, Uncertainties, Uncertainty};
use crate::document::{from_node, schema};
use crate::files::quantity::{ARCSECOND, MICROMETRE};
use crate::session::Prior;
use crate::session::expression::{Constant, Length};
use crate::session::limits;

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

/// The keys of a set-up. A missing one is explained by its documentation.
pub(super) fn keys<T: DeserializeOwned + JsonSchema>(set_up: &Node) -> Result<T, Fault> {
    from_node(set_up).map_err(|fault| fault.explained(|key| schema::description::<T>(key)))
}

/// A length above zero.
pub(super) fn positive(key: &str, length: &document::Length, constants: &[Constant]) -> Result<Written, Fault> {
    let (length, mm) = length.evaluated(key, constants).within(key)?;
    limits::positive(mm).within(key)?;
    Ok(Written { length, mm })
}

/// A point.
pub(super) fn point(key: &str, Three(point): &Point, constants: &[Constant]) -> Result<[Written; 3], Fault> {
    let mut coordinates = [const { Written::number(0.0) }; 3];
    for (item, (coordinate, length)) in coordinates.iter_mut().zip(point).enumerate() {
        let (length, mm) = length.evaluated(key, constants).within_item(item).within(key)?;
        *coordinate = Written { length, mm };
    }
    Ok(coordinates)
}

/// Priors of lengths from their uncertainties, µm.
pub(super) fn lengths(Uncertainties(u): &Uncertainties) -> impl Iterator<Item = Prior> {
    u.map(length).into_iter()
}

/// The prior of a length from its uncertainty, µm.
pub(super) fn length(u: Uncertainty) -> Prior {
    prior(u, MICROMETRE)
}

/// Priors of angles from their uncertainties, arcsec.
pub(super) fn angles(Uncertainties(u): &Uncertainties) -> impl Iterator<Item = Prior> {
    u.map(angle).into_iter()
}

/// The prior of an angle from its uncertainty, arcsec.
pub(super) fn angle(u: Uncertainty) -> Prior {
    prior(u, ARCSECOND)
}

fn prior(Uncertainty(u): Uncertainty, unit: f64) -> Prior {
    match u {
        0.0 => Prior::Known,
        u if u.is_infinite() => Prior::Free,
        u => Prior::Gaussian(u * unit),
    }
}
