//! Bodies of a machine: shapes that move with an axis, for checks of clearance. They take no part in the chain.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::document::value::{NotNegative, Positive};

/// A body of a machine. Its shape is in R with all axes at zero, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Its name: `table`, `spindle`.
    pub name: String,
    /// The axis that carries it, by index in the machine; `None` for the bed.
    pub axis: Option<usize>,
    /// Its shape.
    pub shape: BodyShape,
}

/// The shape of a body.
#[derive(Clone, Debug, PartialEq)]
pub enum BodyShape {
    /// All points within a radius of a line, mm.
    Capsule {
        /// The ends of the line.
        ends_mm: [[f64; 3]; 2],
        /// The radius.
        radius_mm: f64,
    },
    /// The box between two opposite corners, with faces across X, Y and Z, mm.
    Box {
        /// The least corner.
        low_mm: [f64; 3],
        /// The greatest corner.
        high_mm: [f64; 3],
    },
    /// A surface of triangles, mm. The corners of a triangle of a closed surface turn counterclockwise, seen from
    /// outside.
    Mesh {
        /// The corners of each triangle.
        triangles_mm: Vec<[[f64; 3]; 3]>,
        /// Whether every edge belongs to two triangles of opposite turn. Only a closed surface has an inside.
        is_closed: bool,
    },
}

/// Sizes of the ball bar for checks of clearance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "clearance", default, deny_unknown_fields)]
pub struct ClearanceSizes {
    /// Radius of the bar; default 10.
    pub bar_radius_mm: Positive,
    /// The stem below the workpiece ball, along -Z of the table frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub workpiece_holder: Option<Holder>,
    /// The stem above the spindle ball, along Z of the tool frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spindle_holder: Option<Holder>,
    /// Least clearance of a proposed test; less causes a warning. Default 5.
    pub least_mm: NotNegative,
}

/// A stem that holds a ball.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "holder", deny_unknown_fields)]
pub struct Holder {
    /// Radius of the stem.
    pub radius_mm: Positive,
    /// Its length from the centre of the ball.
    pub length_mm: Positive,
}

impl Default for ClearanceSizes {
    /// A bar of 10 mm radius, no holders, 5 mm of clearance.
    fn default() -> Self {
        ClearanceSizes {
            bar_radius_mm: Positive(10.0),
            workpiece_holder: None,
            spindle_holder: None,
            least_mm: NotNegative(5.0),
        }
    }
}
