//! `[[target]]` and `[[channel]]`: a measurement that a session composes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::value::{Direction, Length, Point, Uncertainties, Uncertainty};

/// A target of a composed measurement: a point, a direction or a length. A test may state another place of it as `NAME_mm`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "target", deny_unknown_fields)]
pub struct Target {
    /// A name that no other target has: letters, digits and `_`.
    pub name: String,
    /// The body on which it is fixed: "table", "tool", "bed", or "axis A" for what an axis carries. A length without one is the
    /// same in all tests.
    pub frame: Option<String>,
    /// A point in that frame.
    pub point_mm: Option<Point>,
    /// Its standard uncertainty.
    pub point_u_um: Option<Uncertainties>,
    /// A direction in that frame, such as [0, 0, 1].
    pub direction: Option<Direction>,
    /// Its standard uncertainty about the two directions across it, arcsec.
    pub direction_u_arcsec: Option<Uncertainty>,
    /// A length.
    pub length_mm: Option<Length>,
    /// Its standard uncertainty.
    pub length_u_um: Option<Uncertainty>,
}

/// A channel of a composed measurement: one scalar of its targets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "channel", deny_unknown_fields)]
pub struct Channel {
    /// A name that no other channel has: letters, digits and `_`.
    pub name: String,
    /// The distance of two points: ["stylus", "sphere"].
    pub distance: Option<Vec<String>>,
    /// The first point less the second along a direction: ["stylus", "sphere", "normal"].
    pub along: Option<Vec<String>>,
    /// The rotation of a body against another about a direction, in addition to the commanded one: ["tool", "table",
    /// "normal"].
    pub rotation: Option<Vec<String>>,
    /// Lengths that are subtracted.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub less: Vec<String>,
    /// 0 for a contact: the positions of the axes are all that is read.
    pub reading: Option<f64>,
    /// The column of the data with its unit, such as "length_mm".
    pub column: Option<String>,
    /// Standard uncertainty of the zero of a length, µm; inf: no prior.
    pub zero_u_um: Option<Uncertainty>,
    /// Standard uncertainty of the zero of an angle, arcsec; inf: no prior.
    pub zero_u_arcsec: Option<Uncertainty>,
}
