//! A fit by Monte Carlo, as JSON has it.

use schemars::JsonSchema;
use serde::Serialize;

use super::parameter::Interval;
use crate::monte_carlo::MonteCarlo;

/// A fit by Monte Carlo (JCGM 101).
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FitMonteCarlo {
    /// Runs, seed and coverage probability.
    #[serde(flatten)]
    pub draws: MonteCarlo,
    /// Number of runs whose fit did not converge. No figure includes them.
    pub unconverged_runs: u64,
    /// In the order of the fit's parameters.
    pub parameters: Vec<DrawnParameter>,
}

/// A parameter by both propagations, in `unit`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DrawnParameter {
    /// Identifier, as in the fit.
    pub id: String,
    /// Unit of every figure of this object: `um`, `arcsec`, …
    pub unit: String,
    /// Estimate of the fit.
    pub value: f64,
    /// Standard uncertainty of the estimate by the law of propagation of uncertainty (JCGM 100).
    pub gum_u: f64,
    /// Coverage interval that follows from `gum_u` with a Gaussian coverage factor.
    pub gum_interval: Interval,
    /// Mean over the runs.
    pub mean: f64,
    /// Standard deviation over the runs.
    pub u: f64,
    /// Probabilistically symmetric coverage interval over the runs.
    pub symmetric_interval: Interval,
    /// Shortest coverage interval over the runs.
    pub shortest_interval: Interval,
    /// Absolute differences of the endpoints of the symmetric interval and of `gum_interval`.
    pub endpoint_differences: Interval,
    /// Numerical tolerance of these differences (JCGM 101, 8.1), for one significant digit of `gum_u`.
    pub tolerance: f64,
    /// Standard uncertainty of such an endpoint, from the number of runs.
    pub endpoint_u: f64,
    /// `agree`, `differ`, or `undecided` where the runs are too few to decide.
    pub verdict: Verdict,
}

/// Whether GUM and Monte Carlo agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The differences lie within the tolerance. The figures of the GUM are quoted.
    Agree,
    /// A difference exceeds the tolerance. The figures of the Monte Carlo are quoted.
    Differ,
    /// The runs are too few to decide. The figures of the Monte Carlo are quoted.
    Undecided,
}
