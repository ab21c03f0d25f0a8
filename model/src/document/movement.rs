//! `sweep` and `path` of a test: the motion of the axes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

use super::node::Named;
use super::value::{Length, Point, Positive};
use crate::session::motion::{FollowOffset, Traversals};

/// One axis moves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "sweep")]
#[schemars(deny_unknown_fields)]
pub struct Sweep {
    /// The axis that moves.
    pub axis: String,
    /// Start of the motion.
    pub from_mm: Option<f64>,
    /// Start of the motion.
    pub from_deg: Option<f64>,
    /// End of the motion.
    pub to_mm: Option<f64>,
    /// End of the motion.
    pub to_deg: Option<f64>,
    /// Step of a linear axis, mm.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_mm: Option<f64>,
    /// Step of a rotary axis, degrees.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_deg: Option<f64>,
    /// Feed along the path.
    pub feed_mm_min: Option<Positive>,
    /// Speed of a rotary axis.
    pub feed_deg_min: Option<Positive>,
    /// How often it is traversed.
    #[serde(rename = "$rest", default)]
    #[schemars(flatten)]
    pub traversals: Traversals,
}

/// Several axes move together.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename = "path", rename_all = "lowercase")]
#[schemars(tag = "kind", deny_unknown_fields)]
pub enum Path {
    /// The data file contains the states.
    List(List),
    /// Two linear axes move on a circle.
    Circle(Circle),
    /// Linear axes move on a line, such as a diagonal of their travels.
    Line(Line),
    /// A rotary axis turns and the linear axes keep the tool at the point of the table.
    Follow(Follow),
}

impl Serialize for Path {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        #[serde(tag = "kind", rename_all = "lowercase")]
        enum Tagged<'p> {
            List(&'p List),
            Circle(&'p Circle),
            Line(&'p Line),
            Follow(&'p Follow),
        }
        let tagged = match self {
            Path::List(list) => Tagged::List(list),
            Path::Circle(circle) => Tagged::Circle(circle),
            Path::Line(line) => Tagged::Line(line),
            Path::Follow(follow) => Tagged::Follow(follow),
        };
        tagged.serialize(serializer)
    }
}

/// The data file contains the states.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "list", deny_unknown_fields)]
#[schemars(inline)]
pub struct List {}

/// Two linear axes move on a circle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "circle")]
#[schemars(inline, deny_unknown_fields)]
pub struct Circle {
    /// The two linear axes, such as "XY".
    pub plane: String,
    /// The radius of the circle.
    pub radius_mm: Length,
    /// Centre relative to the workpiece ball, along the directions of R; default [0, 0, 0].
    pub centre_mm: Option<Point>,
    /// Start of the motion.
    pub from_deg: Option<f64>,
    /// End of the motion.
    pub to_deg: Option<f64>,
    /// Step along the circle, degrees.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_deg: f64,
    /// Feed along the path.
    pub feed_mm_min: Option<Positive>,
    /// How often it is traversed.
    #[serde(rename = "$rest", default)]
    #[schemars(flatten)]
    pub traversals: Traversals,
}

/// Linear axes move on a line, such as a diagonal of their travels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "line")]
#[schemars(inline, deny_unknown_fields)]
pub struct Line {
    /// Positions of the axes that move at the start: x_mm, y_mm.
    pub from: Named<Length>,
    /// Positions of the same axes at the end.
    pub to: Named<Length>,
    /// Step along the line, mm.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_mm: f64,
    /// Whether the axes of each step move one after the other, in the order of `from`, with a reading after each (step
    /// diagonal); default false.
    pub in_turn: Option<bool>,
    /// Feed along the path.
    pub feed_mm_min: Option<Positive>,
    /// How often it is traversed.
    #[serde(rename = "$rest", default)]
    #[schemars(flatten)]
    pub traversals: Traversals,
}

/// A rotary axis turns and the linear axes keep the tool at the point of the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "follow")]
#[schemars(inline, deny_unknown_fields)]
pub struct Follow {
    /// The rotary axis that moves.
    pub axis: String,
    /// Direction of a bar: "radial", "tangential" or "axial".
    pub offset: Option<FollowOffset>,
    /// Start of the motion.
    pub from_deg: Option<f64>,
    /// End of the motion.
    pub to_deg: Option<f64>,
    /// Step of the axis, degrees.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_deg: f64,
    /// Feed along the path.
    pub feed_mm_min: Option<Positive>,
    /// Speed of the axis.
    pub feed_deg_min: Option<Positive>,
    /// Programmed feed F of a control that treats a degree as a millimetre.
    pub programmed_feed_mm_min: Option<Positive>,
    /// How often it is traversed.
    #[serde(rename = "$rest", default)]
    #[schemars(flatten)]
    pub traversals: Traversals,
}
