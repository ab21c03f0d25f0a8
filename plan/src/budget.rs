//! The uncertainty budget of each error.
//!
//! The least-squares estimator is `β̂ = Cov·(JᵀV⁻¹y + Σ e_s m_s/u_s²)`, with `y` the readings and `m_s` the prior value
//! of set-up quantity `s`. The law of propagation (JCGM 100, 5.1.2) divides the covariance without remainder:
//!
//! ```text
//! Cov = Cov·JᵀV⁻¹J·Cov  +  Σ_s (Cov e_s)(Cov e_s)ᵀ/u_s²
//!       noise               set-up quantity s
//! ```
//!
//! Other errors contribute no variance of their own. They contribute through correlation. If error `j` were known, the
//! variance of error `i` would decrease by the share `ρ_ij²`. If all other errors were known, it would be the
//! reciprocal of `i`'s diagonal entry in the information on the errors.

use faer::Mat;

use super::results::{Contribution, CorrelatedWith};
use abbe_identify::linear::{Linearisation, is_of_interest, prior_u};
use abbe_identify::numerics::ranking::largest_first;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;

/// Shares of the variance below this value are not listed.
const MIN_SHARE: f64 = 1e-4;
/// Correlations below this value are not listed.
const MIN_CORRELATION: f64 = 0.1;

/// The contributions to an error's uncertainty, largest first.
pub fn budget(problem: &Problem, linear: &Linearisation, error: usize) -> Vec<Contribution> {
    let list = &problem.parameters.list;
    let covariance = &linear.covariance;
    let variance = covariance[(error, error)];
    let scale = list[error].unit.display_per_internal;
    let mut parts = Vec::new();
    for (s, parameter) in list.iter().enumerate() {
        let Some(u) = prior_u(parameter) else { continue };
        let part = (covariance[(error, s)] / u).powi(2);
        parts.push(Contribution { source: parameter.id.to_string(), u: part.sqrt() * scale, share: part / variance });
    }
    let noise = noise_variance(linear, error);
    parts.push(Contribution {
        source: Contribution::NOISE.to_string(),
        u: noise.sqrt() * scale,
        share: noise / variance,
    });
    parts.retain(|part| part.share >= MIN_SHARE || part.is_noise());
    parts.sort_by(|a, b| largest_first((a.share, &a.source), (b.share, &b.source)));
    parts
}

/// `‖R·Cov·e‖²`, with `R` the triangular factor of the readings alone.
fn noise_variance(linear: &Linearisation, error: usize) -> f64 {
    let r = linear.readings.r();
    let n = r.ncols();
    (0..n).map(|i| (i..n).map(|j| r[(i, j)] * linear.covariance[(j, error)]).sum::<f64>().powi(2)).sum()
}

/// The errors that are correlated with an error, the most correlated first.
pub fn correlated_with(problem: &Problem, linear: &Linearisation, error: usize) -> Vec<CorrelatedWith> {
    let mut shared: Vec<CorrelatedWith> = problem
        .parameters
        .list
        .iter()
        .enumerate()
        .filter(|(other, parameter)| {
            *other != error && is_of_interest(parameter) && linear.rank.is_identifiable(*other)
        })
        .map(|(other, parameter)| CorrelatedWith {
            id: parameter.id.to_string(),
            correlation: correlation(&linear.covariance, error, other),
        })
        .filter(|shared| shared.correlation.abs() >= MIN_CORRELATION)
        .collect();
    shared.sort_by(|a, b| largest_first((a.correlation, &a.id), (b.correlation, &b.id)));
    shared
}

/// Correlation of two parameters.
pub fn correlation(covariance: &Mat<f64>, i: usize, j: usize) -> f64 {
    let product = covariance[(i, i)] * covariance[(j, j)];
    if product > 0.0 { covariance[(i, j)] / product.sqrt() } else { 0.0 }
}

/// The conditional standard uncertainty of each error: all other errors of the list known, internal units.
///
/// # Errors
/// If the decomposition fails.
pub fn conditional_u(linear: &Linearisation, of_interest: &[usize]) -> Result<Vec<f64>, Diagnostic> {
    let r = linear.marginal(of_interest)?;
    Ok((0..of_interest.len()).map(|j| 1.0 / (0..=j).map(|i| r[(i, j)].powi(2)).sum::<f64>().sqrt()).collect())
}
