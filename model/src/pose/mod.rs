//! The tool in the table frame, and the part of its deviation that a machine can correct.
//!
//! [`jacobian`]: the derivative of the pose by the axes; [`reach`]: axis positions for a pose of the tool.

pub mod jacobian;
pub mod reach;

use crate::axis::AxisKind;
use crate::chain::{AxisPosition, BodyErrors, Frame, Machine};
use crate::frames::Point;
use crate::scalar::Scalar;
use nalgebra::{Matrix3, Vector3, Vector6};

/// Remaining position error beyond which a pose is not reached, mm.
pub const TOLERANCE_MM: f64 = 1e-6;
/// Remaining angular error beyond which a pose is not reached, rad.
pub const TOLERANCE_RAD: f64 = 1e-9;

/// Lengths of the two parts of a deviation: mm and rad.
pub fn size(deviation: &Vector6<f64>) -> [f64; 2] {
    [deviation.fixed_rows::<3>(0).norm(), deviation.fixed_rows::<3>(3).norm()]
}

/// The tool point and the directions of the tool frame, in the table frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The tool point, mm.
    pub point_mm: Vector3<f64>,
    /// The directions of X, Y and Z of the tool frame, as columns.
    pub directions: Matrix3<f64>,
}

/// The tool point and its neighbours at 1 mm along X, Y and Z of the tool frame, in the table frame, over an open
/// scalar. Motions transform points and are never multiplied.
pub(super) fn points<S: Scalar<Nominal = f64>>(
    machine: &Machine,
    state: &[AxisPosition<f64>],
    errors: &[BodyErrors<S>],
    tool_mm: [f64; 3],
) -> [Point<S>; 4] {
    std::array::from_fn(|k| {
        let mut point = tool_mm;
        if k > 0 {
            point[k - 1] += 1.0;
        }
        let reference = machine.in_r(Frame::Tool, state, errors, Point::nominal(point));
        machine.in_frame(Frame::Table, state, errors, reference)
    })
}

impl Pose {
    /// The pose at axis positions with errors.
    pub fn of(machine: &Machine, state: &[AxisPosition<f64>], errors: &[BodyErrors<f64>], tool_mm: [f64; 3]) -> Pose {
        let [point, x, y, z] = points(machine, state, errors, tool_mm).map(|point| Vector3::from(point.0));
        Pose { point_mm: point, directions: Matrix3::from_columns(&[x - point, y - point, z - point]) }
    }

    /// The pose at axis positions of the machine without errors.
    pub fn nominal(machine: &Machine, state: &[AxisPosition<f64>], tool_mm: [f64; 3]) -> Pose {
        Pose::of(machine, state, &vec![BodyErrors::NONE; machine.axes.len()], tool_mm)
    }
}

/// What the axes of a machine correct.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// The tool point, by the linear axes.
    Position,
    /// The tool point and the direction of the tool's Z, by all axes. A rotation about that direction is free.
    PositionAndAxis,
    /// Position and orientation, by all axes.
    Pose,
}

impl Aim {
    /// What a machine can correct everywhere but in singularities: the pose with at least six axes, three of them
    /// rotary; position and tool axis with five axes, two of them rotary; otherwise the position.
    pub fn of(machine: &Machine) -> Aim {
        let rotary = machine.axes.iter().filter(|axis| axis.kind == AxisKind::Rotary).count();
        match (machine.axes.len(), rotary) {
            (6.., 3..) => Aim::Pose,
            (5.., 2..) => Aim::PositionAndAxis,
            _ => Aim::Position,
        }
    }

    /// Number of independent components of a deviation.
    pub fn rank(self) -> usize {
        match self {
            Aim::Position => 3,
            Aim::PositionAndAxis => 5,
            Aim::Pose => 6,
        }
    }

    /// The axes that correct, by index in the machine.
    pub fn axes(self, machine: &Machine) -> Vec<usize> {
        let kind = |axis: &usize| self != Aim::Position || machine.axes[*axis].kind == AxisKind::Linear;
        (0..machine.axes.len()).filter(kind).collect()
    }

    /// The deviation of a pose from a wanted one: mm, then the rotation vector in rad. Components that the aim leaves
    /// free are zero.
    pub fn deviation(self, actual: &Pose, wanted: &Pose) -> Vector6<f64> {
        let translation = actual.point_mm - wanted.point_mm;
        let rotation = match self {
            Aim::Position => Vector3::zeros(),
            Aim::PositionAndAxis => wanted.directions.column(2).cross(&actual.directions.column(2)),
            Aim::Pose => rotation_between(&wanted.directions, &actual.directions),
        };
        let mut deviation = Vector6::zeros();
        deviation.fixed_rows_mut::<3>(0).copy_from(&translation);
        deviation.fixed_rows_mut::<3>(3).copy_from(&rotation);
        deviation
    }

    /// The part of a rotation that the aim holds, with the wanted direction of the tool's Z.
    pub(super) fn held(self, rotation: Vector3<f64>, axis: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Aim::Position => Vector3::zeros(),
            Aim::PositionAndAxis => rotation - axis * axis.dot(&rotation),
            Aim::Pose => rotation,
        }
    }
}

/// `½ Σ a_i × b_i` over the directions of two frames: the sine of the angle between them along the axis of rotation.
fn rotation_between(from: &Matrix3<f64>, to: &Matrix3<f64>) -> Vector3<f64> {
    let sum: Vector3<f64> = (0..3).map(|i| from.column(i).cross(&to.column(i))).sum();
    sum * 0.5
}
