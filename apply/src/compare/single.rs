//! One change that explains all differences.
//!
//! In one gauge a change `s` of parameter `k` alone changes the other parameters by `s·T·e_k`: a shift of one axis of a robot
//! appears as changes of several base parameters. With the covariance `C` of the difference `δ` and `v = T·e_k`
//!
//! ```text
//! ŝ = vᵀC⁺δ / vᵀC⁺v,    u² = 1 / vᵀC⁺v,    χ²_k = δᵀC⁺δ − (vᵀC⁺δ)² / vᵀC⁺v
//! ```
//!
//! Changes that leave a `χ²_k` as large as chance leaves are alternatives. Each has one number, so that their probabilities
//! are in proportion to `exp(−χ²_k/2)`.

use faer::Mat;

use super::results::SingleChange;
use super::{Metric, Named};
use abbe_identify::numerics::tails::chi_square_tail;

/// Probability of a larger remainder below which one change does not explain the differences.
const EXPLAINS: f64 = 0.05;
/// Least probability of an alternative that is stated.
const LEAST_PROBABILITY: f64 = 0.01;

/// The single changes that explain a difference, the most probable first; empty if none does.
pub(super) fn explanations(
    a: &Named<'_>,
    common: &[(usize, usize)],
    delta: &[f64],
    transfer: &Mat<f64>,
    metric: &Metric<'_>,
) -> Vec<SingleChange> {
    let white = metric.whitened(delta);
    let total: f64 = white.iter().map(|value| value * value).sum();
    let mut found: Vec<SingleChange> = Vec::new();
    for (k, (i, _)) in common.iter().enumerate() {
        let own: Vec<f64> = (0..common.len()).map(|row| transfer[(row, k)]).collect();
        let own = metric.whitened(&own);
        let information: f64 = own.iter().map(|value| value * value).sum();
        if information <= 0.0 {
            continue;
        }
        let along: f64 = own.iter().zip(&white).map(|(own, value)| own * value).sum();
        let chi_square = (total - along * along / information).max(0.0);
        found.push(SingleChange {
            change: a.model.parameters[*i].change(along / information, information.sqrt().recip()),
            chi_square,
            p_value: chi_square_tail(chi_square, metric.rank().saturating_sub(1) as f64),
            probability: 0.0,
        });
    }
    let least = found.iter().map(|change| change.chi_square).fold(f64::INFINITY, f64::min);
    let weight = |change: &SingleChange| (-0.5 * (change.chi_square - least)).exp();
    let all: f64 = found.iter().map(weight).sum();
    for change in &mut found {
        change.probability = weight(change) / all;
    }
    found.retain(|change| change.p_value >= EXPLAINS && change.probability >= LEAST_PROBABILITY);
    found.sort_by(|x, y| y.probability.total_cmp(&x.probability));
    found
}
