//! One gauge for two models.
//!
//! Along a null direction `n` of either session the difference `δ` is undetermined. With `N` the null directions of both
//! over the common parameters and `P` the pivots,
//!
//! ```text
//! δ′ = T·δ,   T = I − N·(N_P)⁻¹·E_P
//! ```
//!
//! is zero at the pivots, and the same whatever the gauge of either model.

use faer::Mat;

use abbe_identify::model_file::IdentifiedModel;
use abbe_identify::numerics::null_space::{MIN_PIVOT, echelon};
use abbe_identify::numerics::solve::Svd;
use abbe_model::Diagnostic;

/// Share of the largest singular value below which a direction is one that the others span. The null directions of two
/// sessions of one plan differ by this little.
const SAME_DIRECTION: f64 = 0.05;

/// Brings a difference over the common parameters to the gauge of both models. Returns the held parameters, by index
/// among the common ones, and the matrix `T`.
///
/// # Errors
/// If a null direction is not finite.
pub(super) fn one_gauge(
    a: &IdentifiedModel,
    b: &IdentifiedModel,
    common: &[(usize, usize)],
    delta: &mut [f64],
    covariance: &mut Mat<f64>,
) -> Result<(Vec<usize>, Mat<f64>), Diagnostic> {
    let mut transfer = Mat::<f64>::identity(common.len(), common.len());
    let sizes: Vec<f64> = common.iter().map(|(i, _)| a.parameters[*i].size).collect();
    let of_a = a.null_directions.iter().map(|n| common.iter().map(|(i, _)| n[*i]).collect::<Vec<f64>>());
    let of_b = b.null_directions.iter().map(|n| common.iter().map(|(_, j)| n[*j]).collect::<Vec<f64>>());
    let directions: Vec<Vec<f64>> = of_a.chain(of_b).collect();
    if directions.is_empty() {
        return Ok((Vec::new(), transfer));
    }
    let scaled = Mat::from_fn(common.len(), directions.len(), |k, n| directions[n][k] / sizes[k]);
    let space = Svd::of(scaled.as_ref())?;
    let least = SAME_DIRECTION * space.singular_values.first().copied().unwrap_or(0.0).max(SAME_DIRECTION);
    let dimension = space.singular_values.iter().filter(|value| **value > least).count();
    if dimension == 0 {
        return Ok((Vec::new(), transfer));
    }
    let basis = space.left().subcols(0, dimension).to_owned();
    // Parameters that a model holds already are preferred, so that its numbers stay as they are.
    let mut preference: Vec<usize> = (0..common.len()).collect();
    preference.sort_by_key(|k| {
        let (i, j) = common[*k];
        2 - usize::from(a.parameters[i].held) - usize::from(b.parameters[j].held)
    });
    let (combinations, pivots) = echelon(basis.as_ref(), &preference, MIN_PIVOT);
    for (combination, pivot) in combinations.iter().zip(&pivots) {
        for (k, share) in combination.iter().enumerate() {
            transfer[(k, *pivot)] -= share * sizes[k] / sizes[*pivot];
        }
    }
    let moved = &transfer * Mat::from_fn(common.len(), 1, |k, _| delta[k]);
    delta.iter_mut().enumerate().for_each(|(k, value)| *value = moved[(k, 0)]);
    *covariance = &transfer * &*covariance * transfer.transpose();
    // Parameters that are held in both models without a null direction have no difference either.
    let constant = |k: usize| a.parameters[common[k].0].held && b.parameters[common[k].1].held;
    let mut held: Vec<usize> = (0..common.len()).filter(|k| pivots.contains(k) || constant(*k)).collect();
    held.sort_unstable();
    Ok((held, transfer))
}
