//! The tables of a machine: `machine.toml`, or `[machine]` of a session.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::node::Named;
use super::value::Vector;

/// machine.toml: the chain and its axes, nominal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "machine", deny_unknown_fields)]
pub struct Machine {
    /// Name of the machine in results; default: the chain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The axes from the workpiece over the bed b to the tool: "w C A b Y X Z t" or "[wCAbYXZt]".
    pub chain: String,
    /// Rotation convention of the error angles: Rx·Ry·Rz, or I + [θ]×.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation: Option<RotationWord>,
    /// Direction of gravity in R; default [0, 0, -1].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gravity: Option<Vector>,
    /// One table per axis of the chain.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub axis: Named<Axis>,
    /// What can collide: table, spindle, fixtures.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub body: Vec<Body>,
}

/// Rotation convention of the error angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum RotationWord {
    /// Rx·Ry·Rz.
    Exact,
    /// I + [θ]×.
    SmallAngle,
}

/// An axis of a machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "axis", deny_unknown_fields)]
pub struct Axis {
    /// Required if the name is not an ISO 841 letter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<KindWord>,
    /// Physical direction of the moving body for an increasing command, in R; default: that of the letter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<Vector>,
    /// A point on the line of a rotary axis, in R; default [0, 0, 0].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin_mm: Option<Vector>,
    /// Least and greatest position of a linear axis, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(equal = 2))]
    pub travel_mm: Option<Vec<f64>>,
    /// Least and greatest position of a rotary axis, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(equal = 2))]
    pub travel_deg: Option<Vec<f64>>,
}

/// The kind of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(inline)]
pub enum KindWord {
    /// It turns.
    Rotary,
    /// It moves along a line.
    Linear,
}

/// What can collide. It has one shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "body", deny_unknown_fields)]
#[schemars(extend("oneOf" = [{"required": ["box_mm"]}, {"required": ["capsule"]}, {"required": ["stl"]}]))]
pub struct Body {
    /// A name that no other body has.
    pub name: String,
    /// The axis that carries it; absent for the bed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<String>,
    /// Least and greatest corner, in R with all axes at zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(equal = 2))]
    pub box_mm: Option<Vec<Vector>>,
    /// All points within a radius of a line, in R with all axes at zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub capsule: Option<Capsule>,
    /// STL file of a surface in mm, binary or ASCII, in R with all axes at zero; relative to this file.
    #[serde(skip_serializing_if = "Option::is_none")]
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
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius_mm: f64,
}
