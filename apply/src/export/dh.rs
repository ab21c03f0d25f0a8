//! Denavit–Hartenberg parameters of a calibrated chain of rotary axes.
//!
//! The modified form of Craig (Introduction to Robotics, 1989, ch. 3), with Hayati's angle β where consecutive axes are
//! nearly parallel (Hayati & Mirmirani, J. Robotic Systems 2 (1985) 397), in which the common normal is ill-defined:
//!
//! ```text
//! T = B · Π_k Tx(a_k)·Rx(α_k)·Ry(β_k)·Rz(θ_k + q_k)·Tz(d_k) · F
//! ```
//!
//! `β_k` is 0 unless axis `k` is nearly parallel to the one before; `Tx` and `Rx` commute, so that this is Craig's order
//! then. `B` is the pose of the first frame in R, `F` that of the tool frame in the last one.

use abbe_model::axis::AxisKind;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

use super::frames::{Branch, location_errors, roll_pitch_yaw, tool_side};
use crate::ApplyError;
use abbe_identify::model_file::IdentifiedModel;

/// Sine of the angle between two axes below which they count as parallel.
const PARALLEL: f64 = 0.02;

/// One joint: `Tx(a)·Rx(α)·Ry(β)·Rz(θ + q)·Tz(d)`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DhRow {
    /// The axis.
    pub axis: String,
    /// Length along X of the frame before, mm.
    pub a_mm: f64,
    /// Angle about X, degrees.
    pub alpha_deg: f64,
    /// Hayati's angle about Y, degrees; 0 unless the axis is nearly parallel to the one before.
    pub beta_deg: f64,
    /// Offset of the joint angle, degrees.
    pub theta_deg: f64,
    /// Length along the axis, mm.
    pub d_mm: f64,
}

/// A fixed pose: `Trans(x, y, z)·Rz(yaw)·Ry(pitch)·Rx(roll)`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct FixedPose {
    /// Position, mm.
    pub xyz_mm: [f64; 3],
    /// Roll, pitch and yaw, degrees.
    pub rpy_deg: [f64; 3],
}

/// The parameters of a chain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DhTable {
    /// The first frame in R.
    pub base: FixedPose,
    /// The joints.
    pub joints: Vec<DhRow>,
    /// The tool frame at the tool point in the last frame.
    pub tool: FixedPose,
}

/// The calibrated table of a model, and the nominal one, with the tool point in the tool frame, mm.
///
/// # Errors
/// If the chain has linear axes or axes on the workpiece side, or its error angles are small-angle matrices.
pub fn tables(model: &IdentifiedModel, tool_mm: [f64; 3]) -> Result<[DhTable; 2], ApplyError> {
    let machine = &model.machine;
    let rotary = machine.axes.iter().all(|axis| axis.kind == AxisKind::Rotary);
    if !rotary || machine.workpiece_side > 0 || machine.axes.is_empty() {
        return Err(ApplyError::Request(format!(
            "Denavit–Hartenberg parameters are those of a chain of rotary axes on the tool side; this machine is `{}`; \
             use URDF",
            machine.code()
        )));
    }
    let names: Vec<String> = machine.axes.iter().map(|axis| axis.name.clone()).collect();
    let nominal = vec![0.0; machine.error_slots()];
    let table =
        |errors: &[f64]| -> Result<DhTable, ApplyError> { Ok(table(&tool_side(machine, errors, tool_mm)?, &names)) };
    Ok([table(&location_errors(model))?, table(&nominal)?])
}

/// The frame on an axis: `z` along it, `x` along the normal to the next axis.
fn table(branch: &Branch, names: &[String]) -> DhTable {
    let (lines, end) = branch.at_zero();
    let count = lines.len();
    // The origin of each frame, and its X.
    let mut frames: Vec<(Vector3<f64>, Vector3<f64>)> = Vec::with_capacity(count);
    for k in 0..count {
        let (point, z) = lines[k];
        // Where the frame lies along its axis if nothing else decides: where the frame before meets it.
        let met = match (k, frames.last()) {
            (1.., Some((origin, _))) => meets(*origin, lines[k - 1].1, point, z),
            _ => point,
        };
        frames.push(match lines.get(k + 1) {
            None => (met, any_normal(&z)),
            Some((next, next_z)) => {
                let across = z.cross(next_z);
                if across.norm() >= PARALLEL {
                    (foot(point, z, *next, *next_z), across.normalize())
                } else {
                    let to = meets(met, z, *next, *next_z) - met;
                    let normal = to - z * z.dot(&to);
                    (met, normal.try_normalize(1e-9).unwrap_or_else(|| any_normal(&z)))
                }
            }
        });
    }
    let frame = |k: usize| pose(frames[k].0, frames[k].1, lines[k].1);
    // The first frame before its joint: the same axis, its own X.
    let base = frame(0);
    let mut joints = vec![DhRow { axis: names[0].clone(), ..DhRow::default() }];
    for k in 1..count {
        let before = frame(k - 1);
        let own = before.inverse() * frame(k);
        let z = own.rotation * Vector3::z();
        let (alpha, beta, meeting) = if lines[k - 1].1.cross(&lines[k].1).norm() >= PARALLEL {
            // The common normal lies on X of the frame before.
            ((-z.y).atan2(z.z), 0.0, foot_on_x(own.translation.vector, z))
        } else {
            let beta = z.x.clamp(-1.0, 1.0).asin();
            ((-z.y).atan2(z.z), beta, own.translation.vector - z * (own.translation.vector.z / z.z))
        };
        let turned = UnitQuaternion::from_scaled_axis(Vector3::x() * alpha)
            * UnitQuaternion::from_scaled_axis(Vector3::y() * beta);
        let x = turned.inverse() * (own.rotation * Vector3::x());
        joints.push(DhRow {
            axis: names[k].clone(),
            a_mm: meeting.x,
            alpha_deg: alpha.to_degrees(),
            beta_deg: beta.to_degrees(),
            theta_deg: x.y.atan2(x.x).to_degrees(),
            d_mm: (own.translation.vector - meeting).dot(&z),
        });
    }
    let tool = frame(count - 1).inverse() * end;
    DhTable { base: fixed(&base), joints, tool: fixed(&tool) }
}

/// The point of a line nearest to the X axis: origin and direction in the frame.
fn foot_on_x(point: Vector3<f64>, z: Vector3<f64>) -> Vector3<f64> {
    let across = z - Vector3::x() * z.x;
    let offset = point - Vector3::x() * point.x;
    let square = across.norm_squared();
    if square > 0.0 { point - z * (offset.dot(&across) / square) } else { point }
}

/// The point of a line in the plane through `origin` across `z`.
fn meets(origin: Vector3<f64>, z: Vector3<f64>, point: Vector3<f64>, direction: Vector3<f64>) -> Vector3<f64> {
    let along = direction.dot(&z);
    if along.abs() < PARALLEL {
        return point;
    }
    point + direction * ((origin - point).dot(&z) / along)
}

/// The foot of the common normal with the line `b + t·v` on the line `a + s·u`; the lines are not parallel.
fn foot(a: Vector3<f64>, u: Vector3<f64>, b: Vector3<f64>, v: Vector3<f64>) -> Vector3<f64> {
    let (between, cosine) = (b - a, u.dot(&v));
    a + u * ((between.dot(&u) - cosine * between.dot(&v)) / (1.0 - cosine * cosine))
}

/// A unit vector across `z`.
fn any_normal(z: &Vector3<f64>) -> Vector3<f64> {
    let least = if z.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    (least - z * z.dot(&least)).normalize()
}

fn pose(origin: Vector3<f64>, x: Vector3<f64>, z: Vector3<f64>) -> Isometry3<f64> {
    let z = z.normalize();
    let x = (x - z * z.dot(&x)).normalize();
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    Isometry3::from_parts(Translation3::from(origin), UnitQuaternion::from_rotation_matrix(&rotation))
}

fn fixed(pose: &Isometry3<f64>) -> FixedPose {
    FixedPose { xyz_mm: pose.translation.vector.into(), rpy_deg: roll_pitch_yaw(&pose.rotation).map(f64::to_degrees) }
}
