//! Points, rotations and small rigid motions over the open [`Scalar`].
//!
//! Motions transform points; motions are never multiplied. The transformation of a point takes 4 products per rotation
//! and preserves the sparsity that a product of 4 × 4 matrices of dual numbers would lose.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::scalar::{Nominal, Scalar};

/// Three coordinates in mm, or three components of a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<S>(pub [S; 3]);

impl<S: Scalar> Point<S> {
    /// A nominal point, with derivatives of zero.
    #[inline(always)]
    pub fn nominal(coordinates: [S::Nominal; 3]) -> Self {
        let [x, y, z] = coordinates;
        Point([S::nominal(x), S::nominal(y), S::nominal(z)])
    }

    /// `self + other`.
    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Point([a + x, b + y, c + z])
    }

    /// `self − other`.
    #[inline(always)]
    pub fn minus(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Point([a - x, b - y, c - z])
    }

    /// `self + offset` with a nominal offset.
    #[inline(always)]
    pub fn shifted(self, offset: [S::Nominal; 3]) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, offset);
        Point([a + x, b + y, c + z])
    }

    /// The Euclidean norm. Its derivative at zero is not finite.
    #[inline(always)]
    pub fn norm(self) -> S {
        let [a, b, c] = self.0;
        (a * a + b * b + c * c).sqrt()
    }
}

/// One of the three coordinate axes of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Coordinate {
    /// X
    X,
    /// Y
    Y,
    /// Z
    Z,
}

impl Coordinate {
    /// The three axes in order.
    pub const ALL: [Coordinate; 3] = [Coordinate::X, Coordinate::Y, Coordinate::Z];

    /// The index: 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The next two axes in cyclic order: Y, Z for X. A positive rotation about `self` turns the first towards the
    /// second.
    fn others(self) -> (usize, usize) {
        ((self.index() + 1) % 3, (self.index() + 2) % 3)
    }
}

/// Sine and cosine of an angle, computed once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SinCos<S> {
    /// The sine.
    pub sin: S,
    /// The cosine.
    pub cos: S,
}

impl<N: Nominal> SinCos<N> {
    /// The rotation by a nominal angle in radians.
    pub fn by(angle_rad: N) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        SinCos { sin, cos }
    }
}

/// Rotation convention of the error angles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum Rotation {
    /// `Rx(a)·Ry(b)·Rz(c)`, exact.
    #[default]
    Exact,
    /// `I + [θ]×` with all three angles in one matrix, the form of the printed equations in the literature.
    SmallAngle,
}

/// A small rigid motion: translations in mm, then `Rx(a)·Ry(b)·Rz(c)` with three angles in radians, in the order of
/// location errors and error motions.
#[derive(Clone, Copy, Debug)]
pub struct SmallMotion<S> {
    translation: Point<S>,
    form: SmallAngles<S>,
}

#[derive(Clone, Copy, Debug)]
enum SmallAngles<S> {
    Exact([SinCos<S>; 3]),
    SmallAngle([S; 3]),
}

impl<S: Scalar> SmallMotion<S> {
    /// From `[EX, EY, EZ]` in mm and `[EA, EB, EC]` in radians.
    pub fn new(six: [S; 6], rotation: Rotation) -> Self {
        let [x, y, z, a, b, c] = six;
        let form = match rotation {
            Rotation::Exact => SmallAngles::Exact([a, b, c].map(|angle| {
                let (sin, cos) = angle.sin_cos();
                SinCos { sin, cos }
            })),
            Rotation::SmallAngle => SmallAngles::SmallAngle([a, b, c]),
        };
        SmallMotion { translation: Point([x, y, z]), form }
    }

    /// `Trans · Rx · Ry · Rz · point`.
    #[inline(always)]
    pub fn push(&self, point: Point<S>) -> Point<S> {
        self.rotate(point).plus(self.translation)
    }

    /// `Rx · Ry · Rz · direction`, without the translation.
    #[inline(always)]
    pub fn rotate(&self, direction: Point<S>) -> Point<S> {
        match &self.form {
            SmallAngles::Exact([a, b, c]) => {
                let about_z = turn_about(Coordinate::Z, *c, direction);
                let about_y = turn_about(Coordinate::Y, *b, about_z);
                turn_about(Coordinate::X, *a, about_y)
            }
            SmallAngles::SmallAngle(angles) => direction.plus(cross(*angles, direction)),
        }
    }

    /// `Rzᵀ · Ryᵀ · Rxᵀ · (point − translation)`: the inverse transformation. For small angles
    /// `(I − [θ]×)·(point − translation)`.
    #[inline(always)]
    pub fn pull(&self, point: Point<S>) -> Point<S> {
        self.rotate_back(point.minus(self.translation))
    }

    /// The inverse of [`SmallMotion::rotate`].
    #[inline(always)]
    pub fn rotate_back(&self, direction: Point<S>) -> Point<S> {
        let back = |turn: &SinCos<S>| SinCos { sin: -turn.sin, cos: turn.cos };
        match &self.form {
            SmallAngles::Exact([a, b, c]) => {
                let about_x = turn_about(Coordinate::X, back(a), direction);
                let about_y = turn_about(Coordinate::Y, back(b), about_x);
                turn_about(Coordinate::Z, back(c), about_y)
            }
            SmallAngles::SmallAngle(angles) => direction.minus(cross(*angles, direction)),
        }
    }
}

/// `a × b`.
#[inline(always)]
pub fn cross<S: Scalar>(a: [S; 3], b: Point<S>) -> Point<S> {
    let ([a, b, c], [x, y, z]) = (a, b.0);
    Point([b * z - c * y, c * x - a * z, a * y - b * x])
}

/// `a · b`.
#[inline(always)]
pub fn dot<S: Scalar>(a: Point<S>, b: Point<S>) -> S {
    let ([a, b, c], [x, y, z]) = (a.0, b.0);
    a * x + b * y + c * z
}

/// `a · d` with a nominal direction.
#[inline(always)]
pub fn dot_nominal<S: Scalar>(a: Point<S>, direction: [S::Nominal; 3]) -> S {
    let ([a, b, c], [x, y, z]) = (a.0, direction);
    a * x + b * y + c * z
}

/// `ω × d` with a nominal direction; zeros of `d` are skipped.
#[inline(always)]
pub(crate) fn cross_nominal<S: Scalar>(omega: [S; 3], direction: [f64; 3]) -> Point<S> {
    let term = |plus: (S, f64), minus: (S, f64)| {
        let scaled = |(s, d): (S, f64)| (d != 0.0).then(|| s * S::Nominal::constant(d));
        match (scaled(plus), scaled(minus)) {
            (None, None) => S::constant(0.0),
            (Some(p), None) => p,
            (None, Some(m)) => -m,
            (Some(p), Some(m)) => p - m,
        }
    };
    let ([a, b, c], [x, y, z]) = (omega, direction);
    Point([term((b, z), (c, y)), term((c, x), (a, z)), term((a, y), (b, x))])
}

/// A rotation about a coordinate axis by an error angle.
#[inline(always)]
pub fn turn_about<S: Scalar>(axis: Coordinate, turn: SinCos<S>, point: Point<S>) -> Point<S> {
    let (first, second) = axis.others();
    let (u, v) = (point.0[first], point.0[second]);
    let mut turned = point;
    turned.0[first] = turn.cos * u - turn.sin * v;
    turned.0[second] = turn.sin * u + turn.cos * v;
    turned
}

/// A rotation about a coordinate axis by a nominal angle.
#[inline(always)]
pub(crate) fn turn_about_nominal<S: Scalar>(axis: Coordinate, turn: SinCos<S::Nominal>, point: Point<S>) -> Point<S> {
    let (first, second) = axis.others();
    let (u, v) = (point.0[first], point.0[second]);
    let mut turned = point;
    turned.0[first] = u * turn.cos - v * turn.sin;
    turned.0[second] = u * turn.sin + v * turn.cos;
    turned
}

/// A fixed pose: `Trans(x, y, z)·Rz(yaw)·Ry(pitch)·Rx(roll)`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixedPose {
    /// Position, mm.
    pub xyz_mm: [f64; 3],
    /// Roll, pitch and yaw about the fixed axes X, Y, Z in this order, degrees.
    pub rpy_deg: [f64; 3],
}

impl From<&Isometry3<f64>> for FixedPose {
    fn from(pose: &Isometry3<f64>) -> FixedPose {
        let rpy = roll_pitch_yaw(&pose.rotation);
        FixedPose { xyz_mm: pose.translation.vector.into(), rpy_deg: rpy.map(f64::to_degrees) }
    }
}

impl From<&FixedPose> for Isometry3<f64> {
    fn from(pose: &FixedPose) -> Isometry3<f64> {
        let [roll, pitch, yaw] = pose.rpy_deg.map(f64::to_radians);
        let rotation = turn(2, yaw) * turn(1, pitch) * turn(0, roll);
        Isometry3::from_parts(Translation3::from(Vector3::from(pose.xyz_mm)), rotation)
    }
}

/// A turn about the coordinate axis 0, 1 or 2 by an angle, rad.
pub fn turn(axis: usize, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::ith(axis, angle))
}

/// Cosine of the pitch below which roll and yaw turn about one line: the yaw is 0 then.
const MIN_COS_PITCH: f64 = 1e-9;

/// Roll, pitch and yaw of a rotation, rad: `Rz(yaw)·Ry(pitch)·Rx(roll)`, about fixed axes.
pub fn roll_pitch_yaw(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let [x, y, z]: [f64; 3] = (rotation * Vector3::x()).into();
    let level = x.hypot(y);
    let yaw = if level > MIN_COS_PITCH { y.atan2(x) } else { 0.0 };
    let pitch = (-z).atan2(level);
    // What remains is the roll, however near to the vertical: the three give the rotation back.
    let rest = (turn(2, yaw) * turn(1, pitch)).inverse() * rotation;
    let roll = 2.0 * rest.i.atan2(rest.w);
    [roll - std::f64::consts::TAU * (roll / std::f64::consts::TAU).round(), pitch, yaw]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Back to the same matrix, with the X axis of the frame up or down too, where the usual formulas divide by zero.
    #[test]
    fn roll_pitch_and_yaw_give_the_rotation_back() {
        for pitch in [0.0, 30.0, -89.999_999_9, 90.0, 90.000_000_1, -90.0] {
            for (roll, yaw) in [(0.0, 0.0), (170.0, -120.0), (-35.0, 180.0), (90.0, 45.0)] {
                let pose = FixedPose { xyz_mm: [1.0, -2.0, 3.0], rpy_deg: [roll, pitch, yaw] };
                let expected = Isometry3::from(&pose);
                let found = Isometry3::from(&FixedPose::from(&expected));
                let apart = (found.to_homogeneous() - expected.to_homogeneous()).abs().max();
                assert!(apart < 1e-14, "{pose:?}: {apart:e}");
            }
        }
    }
}
