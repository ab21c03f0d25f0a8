//! Where an uncertainty comes from.
//!
//! With the least-squares estimator `β̂ = Cov·(JᵀV⁻¹y + Σ e_s m_s/u_s²)` — `y` the readings, `m_s` what is known beforehand of set-up quantity `s` —
//! the law of propagation (JCGM 100, 5.1.2) splits the covariance without remainder:
//!
//! ```text
//! Cov = Cov·JᵀV⁻¹J·Cov  +  Σ_s (Cov e_s)(Cov e_s)ᵀ/u_s²
//!       noise               set-up quantity s
//! ```
//!
//! Other errors have no spread of their own. What they cost is correlation: if error `j` were known, the variance of error `i` would fall by
//! the share `ρ_ij²`; if all others were, to the reciprocal of `i`'s own entry in the information on the errors.

use faer::Mat;

use super::linear::{Linearisation, is_wanted, marginal, prior_u};
use super::ranking::largest_first;
use super::results::{Contribution, CorrelatedWith};
use crate::error::IdentifyError;
use crate::problem::Problem;

/// Shares of the variance below this are not listed.
const MIN_SHARE: f64 = 1e-4;
/// Correlations below this are not listed.
const MIN_CORRELATION: f64 = 0.1;

/// The parts of an error's uncertainty, the largest first.
pub fn budget(problem: &Problem<'_>, linear: &Linearisation, error: usize) -> Vec<Contribution> {
    let list = &problem.parameters.list;
    let covariance = &linear.covariance;
    let variance = covariance[(error, error)];
    let scale = list[error].unit.display_per_internal;
    let mut parts = Vec::new();
    for (s, parameter) in list.iter().enumerate() {
        let Some(u) = prior_u(parameter) else { continue };
        let part = (covariance[(error, s)] / u).powi(2);
        parts.push(Contribution {
            source: parameter.id.clone(),
            u: part.sqrt() * scale,
            share: part / variance,
        });
    }
    let noise = noise_variance(linear, error);
    parts.push(Contribution {
        source: "noise".to_string(),
        u: noise.sqrt() * scale,
        share: noise / variance,
    });
    parts.retain(|part| part.share >= MIN_SHARE || part.source == "noise");
    parts.sort_by(|a, b| largest_first((a.share, &a.source), (b.share, &b.source)));
    parts
}

/// `‖R·Cov·e‖²`, `R` the triangle of the readings alone.
fn noise_variance(linear: &Linearisation, error: usize) -> f64 {
    let (r, _, _) = linear.readings.parts();
    let n = r.ncols();
    (0..n)
        .map(|i| {
            (i..n)
                .map(|j| r[(i, j)] * linear.covariance[(j, error)])
                .sum::<f64>()
                .powi(2)
        })
        .sum()
}

/// The other errors that share an error's variance, the most correlated first.
pub fn correlated_with(problem: &Problem<'_>, linear: &Linearisation, error: usize) -> Vec<CorrelatedWith> {
    let mut shared: Vec<CorrelatedWith> = problem
        .parameters
        .list
        .iter()
        .enumerate()
        .filter(|(other, parameter)| {
            *other != error && is_wanted(parameter) && linear.rank.is_identifiable(*other)
        })
        .map(|(other, parameter)| CorrelatedWith {
            id: parameter.id.clone(),
            correlation: correlation(&linear.covariance, error, other),
        })
        .filter(|shared| shared.correlation.abs() >= MIN_CORRELATION)
        .collect();
    shared.sort_by(|a, b| largest_first((a.correlation, &a.id), (b.correlation, &b.id)));
    shared
}

/// Correlation of two unknowns.
pub fn correlation(covariance: &Mat<f64>, i: usize, j: usize) -> f64 {
    let product = covariance[(i, i)] * covariance[(j, j)];
    if product > 0.0 {
        covariance[(i, j)] / product.sqrt()
    } else {
        0.0
    }
}

/// The conditional standard uncertainty of each wanted error, all other wanted errors known, internal units.
///
/// # Errors
/// If the decomposition fails.
pub fn conditional_u(linear: &Linearisation, wanted: &[usize]) -> Result<Vec<f64>, IdentifyError> {
    let r = marginal(linear.whole.parts().0.as_ref(), wanted, &linear.size)?;
    Ok((0..wanted.len())
        .map(|j| 1.0 / (0..=j).map(|i| r[(i, j)].powi(2)).sum::<f64>().sqrt())
        .collect())
}
