//! Held-out errors, by what is held out, as JSON has them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
