//! `sweep` and `path` of a test: the motion of the axes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

use super::value::{Length, Point};

/// One axis moves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "sweep", deny_unknown_fields)]
pub struct Sweep {
    /// The axis that moves.
    pub axis: String,
    /// Start of the motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// Start of the motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// End of the motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<f64>,
    /// End of the motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_deg: Option<f64>,
    /// Step of a linear axis, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_mm: Option<f64>,
    /// Step of a rotary axis, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_deg: Option<f64>,
    /// Feed along the path.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub feed_mm_min: Option<f64>,
    /// Speed of a rotary axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub feed_deg_min: Option<f64>,
    /// Number of runs; default 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1))]
    pub runs: Option<u64>,
    /// Whether each run has a forward and a backward traversal; default true.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub both_directions: Option<bool>,
}

/// Several axes move together.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename = "path", rename_all = "lowercase")]
#[schemars(tag = "kind", deny_unknown_fields)]
pub enum Path {
    /// The data file contains the states.
    List,
    /// Two linear axes move on a circle.
    Circle(Circle),
    /// A rotary axis turns and the linear axes keep the tool at the point of the table.
    Follow(Follow),
}

impl Serialize for Path {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        #[serde(tag = "kind", rename_all = "lowercase")]
        enum Tagged<'p> {
            List,
            Circle(&'p Circle),
            Follow(&'p Follow),
        }
        let tagged = match self {
            Path::List => Tagged::List,
            Path::Circle(circle) => Tagged::Circle(circle),
            Path::Follow(follow) => Tagged::Follow(follow),
        };
        tagged.serialize(serializer)
    }
}

/// Two linear axes move on a circle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "circle", deny_unknown_fields)]
#[schemars(inline)]
pub struct Circle {
    /// The two linear axes, such as "XY".
    pub plane: String,
    /// The radius of the circle.
    pub radius_mm: Length,
    /// Centre relative to the workpiece ball, along the directions of R; default [0, 0, 0].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centre_mm: Option<Point>,
    /// Start of the motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// End of the motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_deg: Option<f64>,
    /// Step along the circle, degrees.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_deg: f64,
    /// Feed along the path.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub feed_mm_min: Option<f64>,
    /// Number of runs; default 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1))]
    pub runs: Option<u64>,
    /// Whether each run has a forward and a backward traversal; default true.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub both_directions: Option<bool>,
}

/// A rotary axis turns and the linear axes keep the tool at the point of the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "follow", deny_unknown_fields)]
#[schemars(inline)]
pub struct Follow {
    /// The rotary axis that moves.
    pub axis: String,
    /// Direction of a bar: "radial", "tangential" or "axial".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<Offset>,
    /// Start of the motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// End of the motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_deg: Option<f64>,
    /// Step of the axis, degrees.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_deg: f64,
    /// Feed along the path.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub feed_mm_min: Option<f64>,
    /// Speed of the axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub feed_deg_min: Option<f64>,
    /// Programmed feed F of a control that treats a degree as a millimetre.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub programmed_feed_mm_min: Option<f64>,
    /// Number of runs; default 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1))]
    pub runs: Option<u64>,
    /// Whether each run has a forward and a backward traversal; default true.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub both_directions: Option<bool>,
}

/// Direction of a bar whose ball follows a rotary axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(inline)]
pub enum Offset {
    /// Away from the axis.
    Radial,
    /// Along the path of the ball.
    Tangential,
    /// Along the axis.
    Axial,
}
