//! What a model and the statements about it are, as JSON has them. Units stand in the names, or beside the value.

mod outcome;
mod parameter;
mod statements;

pub use outcome::{
    Assumption, AssumptionKind, AssumptionVerdict, DataRange, DeterminedByPrior, Goodness, GoodnessVerdict,
    NotEstimated, NotJudged, Outcome, TraceVerdict,
};
pub(crate) use parameter::{COVERAGE_FACTOR, phases_follow_amplitudes};
pub use parameter::{
    Combination, Covariance, DeterminedBy, EnlargedBy, Estimate, Finding, Interval, MeasuredValue, NullSpace,
    ParameterChange, Unobservable,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
pub use statements::{AxisCorrection, GoodStatement, LineQuantity, MeasureStatement, NextStep, Statements};

use crate::noise::ReadingNoise;

/// A reading that was excluded as an outlier.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Outlier {
    /// The test.
    pub test: String,
    /// The data file.
    pub file: String,
    /// The line in the data file.
    pub line: usize,
    /// Length of its residual, µm.
    pub residual_um: f64,
    /// Whether a run begins with it where an axis reverses: the lost motion there follows from the motion before the run,
    /// which is not known. It is no fault.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub first_at_reversal: bool,
}

/// Figures of the angles of a session of lengths and angles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OfAngles {
    /// Standard deviation of one angle, arcsec.
    pub noise_arcsec: f64,
    /// Rms of the residual over angles, arcsec.
    pub rms_arcsec: f64,
    /// Rms of the residual over held-out angles, arcsec.
    pub heldout_rms_arcsec: f64,
}

/// How well a model describes its readings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ModelFit {
    /// Number of readings without outliers.
    pub readings: usize,
    /// Rms of the residual over scalar readings, µm.
    pub rms_um: f64,
    /// Rms of the residual over held-out scalar readings (cross-validation), µm. `heldout_by` states what is held out.
    pub heldout_rms_um: f64,
    /// Factor by which the uncertainties are enlarged: the Birge ratio where it is significantly above 1 (p < 0.001),
    /// else 1.
    pub u_enlargement: f64,
}

/// A model of the readings: its estimates with their uncertainties, its residual, its held-out error, and what it does not
/// determine. A fit is one; a trace has one before and one with the effects that it found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ModelResult {
    /// The noise of a reading.
    #[serde(flatten)]
    pub noise: ReadingNoise,
    /// Autoregressive coefficients of the noise along a run; empty for white noise.
    pub noise_ar_coefficients: Vec<f64>,
    /// How well it describes its readings.
    #[serde(flatten)]
    pub fit: ModelFit,
    /// Rms length of the residual vector, µm, for instruments with three coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_3d_um: Option<f64>,
    /// Rms length of the residual vector over held-out readings, µm, for instruments with three coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heldout_rms_3d_um: Option<f64>,
    /// The same of the angles, if readings are lengths and angles; the figures in µm are then those of the lengths.
    #[serde(flatten)]
    pub of_angles: Option<OfAngles>,
    /// What each fold of the cross-validation holds out.
    pub heldout_by: String,
    /// Held-out errors by what is held out.
    #[serde(flatten)]
    pub cross_validation: CrossValidation,
    /// Number of independent combinations of the parameters that are identifiable.
    pub rank: usize,
    /// Number of parameters, set-up parameters included.
    pub parameter_count: usize,
    /// χ² of the fit, priors counted as observations.
    pub chi_square: f64,
    /// Degrees of freedom of χ²: scalar readings plus priors, less rank and estimated positions of steps.
    pub degrees_of_freedom: usize,
    /// The Birge ratio `√(χ²/ν)`. Below 1 where readings scatter less than `noise_um`.
    pub birge_ratio: f64,
    /// What the result is worth: the residual against the noise, what determines the estimates, what is assumed.
    pub outcome: Outcome,
    /// The identifiable parameters.
    pub parameters: Vec<Estimate>,
    /// Identifiers of all identifiable parameters, set-up parameters included.
    pub identifiable: Vec<String>,
    /// Covariance of `parameters`.
    pub covariance: Covariance,
    /// The null-space directions in words.
    pub unobservable: Vec<Unobservable>,
    /// The null space as a matrix.
    pub null_space: NullSpace,
    /// Readings excluded as outliers.
    pub outliers: Vec<Outlier>,
}

/// Held-out errors of a model, by what is held out. Absent where the readings or the tests do not permit it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CrossValidation {
    /// For poses: rms of the residual over held-out random poses, µm: interpolation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interpolation_rms_um: Option<f64>,
    /// For poses: rms length of the residual vector over held-out random poses, µm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interpolation_rms_3d_um: Option<f64>,
    /// For poses: rms of the residual over held-out blocks of joint space, µm: `heldout_rms_um`. It decides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extrapolation_rms_um: Option<f64>,
    /// For poses: rms length of the residual vector over held-out blocks of joint space, µm: `heldout_rms_3d_um`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extrapolation_rms_3d_um: Option<f64>,
    /// For runs: rms of the residual over left-out runs, µm: `heldout_rms_um`. It decides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left_out_run_rms_um: Option<f64>,
    /// For runs: rms length of the residual vector over left-out runs, µm, for instruments with three coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left_out_run_rms_3d_um: Option<f64>,
    /// Rms of the residual of `left_out_tests`, µm: each is predicted by the model of the others; its own set-up alone
    /// is estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left_out_test_rms_um: Option<f64>,
    /// Rms length of the residual vector of `left_out_tests`, µm, for instruments with three coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left_out_test_rms_3d_um: Option<f64>,
    /// The tests that the other tests predict.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out_tests: Vec<String>,
    /// The tests that need parameters that the other tests do not identify.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tests_not_left_out: Vec<TestNotLeftOut>,
}

/// A test that the other tests do not predict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TestNotLeftOut {
    /// The test.
    pub test: String,
    /// The parameters of the least identified direction that the test needs, the largest share first.
    pub parameters: Vec<String>,
}
