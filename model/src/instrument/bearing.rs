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

/// The bearings of an observed direction. Farther than 45° from the nominal one, which is no error of a machine, they are
/// limited to the length 1: a blunder, or a reading with the telescope plunged, stays a finite reading that the fit finds to
/// be an outlier.
pub(super) fn observed_bearings(sight: Sight<f64>, direction: Point<f64>) -> [f64; 2] {
    let [across, up] = [1, 2].map(|i| dot(direction, sight[i]));
    let (aside, along) = (across.hypot(up), dot(direction, sight[0]));
    if along >= aside && along > 0.0 {
        [across / along, up / along]
    } else if aside > 0.0 {
        [across / aside, up / aside]
    } else {
        [1.0, 0.0]
    }
}

/// The direction of bearings.
pub(super) fn direction([ahead, across, up]: Sight<f64>, [first, second]: [f64; 2]) -> Point<f64> {
    Point(std::array::from_fn(|i| ahead.0[i] + across.0[i] * first + up.0[i] * second))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every direction has finite bearings, those near the nominal one the tangents of its angles, and the opposite direction
    /// the largest.
    #[test]
    fn bearings_of_blunders_are_finite() {
        let sight = [Point([1.0, 0.0, 0.0]), Point([0.0, 1.0, 0.0]), Point([0.0, 0.0, 1.0])];
        let of = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            observed_bearings(sight, Point([cos, 0.6 * sin, 0.8 * sin]))
        };
        for degrees in [0.0_f64, 0.01, 30.0, 44.9] {
            let tangent = degrees.to_radians().tan();
            let [across, up] = of(degrees);
            assert!((across - 0.6 * tangent).abs() < 1e-12 && (up - 0.8 * tangent).abs() < 1e-12, "{degrees}");
        }
        for degrees in [45.1, 89.999, 90.0, 90.001, 179.0] {
            let [across, up] = of(degrees);
            assert!((across.hypot(up) - 1.0).abs() < 1e-12 && (up / across - 0.8 / 0.6).abs() < 1e-9, "{degrees}");
        }
        assert_eq!(observed_bearings(sight, Point([-1.0, 0.0, 0.0])), [1.0, 0.0]);
        assert_eq!(observed_bearings(sight, Point([0.0, 0.0, 1.0])), [0.0, 1.0]);
    }
}
