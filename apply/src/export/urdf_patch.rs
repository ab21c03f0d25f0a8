//! The calibrated origins in the URDF file of a robot: everything else stays as it is, to the byte.
//!
//! The frame of joint `k` at zero is `N_k` in the file and `C_k = M_k·N_k` in the calibrated chain, where
//! `M_k = Π Trans(o_j)·E0_j·Trans(−o_j)` displaces the body that the joint moves. With the fixed joints `F` between them, the
//! new origin is `F⁻¹·C_{k−1}⁻¹·C_k`. A prismatic joint is turned onto its tilted direction; the next joint turns back.

use abbe_files::Source;
use abbe_files::robot::chain::Chain;
use abbe_files::robot::urdf::{self, UrdfJoint};
use abbe_identify::error;
use abbe_identify::model_file::IdentifiedModel;
use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::frames::roll_pitch_yaw;
use abbe_model::unit::Unit;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::entries::best_locations;
use super::frames::{JointFrame, tool_side};

/// Largest distance between an axis of the file and of the model's machine, mm; and of their directions.
const SAME_MM: f64 = 1e-3;
const SAME_DIRECTION: f64 = 1e-6;
/// Change of an origin below which its text stays, mm and rad.
const UNCHANGED: f64 = 1e-12;

/// The text of a URDF file with the origins of a model.
///
/// # Errors
/// If the file is no URDF, or its chain is not that of the model's machine.
pub fn patched(model: &IdentifiedModel, source: &Source, tip: Option<&str>) -> Result<String, Diagnostic> {
    let file = urdf::read(source)?;
    let (path, _) = file.path(&source.file, tip)?;
    let chain = file.chain(&source.file, tip)?;
    refuse_another(model, &chain)?;
    let branch = tool_side(&model.machine, &best_locations(model, model.tool_mm)?.0, [0.0; 3])?;
    let mut text = source.text.clone();
    let mut changes: Vec<(&UrdfJoint, Isometry3<f64>)> = Vec::new();
    let mut before = Isometry3::identity();
    let mut fixed = Isometry3::identity();
    let mut displaced = Isometry3::identity();
    // What a prismatic joint is turned by, which the next joint of any kind undoes.
    let mut turned = Isometry3::identity();
    let mut number = 0;
    for joint in path {
        if !joint.moves() {
            if turned != Isometry3::identity() && number == branch.joints.len() {
                changes.push((joint, turned.inverse() * joint.origin));
                turned = Isometry3::identity();
            }
            fixed *= joint.origin;
            continue;
        }
        let (own, nominal) = (&branch.joints[number], &chain.joints[number]);
        displaced *= own.pose;
        let origin = Vector3::from(model.machine.axes[own.axis].origin_mm);
        let body = displaced * Translation3::from(-origin);
        let frame = body * nominal.pose;
        turned = tilt(own, nominal.kind, &nominal.pose, &nominal.direction);
        let calibrated = frame * turned;
        changes.push((joint, (before * fixed).inverse() * calibrated));
        (before, fixed) = (calibrated, Isometry3::identity());
        number += 1;
    }
    // From the back, so that the places of the others stay.
    changes.sort_by_key(|(joint, _)| std::cmp::Reverse(joint.after_start));
    for (joint, origin) in changes {
        let change = joint.origin.inverse() * origin;
        if change.translation.vector.norm() < UNCHANGED && change.rotation.angle() < UNCHANGED {
            continue;
        }
        write(&mut text, joint, &origin);
    }
    Ok(text)
}

/// The turn of a prismatic joint in its own frame onto its tilted direction.
fn tilt(own: &JointFrame, kind: AxisKind, pose: &Isometry3<f64>, direction: &Vector3<f64>) -> Isometry3<f64> {
    if kind == AxisKind::Rotary {
        return Isometry3::identity();
    }
    let there = pose.rotation.inverse() * own.direction.normalize();
    let turn = UnitQuaternion::rotation_between(direction, &there).unwrap_or_else(UnitQuaternion::identity);
    Isometry3::from_parts(Translation3::identity(), turn)
}

/// Refuses a file whose chain is not the machine of the model.
fn refuse_another(model: &IdentifiedModel, chain: &Chain) -> Result<(), Diagnostic> {
    let machine = &model.machine;
    let refused = |difference: String| {
        let (one, other) = ("the model".to_string(), "the robot in the file".to_string());
        Err(error::unlike(one, "of", other, difference))
    };
    if machine.workpiece_side > 0 || machine.axes.len() != chain.joints.len() {
        return refused(format!(
            "its machine is `{}`, and the chain has {} joints",
            machine.code(),
            chain.joints.len()
        ));
    }
    for (number, (axis, joint)) in machine.axes.iter().zip(&chain.joints).enumerate() {
        let (point, direction) = chain.line(number);
        let off = Vector3::from(axis.origin_mm) - point;
        let across = off - direction * off.dot(&direction);
        let is_beside = axis.kind == AxisKind::Rotary && across.norm() > SAME_MM;
        let is_turned = (Vector3::from(axis.direction) - direction).norm() > SAME_DIRECTION;
        if axis.kind != joint.kind || is_beside || is_turned {
            return refused(format!("its axis {} is not joint `{}`", axis.name, joint.name));
        }
    }
    Ok(())
}

/// Writes the origin of a joint in the place of the old one.
fn write(text: &mut String, joint: &UrdfJoint, origin: &Isometry3<f64>) {
    let [x, y, z]: [f64; 3] = (origin.translation.vector * Unit::Metre.per_internal()).into();
    let [roll, pitch, yaw] = roll_pitch_yaw(&origin.rotation);
    let (xyz, rpy) = (format!("xyz=\"{x:?} {y:?} {z:?}\""), format!("rpy=\"{roll:?} {pitch:?} {yaw:?}\""));
    match &joint.origin_bytes {
        Some(bytes) => {
            let old = &text[bytes.clone()];
            let rpy_is_first = matches!((old.find("rpy"), old.find("xyz")), (Some(rpy), Some(xyz)) if rpy < xyz);
            let [first, second] = if rpy_is_first { [rpy, xyz] } else { [xyz, rpy] };
            let end = if old.ends_with("/>") { "/>" } else { ">" };
            text.replace_range(bytes.clone(), &format!("<origin {first} {second}{end}"));
        }
        None => text.insert_str(joint.after_start, &format!("<origin {xyz} {rpy}/>")),
    }
}
