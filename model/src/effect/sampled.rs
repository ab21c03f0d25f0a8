//! How densely and how far a session samples a driver. This determines which members of a shape are observable.

use std::f64::consts::TAU;

/// Readings per cycle of the shortest wave in the library. The sampling theorem requires two.
pub(crate) const READINGS_PER_CYCLE: f64 = 2.4;

/// The sampling of a driver in a session, for the grid of a shape.
#[derive(Clone, Debug, Default)]
pub struct Sampled {
    /// Lowest and highest position, mm or rad, if the driver is the position of an axis.
    pub ends: Option<[f64; 2]>,
    /// Whether that axis is rotary.
    pub rotary: bool,
    /// Whether that axis is level at every position of the axes that carry it, and all readings are angles: what it carries
    /// is a direction, whose height above the horizon follows its position.
    pub is_elevation: bool,
    /// Median step between readings where the axis moves, mm or rad; 0 without an axis, and for poses.
    pub step: f64,
    /// Whether the rows are independent poses: no axis is swept.
    pub poses: bool,
    /// Whether the axis is read in both directions of travel.
    pub both_directions: bool,
    /// Whether the axis reverses inside runs.
    pub reverses_inside_runs: bool,
    /// Whether all readings have a time.
    pub has_time: bool,
    /// Duration of the session, s.
    pub duration_s: f64,
    /// Values that separate the levels of a driver column with at least three: midpoints between few levels, else
    /// deciles. Empty for other drivers.
    pub between_levels: Vec<f64>,
    /// The divisor of the driver in powers.
    pub default_scale: f64,
    /// The numbers that the library gives for the family: degrees, time constants.
    pub numbers: Vec<f64>,
}

impl Sampled {
    /// Length of the travel; 1 without an axis.
    pub fn span(&self) -> f64 {
        self.ends.map_or(1.0, |[low, high]| high - low)
    }

    /// Whether the readings cover a full turn.
    pub fn is_full_turn(&self) -> bool {
        self.rotary && self.span() > 0.99 * TAU
    }
}
