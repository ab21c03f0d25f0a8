//! Contributors to the measurement uncertainty of figures of positioning (ISO/TR 230-9).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::document::value::NotNegative;

/// Contributors to the measurement uncertainty of the positioning figures of a laser or a sensor of angles. What is absent
/// is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "contributors", deny_unknown_fields)]
pub struct Contributors {
    /// Standard uncertainty of the calibrated laser, the part that no length changes.
    pub device_u_um: Option<NotNegative>,
    /// Standard uncertainty of the calibrated laser in proportion to the length, µm/m.
    pub device_u_um_m: Option<NotNegative>,
    /// Standard uncertainty of the calibrated sensor of angles.
    pub device_u_arcsec: Option<NotNegative>,
    /// Lateral deviation of the beam over the measured length, mm.
    pub misalignment_mm: Option<NotNegative>,
    /// Coefficient of thermal expansion by which readings refer to 20 °C, µm/(m·K).
    pub expansion_um_m_k: Option<NotNegative>,
    /// Its standard uncertainty.
    pub expansion_u_um_m_k: Option<NotNegative>,
    /// Deviation of the temperature from 20 °C, K.
    pub temperature_difference_k: Option<NotNegative>,
    /// Standard uncertainty of the measured temperature, K.
    pub temperature_u_k: Option<NotNegative>,
    /// Environmental variation: the range of the readings of a drift test as long as the test.
    pub environment_um: Option<NotNegative>,
    /// The same of a sensor of angles.
    pub environment_arcsec: Option<NotNegative>,
    /// Standard uncertainty of the repeated set-up.
    pub setup_u_um: Option<NotNegative>,
    /// The same of a sensor of angles.
    pub setup_u_arcsec: Option<NotNegative>,
}
