//! The chain at its zero position with location errors.
//!
//! ```text
//! T = Π_k Trans(o_k)·E0_k·Rot(d_k, q_k)·Trans(−o_k) = Π_k X_k·Rot(d_k, q_k) · Trans(p − o_n)
//! X_1 = Trans(o_1)·E0_1,   X_k = Trans(o_k − o_{k−1})·E0_k
//! ```
//!
//! `X_k` is the pose of joint `k` in the frame of the joint before it, from the bed outwards on either side.

use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::{ERRORS_PER_AXIS, Machine};
use abbe_model::frames::Rotation;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use abbe_identify::model_file::IdentifiedModel;

use crate::error::unrepresentable;

/// A joint with its pose in the frame of the joint before it.
#[derive(Clone, Debug)]
pub struct JointFrame {
    /// Its axis, by index in the machine.
    pub axis: usize,
    /// Its pose at zero in the frame of the joint before it, mm.
    pub pose: Isometry3<f64>,
    /// Its direction in its own frame; for a linear axis with its squareness errors.
    pub direction: Vector3<f64>,
}

/// The joints of one side of the machine from the bed outwards, and the pose of the last point.
#[derive(Clone, Debug)]
pub struct Branch {
    /// The joints.
    pub joints: Vec<JointFrame>,
    /// The pose of the tool or table frame at a point, in the frame of the last joint, mm.
    pub end: Isometry3<f64>,
}

/// The location errors of a model by slot of its machine, mm and rad.
pub fn location_errors(model: &IdentifiedModel) -> Vec<f64> {
    let mut slots = vec![0.0; model.machine.error_slots()];
    for parameter in &model.parameters {
        if let Some(slot) = parameter.id.error().and_then(|name| model.machine.error_slot(name)) {
            slots[slot] = parameter.value;
        }
    }
    slots
}

/// The tool side of a machine with location errors; `point_mm` in the tool frame is the end.
///
/// # Errors
/// If the machine's error angles are small-angle matrices, which are no rotations.
pub fn tool_side(machine: &Machine, errors: &[f64], point_mm: [f64; 3]) -> Result<Branch, Diagnostic> {
    branch(machine, errors, (machine.workpiece_side..machine.axes.len()).collect(), point_mm)
}

/// The workpiece side, from the bed outwards; `point_mm` in the table frame is the end.
///
/// # Errors
/// As [`tool_side`].
pub fn workpiece_side(machine: &Machine, errors: &[f64], point_mm: [f64; 3]) -> Result<Branch, Diagnostic> {
    branch(machine, errors, (0..machine.workpiece_side).rev().collect(), point_mm)
}

fn branch(machine: &Machine, errors: &[f64], axes: Vec<usize>, point_mm: [f64; 3]) -> Result<Branch, Diagnostic> {
    if machine.rotation != Rotation::Exact {
        return Err(unrepresentable(
            "a description of the chain",
            "`rotation = \"small-angle\"` of the machine",
            "it needs rotations, and these matrices are none; identify the model with `rotation = \"exact\"`",
        ));
    }
    let mut before = Vector3::zeros();
    let mut joints = Vec::with_capacity(axes.len());
    for index in axes {
        let axis = &machine.axes[index];
        let origin = Vector3::from(axis.origin_mm);
        let six: [f64; 6] = std::array::from_fn(|i| errors[index * ERRORS_PER_AXIS + i]);
        let direction = Vector3::from(axis.direction);
        let (shift, turn, direction) = match axis.kind {
            AxisKind::Rotary => {
                let about = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
                let turn = about(Vector3::x(), six[3]) * about(Vector3::y(), six[4]) * about(Vector3::z(), six[5]);
                (Vector3::new(six[0], six[1], six[2]), turn, direction)
            }
            AxisKind::Linear => {
                let tilted = direction + Vector3::new(six[3], six[4], six[5]).cross(&direction);
                (Vector3::zeros(), UnitQuaternion::identity(), tilted)
            }
        };
        let pose = Isometry3::from_parts(Translation3::from(origin - before + shift), turn);
        joints.push(JointFrame { axis: index, pose, direction });
        before = origin;
    }
    let end = Isometry3::from_parts(Translation3::from(Vector3::from(point_mm) - before), UnitQuaternion::identity());
    Ok(Branch { joints, end })
}

impl Branch {
    /// The axis line of each joint in R with all axes at zero: a point in mm and a direction; and the end pose there.
    pub fn at_zero(&self) -> (Vec<(Vector3<f64>, Vector3<f64>)>, Isometry3<f64>) {
        let mut frame = Isometry3::identity();
        let lines = self
            .joints
            .iter()
            .map(|joint| {
                frame *= joint.pose;
                (frame.translation.vector, frame.rotation * joint.direction)
            })
            .collect();
        (lines, frame * self.end)
    }
}
