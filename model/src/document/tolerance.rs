//! `[tolerance]`: the limits of a session.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::node::{Entries, Named, Node};
use super::value::{NotNegative, Positive};

/// Limits for decisions of conformity by the rule of ISO 14253-1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "tolerance", deny_unknown_fields)]
pub struct Tolerance {
    /// Least probability with which a pass or a fail is true; default 0.95.
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
    Both(Positive),
    Each(#[schemars(length(equal = 2))] Vec<f64>),
}

/// Limits of the figures of a circular test.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "test_limits", deny_unknown_fields)]
pub struct TestLimits {
    /// Standard uncertainty of the instrument besides the noise of its readings, µm.
    pub instrument_u_um: Option<NotNegative>,
    /// Largest circular deviation G, in either direction.
    pub circular_deviation_um: Option<Positive>,
    /// Largest bidirectional circular deviation G(b).
    pub bidirectional_circular_deviation_um: Option<Positive>,
    /// Limits of the radial deviation F.
    #[schemars(with = "Limit")]
    pub radial_deviation_um: Option<Node>,
    /// Limits of the mean bidirectional radial deviation D.
    #[schemars(with = "Limit")]
    pub mean_bidirectional_radial_deviation_um: Option<Node>,
    /// Largest circular hysteresis H.
    pub hysteresis_um: Option<Positive>,
    /// Largest synchronous error motion of a rotary axis, in either direction.
    pub synchronous_error_motion_um: Option<Positive>,
    /// Largest asynchronous error motion of a rotary axis, in either direction.
    pub asynchronous_error_motion_um: Option<Positive>,
}
