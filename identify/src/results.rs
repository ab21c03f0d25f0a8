//! What is reported, as it stands in JSON. Units stand in the names, or beside the value.

use std::collections::BTreeMap;

use serde::Serialize;

/// A value with its standard uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterResult {
    /// `EY0A`, `bar[A100]`, `EZC~C:h2.amplitude`.
    pub id: String,
    /// The value, in `unit`.
    pub value: f64,
    /// One standard uncertainty, in `unit`.
    pub u: f64,
    /// `um`, `arcsec`, …
    pub unit: String,
}

/// A combination of unknowns that no reading can see.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unobservable {
    /// How much of each unknown, in its outside unit: moving all of them by these amounts changes no reading.
    pub combination: BTreeMap<String, f64>,
    /// In words.
    pub why: String,
}

/// A reading that was left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rejected {
    /// The test.
    pub test: String,
    /// The data file.
    pub file: String,
    /// The line in it.
    pub line: usize,
    /// The length of its residual, µm.
    pub residual_um: f64,
}

/// What `abbe fit` reports.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitResult {
    /// Standard deviation of one scalar reading, µm.
    pub noise_um: f64,
    /// Where that figure comes from: `stated`, `repeats` or `fit`.
    pub noise_source: String,
    /// Number of readings that count.
    pub readings: usize,
    /// Residual over scalar readings, µm.
    pub rms_um: f64,
    /// The same on readings that the fit did not see.
    pub heldout_rms_um: f64,
    /// Length of the residual vector, µm, for instruments with three coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_3d_um: Option<f64>,
    /// The same on readings that the fit did not see.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heldout_rms_3d_um: Option<f64>,
    /// What is left out at a time for the held-out figures.
    pub heldout_by: String,
    /// How many independent combinations of the unknowns the readings see, of how many unknowns.
    pub rank: usize,
    /// Number of unknowns.
    pub unknowns: usize,
    /// By how much the uncertainties are enlarged because the residual exceeds the noise; 1 where it does not.
    pub birge_ratio: f64,
    /// What was identified.
    pub parameters: Vec<ParameterResult>,
    /// What cannot be.
    pub unobservable: Vec<Unobservable>,
    /// Readings left out.
    pub rejected: Vec<Rejected>,
    /// What a user should know.
    pub warnings: Vec<String>,
}
