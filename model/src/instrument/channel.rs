//! Channels: the scalars of a reading, each with its unit.
//!
//! An instrument reads one scalar or several of its targets: a length, three coordinates, a displacement and two angles.
//! A row of readings has one value per channel; a value that was not read is NaN.

use super::InternalUnit;

/// One scalar of a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channel {
    /// Its name in results: `length`, `x`, `pitch`.
    pub name: &'static str,
    /// Its internal unit: mm or rad.
    pub unit: InternalUnit,
}

impl Channel {
    pub(super) const fn length(name: &'static str) -> Channel {
        Channel { name, unit: InternalUnit::Millimetre }
    }

    pub(super) const fn angle(name: &'static str) -> Channel {
        Channel { name, unit: InternalUnit::Radian }
    }

    /// Three coordinates.
    pub(super) const fn vector([x, y, z]: [&'static str; 3]) -> [Channel; 3] {
        [Channel::length(x), Channel::length(y), Channel::length(z)]
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

/// Whether channels are the three coordinates of a vector, which have a length.
pub fn are_vector(channels: &[Channel]) -> bool {
    matches!(channels, [a, b, c] if [a, b, c].iter().all(|channel| !channel.is_angle()))
}
