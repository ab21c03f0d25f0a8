//! Terms of a pointing model, as JSON has them.

use schemars::JsonSchema;
use serde::Serialize;

/// The fit as terms of TPOINT.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PointingTerms {
    /// Number of stars without outliers.
    pub stars: usize,
    /// Rms of the residual on the sky: of the length of across and up, arcsec.
    pub sky_rms_arcsec: f64,
    /// The same with n − p in place of n, p the number of identifiable parameters, arcsec; `null` for n ≤ p.
    pub population_sd_arcsec: Option<f64>,
    /// The terms.
    pub terms: Vec<PointingTerm>,
    /// Parameters that are no term: their effect on the readings is that of none.
    pub without_term: Vec<String>,
}

/// A term of TPOINT.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PointingTerm {
    /// Its name: IA, CA, HASA2.
    pub term: String,
    /// Its value, arcsec; `null` if the readings do not separate it from others.
    pub value_arcsec: Option<f64>,
    /// Its standard uncertainty, arcsec.
    pub u_arcsec: Option<f64>,
    /// The sigma that TPOINT prints, arcsec: it takes the sky rms for the standard deviation of each coordinate, and
    /// does not count degrees of freedom.
    pub sigma_arcsec: Option<f64>,
    /// The parameters of which it consists.
    pub parameters: Vec<String>,
}
