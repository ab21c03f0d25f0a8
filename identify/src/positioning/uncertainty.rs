//! The expanded uncertainty of positioning figures, k = 2, from stated contributors (ISO/TR 230-9:2005, GUM).
//!
//! Over the measured length `L`, with the standard uncertainties of the contributors:
//!
//! ```text
//! u_L² = u_device² + u_misalignment² + (α L u(θ))² + (Δθ L u(α))² + u_setup²        u_misalignment = d²/(2L) / (2√3)
//! u_environment = range / (2√3)
//! ```
//!
//! A beam that deviates laterally by `d` reads too short by `d²/(2L)` at most; that and the range of the drift test are
//! rectangular distributions. The environment changes every reading by an independent error; a figure `F` has the variance
//! `c_F` per variance of it ([`super::figures`]). What grows with the length cancels in figures of one position:
//!
//! ```text
//! U(E), U(M), U(A) = 2 √(u_L² + c_F u_environment²)          U(R), U(B) = 2 √(c_F u_environment²)
//! ```
//!
//! With five runs `U(R↑) = 2 U_environment`.

use abbe_model::session::Contributors;
use schemars::JsonSchema;
use serde::Serialize;

/// The coverage factor.
pub const COVERAGE: f64 = 2.0;

/// Expanded uncertainties of positioning figures by each contributor, in the unit of the figures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Contributions {
    /// The coverage factor k = 2.
    pub coverage_factor: f64,
    /// Expanded uncertainty of the device over the measured length.
    pub device: f64,
    /// That of the misalignment of the beam.
    pub misalignment: f64,
    /// That of the measured temperature, by the expansion.
    pub temperature: f64,
    /// That of the coefficient of expansion, by the deviation from 20 °C.
    pub expansion: f64,
    /// That of one reading by the variation of the environment.
    pub environment: f64,
    /// That of the set-up.
    pub setup: f64,
}

/// What gives the uncertainty of a figure.
#[derive(Clone, Copy)]
pub(super) struct OfReadings {
    /// Variance of what grows with the measured length.
    over_length: f64,
    /// Standard uncertainty of one reading by the environment.
    environment: f64,
}

impl OfReadings {
    /// The standard uncertainty of a figure with this variance per variance of an independent error of every reading.
    pub fn u(self, share: f64, compares_positions: bool) -> f64 {
        let over_length = if compares_positions { self.over_length } else { 0.0 };
        (over_length + share * self.environment * self.environment).sqrt()
    }
}

/// The contributions over a length in mm, or of an axis of rotation, and what they give for a figure.
pub(super) fn contributions(of: &Contributors, length_mm: Option<f64>) -> (Contributions, OfReadings) {
    let stated = |value: Option<abbe_model::document::value::NotNegative>| value.map_or(0.0, |value| value.0);
    let metres = length_mm.unwrap_or(0.0) / 1e3;
    let is_length = length_mm.is_some();
    let choose = |um, arcsec| stated(if is_length { um } else { arcsec });
    let device = choose(of.device_u_um, of.device_u_arcsec).hypot(stated(of.device_u_um_m) * metres);
    let rectangular = |range: f64| range / 12.0_f64.sqrt();
    let misalignment = match length_mm {
        Some(length) if length > 0.0 => rectangular(stated(of.misalignment_mm).powi(2) / (2.0 * length) * 1e3),
        _ => 0.0,
    };
    let temperature = stated(of.expansion_um_m_k) * metres * stated(of.temperature_u_k);
    let expansion = stated(of.temperature_difference_k) * metres * stated(of.expansion_u_um_m_k);
    let environment = rectangular(choose(of.environment_um, of.environment_arcsec));
    let setup = choose(of.setup_u_um, of.setup_u_arcsec);
    let over_length = [device, misalignment, temperature, expansion, setup].iter().map(|u| u * u).sum::<f64>();
    let contributions = Contributions {
        coverage_factor: COVERAGE,
        device: COVERAGE * device,
        misalignment: COVERAGE * misalignment,
        temperature: COVERAGE * temperature,
        expansion: COVERAGE * expansion,
        environment: COVERAGE * environment,
        setup: COVERAGE * setup,
    };
    (contributions, OfReadings { over_length, environment })
}
