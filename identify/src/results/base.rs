//! Base parameters, as JSON has them.

use schemars::JsonSchema;
use serde::Serialize;

use super::Estimate;

/// A minimal set of numbers that predicts the same readings as all parameters together.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct BaseResult {
    /// The base parameters, each coefficient of a harmonic by itself.
    pub parameters: Vec<Estimate>,
    /// The parameters that are held at nominal.
    pub held_at_nominal: Vec<String>,
    /// Number of combinations that stay at nominal, since the readings determine them by less than their noise.
    pub combinations_at_nominal: usize,
    /// Largest change of a predicted reading against the fit, µm: rounding.
    pub prediction_change_um: f64,
}
