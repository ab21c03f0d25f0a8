//! A serial chain of joints at its zero position.

use std::path::Path;

use abbe_model::axis::AxisKind;
use abbe_model::code::MAX_AXES;
use abbe_model::diagnostic::{Diagnostic, Location};
use nalgebra::{Isometry3, Vector3};

/// A movable joint, with all joints at zero.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Its name in the file.
    pub name: String,
    /// Whether it turns or moves.
    pub kind: AxisKind,
    /// The pose of its frame in the frame of the base, mm.
    pub pose: Isometry3<f64>,
    /// Its direction in its own frame, of length 1.
    pub direction: Vector3<f64>,
    /// Least and greatest position, mm or rad.
    pub travel: Option<[f64; 2]>,
}

/// A serial chain: its joints from the base, and the flange.
#[derive(Clone, Debug)]
pub struct Chain {
    /// The name of the robot.
    pub name: String,
    /// The base.
    pub base: String,
    /// The flange: the link or the frame at which the chain ends.
    pub flange: String,
    /// The joints.
    pub joints: Vec<Joint>,
    /// The pose of the flange in the frame of the base, mm.
    pub end: Isometry3<f64>,
    /// What the file left open, and how it was read.
    pub assumed: Vec<String>,
}

impl Chain {
    /// Refuses a chain with more joints than a machine has axes, before anything is made of it.
    pub(super) fn within_limit(self, file: &Path) -> Result<Chain, Diagnostic> {
        let joints = self.joints.len();
        if joints <= MAX_AXES {
            return Ok(self);
        }
        Err(Diagnostic::input(
            Location::file(file),
            format!("a chain of {joints} joints; the limit is {MAX_AXES} axes"),
            "name the file of one serial chain",
        ))
    }

    /// The axis of a joint in the frame of the base: a point of it in mm, and its direction.
    pub fn line(&self, joint: usize) -> (Vector3<f64>, Vector3<f64>) {
        let joint = &self.joints[joint];
        (joint.pose.translation.vector, joint.pose.rotation * joint.direction)
    }
}
