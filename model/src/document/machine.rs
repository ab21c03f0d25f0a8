//! The tables of a machine: `machine.toml`, or `[machine]` of a session.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::node::Named;
use super::value::{Positive, Vector};
use crate::axis::AxisKind;
use crate::frames::Rotation;

/// machine.toml: the chain and its axes, nominal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "machine", deny_unknown_fields)]
pub struct Machine {
    /// Name of the machine in results; default: the chain.
    pub name: Option<String>,
    /// The axes from the workpiece over the bed b to the tool: "w C A b Y X Z t" or "[wCAbYXZt]".
    pub chain: String,
    /// Rotation convention of the error angles: Rx·Ry·Rz, or I + [θ]×.
    pub rotation: Option<Rotation>,
    /// Direction of gravity in R; default [0, 0, -1].
    pub gravity: Option<Vector>,
    /// The flange of a robot in R with all axes at zero; results state there how a target is mounted.
    pub flange: Option<Flange>,
    /// One table per axis of the chain.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub axis: Named<Axis>,
    /// What can collide: table, spindle, fixtures.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub body: Vec<Body>,
}

/// The flange of a robot: its frame in R with all axes at zero.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "flange", deny_unknown_fields)]
pub struct Flange {
    /// Its origin, [x, y, z].
    pub xyz_mm: Vector,
    /// Roll, pitch, yaw about the fixed axes X, Y, Z in this order, degrees; default [0, 0, 0].
    pub rpy_deg: Option<Vector>,
}

/// An axis of a machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "axis", deny_unknown_fields)]
pub struct Axis {
    /// Required if the name is not an ISO 841 letter.
    pub kind: Option<AxisKind>,
    /// Physical direction of the moving body for an increasing command, in R; default: that of the letter.
    pub direction: Option<Vector>,
    /// A point on the line of a rotary axis, in R; default [0, 0, 0].
    pub origin_mm: Option<Vector>,
    /// Least and greatest position of a linear axis, mm.
    #[schemars(length(equal = 2))]
    pub travel_mm: Option<Vec<f64>>,
    /// Least and greatest position of a rotary axis, degrees.
    #[schemars(length(equal = 2))]
    pub travel_deg: Option<Vec<f64>>,
    /// Name of the joint in the robot's own file; `abbe import` knows columns by it.
    pub joint: Option<String>,
}

/// What can collide. It has one shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "body", deny_unknown_fields)]
#[schemars(extend("oneOf" = [{"required": ["box_mm"]}, {"required": ["capsule"]}, {"required": ["stl"]}]))]
pub struct Body {
    /// A name that no other body has.
    pub name: String,
    /// The axis that carries it; absent for the bed.
    pub axis: Option<String>,
    /// Least and greatest corner, in R with all axes at zero.
    #[schemars(length(equal = 2))]
    pub box_mm: Option<Vec<Vector>>,
    /// All points within a radius of a line, in R with all axes at zero.
    pub capsule: Option<Capsule>,
    /// STL file of a surface in mm, binary or ASCII, in R with all axes at zero; relative to this file.
    pub stl: Option<String>,
}

/// All points within a radius of a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "capsule", deny_unknown_fields)]
pub struct Capsule {
    /// An end of the line, [x, y, z].
    pub from_mm: Vector,
    /// The other end of the line, [x, y, z].
    pub to_mm: Vector,
    /// The radius.
    pub radius_mm: Positive,
}
