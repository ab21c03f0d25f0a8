//! Rigid motions as unit quaternion and translation, and the motion of one axis with its errors.
//!
//! No step is linearised: every rotation, however small, is a unit quaternion `(cos φ/2, d sin φ/2)`.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// A rigid motion: rotation first, then translation (mm).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The rotation.
    pub turn: UnitQuaternion<f64>,
    /// The translation, mm.
    pub shift_mm: Vector3<f64>,
}

/// The rotation by `angle_rad` about the unit vector `direction`, by the half-angle formulas.
pub fn turn_about(direction: Vector3<f64>, angle_rad: f64) -> UnitQuaternion<f64> {
    let (sine, cosine) = (0.5 * angle_rad).sin_cos();
    UnitQuaternion::from_quaternion(Quaternion::from_parts(cosine, direction * sine))
}

impl Pose {
    /// No motion.
    pub fn identity() -> Pose {
        Pose { turn: UnitQuaternion::identity(), shift_mm: Vector3::zeros() }
    }

    /// `Trans(shift_mm)`.
    pub fn slide(shift_mm: Vector3<f64>) -> Pose {
        Pose { turn: UnitQuaternion::identity(), shift_mm }
    }

    /// `Rot(direction, angle_rad)`.
    pub fn rotation(direction: Vector3<f64>, angle_rad: f64) -> Pose {
        Pose { turn: turn_about(direction, angle_rad), shift_mm: Vector3::zeros() }
    }

    /// A displaced body: `Trans(EX, EY, EZ) · Rx(EA) · Ry(EB) · Rz(EC)` from `[EX, EY, EZ, EA, EB, EC]` in mm and rad.
    pub fn displaced(six: &[f64; 6]) -> Pose {
        let turn =
            turn_about(Vector3::x(), six[3]) * turn_about(Vector3::y(), six[4]) * turn_about(Vector3::z(), six[5]);
        Pose { turn, shift_mm: Vector3::new(six[0], six[1], six[2]) }
    }

    /// `self · inner`: `inner` acts on a point first.
    pub fn then_inner(self, inner: Pose) -> Pose {
        Pose { turn: self.turn * inner.turn, shift_mm: self.shift_mm + self.turn * inner.shift_mm }
    }

    /// The moved point, mm.
    pub fn apply(&self, point_mm: Vector3<f64>) -> Vector3<f64> {
        self.turn * point_mm + self.shift_mm
    }
}

/// Whether an axis is rotary or linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Joint {
    /// Positions are rad.
    Rotary,
    /// Positions are mm.
    Linear,
}

/// One axis: its direction (unit vector in R) and a point on it (mm).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Rotary or linear.
    pub joint: Joint,
    /// Direction of the moving body for an increasing command, unit vector.
    pub direction: Vector3<f64>,
    /// Origin, mm.
    pub origin_mm: Vector3<f64>,
}

impl Axis {
    /// The motion of the axis at `position` (mm or rad) with its location errors and error motions, each
    /// `[EX, EY, EZ, EA, EB, EC]` in mm and rad.
    ///
    /// Rotary: `Trans(o) · E0 · E(q) · Rot(d, q) · Trans(−o)`. Linear: `Trans(o + q d′) · E(q) · Trans(−o)` with
    /// `d′ = d + ω0 × d`, where ω0 are the rotations of the location errors; their translations have no effect.
    pub fn motion(&self, position: f64, location: &[f64; 6], motion: &[f64; 6]) -> Pose {
        let back = Pose::slide(-self.origin_mm);
        match self.joint {
            Joint::Rotary => Pose::slide(self.origin_mm)
                .then_inner(displaced_unless_zero(location))
                .then_inner(displaced_unless_zero(motion))
                .then_inner(Pose::rotation(self.direction, position))
                .then_inner(back),
            Joint::Linear => {
                let tilt = Vector3::new(location[3], location[4], location[5]);
                let tilted = self.direction + tilt.cross(&self.direction);
                Pose::slide(self.origin_mm + tilted * position)
                    .then_inner(displaced_unless_zero(motion))
                    .then_inner(back)
            }
        }
    }
}

fn displaced_unless_zero(six: &[f64; 6]) -> Pose {
    if *six == [0.0; 6] { Pose::identity() } else { Pose::displaced(six) }
}
