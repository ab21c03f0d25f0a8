//! Proposed tests, and ranges that suffice.

use schemars::JsonSchema;
use serde::Serialize;

use super::improve::Improvement;
use super::range::Shrinkage;
use abbe_identify::noise::ReadingNoise;
use abbe_identify::problem::Problem;

/// Proposed tests, and ranges that suffice.
#[derive(Serialize, JsonSchema)]
pub struct NextTest {
    /// The noise of a reading.
    #[serde(flatten)]
    pub noise: ReadingNoise,
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
        NextTest { noise: problem.reading_noise(), improvement, ranges }
    }
}
