//! Decisions of conformity, as JSON has them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::rule::Decision;
use crate::results::Interval;

/// The decision about a session, by the rule of ISO 14253-1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Conformity {
    /// `fail` if an item fails; else `undecided` if an item is undecided; else `pass`.
    pub verdict: Decision,
    /// Least probability with which `pass` and `fail` of an item are true.
    pub probability: f64,
    /// The decisions, in the order of the limits in the session.
    pub items: Vec<ConformityItem>,
}

/// The decision about one quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ConformityItem {
    /// The parameter, `EX0C`, or the figure with its test, `circular_deviation[XY]`.
    pub id: String,
    /// The measured value, in `unit`; absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// Its standard uncertainty, in `unit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub u: Option<f64>,
    /// Unit of all numbers: `um`, `arcsec`.
    pub unit: String,
    /// The lower limit, in `unit`; absent for a figure that is never negative.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lower: Option<f64>,
    /// The upper limit, in `unit`.
    pub upper: f64,
    /// The measured values that pass, in `unit`. Absent if none does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceptance_zone: Option<Interval>,
    /// A measured value beyond a limit by this much fails, in `unit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub guard_band: Option<f64>,
    /// Probability that the true value is within the limits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conformance_probability: Option<f64>,
    /// The decision.
    pub decision: Decision,
    /// Why it is undecided, in words; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
}
