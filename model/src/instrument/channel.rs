//! Channels: the scalars of a reading, each with its unit.
//!
//! An instrument reads one scalar or several of its targets: a length, three coordinates, a displacement and two angles.
//! A row of readings has one value per channel; a value that was not read is NaN.

use crate::unit::InternalUnit;

/// One scalar of a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channel {
    /// Its name in results: `length`, `x`, `pitch`.
    pub name: &'static str,
    /// Its internal unit: mm or rad.
    pub unit: InternalUnit,
    /// Whether it is one of three coordinates of a vector.
    pub is_coordinate: bool,
    /// Whether it reads zero without a column: a contact.
    pub is_contact: bool,
}

impl Channel {
    pub(super) const fn length(name: &'static str) -> Channel {
        Channel { name, unit: InternalUnit::Millimetre, is_coordinate: false, is_contact: false }
    }

    pub(super) const fn angle(name: &'static str) -> Channel {
        Channel { name, unit: InternalUnit::Radian, is_coordinate: false, is_contact: false }
    }

    /// Three coordinates.
    pub(super) const fn vector([x, y, z]: [&'static str; 3]) -> [Channel; 3] {
        const fn coordinate(name: &'static str) -> Channel {
            Channel { is_coordinate: true, ..Channel::length(name) }
        }
        [coordinate(x), coordinate(y), coordinate(z)]
    }

    /// The same, which reads zero without a column.
    pub(super) const fn of_contact(self) -> Channel {
        Channel { is_contact: true, ..self }
    }

    /// Whether it is an angle.
    pub fn is_angle(self) -> bool {
        self.unit == InternalUnit::Radian
    }
}

/// What distinguishes each channel in the names of columns: nothing for the only one, the coordinate of a vector, else the
/// name of the channel.
pub fn labels(channels: &[Channel]) -> Vec<&'static str> {
    match channels {
        [_] => vec![""],
        _ if are_vector(channels) => vec!["x", "y", "z"],
        _ => channels.iter().map(|channel| channel.name).collect(),
    }
}

/// Whether channels are the three coordinates of a vector.
pub fn are_vector(channels: &[Channel]) -> bool {
    channels.len() == 3 && channels.iter().all(|channel| channel.is_coordinate)
}
