//! Columns of readings in data files: each instrument states its own.

use crate::unit::Unit;

/// What a column of readings holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The reading of an instrument that measures one length.
    Length,
    /// A deviation from the reference length of the set-up.
    Deviation,
    /// Against the probing direction: the distance by which the surface lies beyond the target.
    Outward,
    /// The value of a channel.
    Channel(usize),
    /// The value of a channel less the nominal reading.
    FromNominal(usize),
    /// A polar coordinate of the position of three channels: range, azimuth, elevation.
    Polar(usize),
    /// A component `x`, `y`, `z`, `w` of the unit quaternion that states the rotation of channels 3 to 5; it has no unit.
    Quaternion(usize),
    /// The name of the socket; it has no unit.
    Socket,
}

/// The channels of a rotation that a quaternion can state.
pub const OF_ROTATION: std::ops::Range<usize> = 3..6;

impl Quantity {
    /// The channel that the column holds, among all that the instrument can have.
    pub fn channel(self) -> Option<usize> {
        match self {
            Quantity::Length | Quantity::Deviation | Quantity::Outward => Some(0),
            Quantity::Channel(channel) | Quantity::FromNominal(channel) | Quantity::Polar(channel) => Some(channel),
            Quantity::Quaternion(_) | Quantity::Socket => None,
        }
    }

    /// Whether two columns state the same.
    pub fn is_same_as(self, other: Quantity) -> bool {
        match (self, other) {
            (Quantity::Quaternion(_), _) | (_, Quantity::Quaternion(_)) if self != other => {
                let channel = self.channel().or(other.channel());
                channel.is_some_and(|channel| OF_ROTATION.contains(&channel))
            }
            _ => self == other || self.channel().is_some() && self.channel() == other.channel(),
        }
    }
}

/// A column of readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// Its name without the unit.
    pub stem: &'static str,
    /// The unit in which messages name it; [`Unit::One`] for a column without one. A file may use any unit of length or angle.
    pub unit: Unit,
    /// What it holds.
    pub quantity: Quantity,
}

impl Column {
    pub(super) const fn new(stem: &'static str, unit: Unit, quantity: Quantity) -> Column {
        Column { stem, unit, quantity }
    }

    /// Three coordinates.
    pub(super) const fn vector(stems: [&'static str; 3], unit: Unit) -> [Column; 3] {
        let [x, y, z] = stems;
        let channel = Quantity::Channel;
        [Column::new(x, unit, channel(0)), Column::new(y, unit, channel(1)), Column::new(z, unit, channel(2))]
    }

    /// Whether it is an angle.
    pub fn is_angle(&self) -> bool {
        self.unit.is_angle()
    }

    /// Its name, with a unit if it has one.
    pub fn name(&self, unit: Unit) -> String {
        if self.unit == Unit::One { self.stem.to_string() } else { format!("{}_{unit}", self.stem) }
    }
}
