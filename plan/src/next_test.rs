//! Proposed tests, and ranges that suffice.

use schemars::JsonSchema;
use serde::Serialize;

use super::improve::Improvement;
use super::range::Shrinkage;
use abbe_identify::noise::NoiseSource;
use abbe_identify::problem::Problem;

/// Proposed tests, and ranges that suffice.
#[derive(Serialize, JsonSchema)]
pub struct NextTest {
    /// Standard deviation of one scalar reading, µm.
    pub noise_um: f64,
    /// Source of `noise_um`: `stated` by session or user, `repeats` or `residual` of its readings, or `assumed`.
    pub noise_source: NoiseSource,
    /// The proposed tests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub improvement: Option<Improvement>,
    /// The smallest ranges of sweeps.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ranges: Vec<Shrinkage>,
}

impl NextTest {
    /// Of a plan.
    pub fn new(problem: &Problem, improvement: Option<Improvement>, ranges: Vec<Shrinkage>) -> NextTest {
        let noise = &problem.noise;
        NextTest { noise_um: noise.sigma_mm * 1e3, noise_source: noise.source, improvement, ranges }
    }
}
