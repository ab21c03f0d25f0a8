//! `[tolerance]`: the limits of a session.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::node::{Entries, Named, Node};

/// Limits for decisions of conformity by the rule of ISO 14253-1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "tolerance", deny_unknown_fields)]
pub struct Tolerance {
    /// Least probability with which a pass or a fail is true; default 0.95.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.5, "exclusiveMaximum" = 1))]
    pub probability: Option<f64>,
    /// Limits of estimated errors and of parameters of effects: EX0C_um, EB0A_arcsec, EC0Y_um_m.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    #[schemars(with = "Named<Limit>", extend("propertyNames" = {"pattern": "_(um|mm|arcsec|deg|mrad|um_m)$"}))]
    pub errors: Entries,
    /// Limits of the figures of circular tests, by the name of the test.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub tests: Named<TestLimits>,
}

/// A number above 0 for both sides of zero, or the least and the largest permitted value.
#[derive(JsonSchema)]
#[schemars(rename = "limit", untagged)]
#[allow(dead_code, reason = "the schema alone uses it")]
enum Limit {
    Both(#[schemars(extend("exclusiveMinimum" = 0))] f64),
    Each(#[schemars(length(equal = 2))] Vec<f64>),
}

/// Limits of the figures of a circular test.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "test_limits", deny_unknown_fields)]
pub struct TestLimits {
    /// Standard uncertainty of the instrument besides the noise of its readings, µm.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0))]
    pub instrument_u_um: Option<f64>,
    /// Largest circular deviation G, in either direction.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub circular_deviation_um: Option<f64>,
    /// Largest bidirectional circular deviation G(b).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub bidirectional_circular_deviation_um: Option<f64>,
    /// Limits of the radial deviation F.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Limit")]
    pub radial_deviation_um: Option<Node>,
    /// Limits of the mean bidirectional radial deviation D.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Limit")]
    pub mean_bidirectional_radial_deviation_um: Option<Node>,
    /// Largest circular hysteresis H.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub hysteresis_um: Option<f64>,
    /// Largest synchronous error motion of a rotary axis, in either direction.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub synchronous_error_motion_um: Option<f64>,
    /// Largest asynchronous error motion of a rotary axis, in either direction.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub asynchronous_error_motion_um: Option<f64>,
}
