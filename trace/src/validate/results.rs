//! The result of a validation, as JSON has it.

use std::fmt;

use abbe_identify::noise::ReadingNoise;
use abbe_identify::results::{Estimate, ParameterChange};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The verdict on a saved model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ValidationVerdict {
    /// All readings are consistent with the model.
    Holds,
    /// Those inside the range of the model's data are.
    HoldsInRange,
    /// Neither, but the model is better than the location errors alone.
    Degraded,
    /// Neither, and the model is no better than those.
    DoesNotHold,
}

impl ValidationVerdict {
    /// The word in results.
    pub fn word(self) -> &'static str {
        match self {
            ValidationVerdict::Holds => "holds",
            ValidationVerdict::HoldsInRange => "holds-in-range",
            ValidationVerdict::Degraded => "degraded",
            ValidationVerdict::DoesNotHold => "does-not-hold",
        }
    }
}

impl fmt::Display for ValidationVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// A saved model against readings that it never saw.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ValidationResult {
    /// `holds`, `holds-in-range`, `degraded` or `does-not-hold`.
    pub verdict: ValidationVerdict,
    /// Number of readings without outliers.
    pub readings: usize,
    /// Number of them inside the range of the model's data.
    pub readings_in_range: usize,
    /// The axes and drivers whose range readings leave.
    pub outside: Vec<String>,
    /// Number of readings excluded as outliers.
    pub outliers: usize,
    /// The noise of a reading.
    #[serde(flatten)]
    pub noise: ReadingNoise,
    /// The machine without errors.
    pub nominal: RmsResult,
    /// Location errors as the model's readings give them without any effect.
    pub locations: RmsResult,
    /// The whole model.
    pub model: ValidatedModel,
    /// The model without each effect.
    pub without: Vec<WithoutResult>,
    /// Parameters that have changed, the most significant first; empty if `not_judged` is present.
    pub moved: Vec<MovedParameter>,
    /// Why no parameter is said to have moved: the model itself lacks an effect.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_judged: Option<ModelNotJudged>,
    /// The volumetric error of the model, and with what has moved, rms in µm over its axes' range; empty if nothing has
    /// moved.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub volumetric_rms_um: Vec<f64>,
    /// The estimated set-up of the session.
    pub set_up: Vec<Estimate>,
    /// Warnings in words.
    pub warnings: Vec<String>,
}

/// A model whose own estimates are not to be quoted, so that no change since is judged.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ModelNotJudged {
    /// The session from which it was identified.
    pub session: String,
    /// Whether it is the model of a trace.
    pub is_traced: bool,
    /// √(χ²/ν) of its fit.
    pub birge_ratio: f64,
    /// Why nothing can be decided from its estimates.
    pub why: String,
}

/// Root mean square of the residual.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RmsResult {
    /// Over scalar readings, µm.
    pub rms_um: f64,
    /// Length of the residual vector, µm, for instruments with three coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_3d_um: Option<f64>,
    /// `√(χ²/ν)` of the residual and of the set-up over its priors; 1 if noise alone remains.
    pub noise_ratio: f64,
}

/// A residual against its prediction.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct JudgedResidual {
    /// Residual.
    #[serde(flatten)]
    pub rms: RmsResult,
    /// Rms of the residual as noise and uncertainty of the model predict it, µm.
    pub predicted_rms_um: f64,
    /// `√(χ²/ν)` of the whitened residual: found over predicted.
    pub residual_ratio: f64,
    /// χ² of the residual with the predicted covariance.
    pub chi_square: f64,
    /// Degrees of freedom of χ².
    pub degrees_of_freedom: usize,
    /// Probability of a larger χ² if the model holds.
    pub p_value: f64,
    /// Share of scalar readings inside their 95 % prediction intervals.
    pub coverage_95: f64,
}

/// The whole model.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ValidatedModel {
    /// All readings.
    #[serde(flatten)]
    pub residual: JudgedResidual,
    /// The readings inside the range of the model's data; absent if all or none are inside.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub in_range: Option<JudgedResidual>,
}

/// The model without one effect.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct WithoutResult {
    /// The effect.
    pub effect: String,
    /// Residual.
    #[serde(flatten)]
    pub rms: RmsResult,
}

/// A parameter that has changed.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MovedParameter {
    /// Its change since the model.
    #[serde(flatten)]
    pub change: ParameterChange,
    /// Probability of such a change by chance in any parameter of an unchanged machine.
    pub p_value: f64,
    /// Parameters whose change explains these readings nearly as well (χ² larger by less than 4).
    pub alternatives: Vec<String>,
}

/// Whether a model holds.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ValidationStatement {
    /// The verdict.
    pub verdict: ValidationVerdict,
    /// Number of readings without outliers.
    pub readings: usize,
    /// Number of them inside the range of the model's data.
    pub readings_in_range: usize,
}
