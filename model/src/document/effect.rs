//! `[[effect]]`: component × driver × shape, and its aliases `[[effect.alias]]`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::node::Entries;
use super::value::Positive;
use crate::unit::InternalUnit;

/// The keys of a stated standard deviation, with the internal unit of the component that has them.
pub const SCALES: [(&str, InternalUnit); 2] =
    [("scale_um", InternalUnit::Millimetre), ("scale_arcsec", InternalUnit::Radian)];

/// The word in `estimate` for the positions of a shape: the key of steps.
pub const POSITIONS: &str = "at";

/// Largest number of positions of an effect that a fit estimates. It tries each in dozens of gaps between readings.
pub const MAX_ESTIMATED_POSITIONS: usize = 40;

/// An effect that the user declares.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "effect")]
#[schemars(deny_unknown_fields)]
pub struct Effect {
    /// The component: EZC, EX0C, workpiece_ball.x, bar, trigger.
    pub component: String,
    /// The driver.
    pub driver: Option<String>,
    /// The dependence of the component on the driver, such as "harmonic".
    pub shape: String,
    /// The keys of the shape.
    #[serde(rename = "$rest", default)]
    #[schemars(skip)]
    pub keys: Entries,
    /// Prior standard deviation of the coefficients of an error of length, µm: the component where a basis function is 1.
    pub scale_um: Option<Positive>,
    /// Prior standard deviation of the coefficients of an angular error, arcseconds: the component where a basis function
    /// is 1.
    pub scale_arcsec: Option<Positive>,
    /// Effects of one family share a prior standard deviation, estimated from the readings.
    pub family: Option<String>,
    /// The tests in which it acts; default: all.
    pub tests: Option<Vec<String>>,
    /// Numbers of the shape that a fit estimates, from the values given here: "centre", "width", "period", "tau", or "at"
    /// for the positions of steps; default: none.
    pub estimate: Option<Vec<String>>,
    /// Whether the effect is taken for the explanation on the user's word, so that uncertainties do not cover its
    /// aliases; default: false.
    pub assumed: Option<bool>,
    /// Effects that explain the readings equally well in its place. Uncertainties cover what each would change.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alias: Vec<Effect>,
}
