//! The two angles of a direction about a nominal one, across and up.
//!
//! With the nominal direction `U`, `A` across and `V` up, a direction `p` has the bearings
//!
//! ```text
//! across = (p · A)/(p · U)        up = (p · V)/(p · U)
//! ```
//!
//! which are the difference of azimuth times the cosine of the elevation, and that of elevation.

use crate::frames::{Point, dot};
use crate::scalar::Scalar;

/// Nominal direction, across and up, perpendicular and of unit length.
pub(super) type Sight<S> = [Point<S>; 3];

/// The bearings of a direction.
pub(super) fn bearings<S: Scalar>([ahead, across, up]: Sight<S>, direction: Point<S>) -> [S; 2] {
    let along = dot(direction, ahead);
    [dot(direction, across) / along, dot(direction, up) / along]
}

/// The bearings of an observed direction; infinite more than a right angle away, which is no small difference.
pub(super) fn observed_bearings(sight: Sight<f64>, direction: Point<f64>) -> [f64; 2] {
    if dot(direction, sight[0]) <= 0.0 { [f64::INFINITY; 2] } else { bearings(sight, direction) }
}

/// The direction of bearings.
pub(super) fn direction([ahead, across, up]: Sight<f64>, [first, second]: [f64; 2]) -> Point<f64> {
    Point(std::array::from_fn(|i| ahead.0[i] + across.0[i] * first + up.0[i] * second))
}
