//! Linear least-squares solution for the functions' values under the boundary conditions.

use abbe_model::Diagnostic;
use faer::Mat;

use super::boundary::Reduction;
use super::equations::{Equations, Reference};
use crate::numerics::rank::Rank;
use crate::numerics::solve::Svd;
use crate::numerics::tolerances::COLLINEAR;
use crate::numerics::triangle::Triangle;

/// Values of the functions, mm, and their linear dependence on the readings.
#[derive(Clone, Debug)]
pub struct CalibrationSolution {
    /// Every column of the equations, then the radius if it is estimated.
    pub values_mm: Vec<f64>,
    /// Their covariance, mm².
    pub covariance: Mat<f64>,
    /// `values = estimator · inputs`: rows as the values, columns as the readings.
    pub estimator: Mat<f64>,
    /// Identifiable directions of the free values.
    pub rank: Rank,
    /// Whether each of the values is identifiable.
    pub identifiable: Vec<bool>,
    /// Number of free values, with the radius if it is estimated.
    pub parameters: usize,
    /// Root mean square of the residual, mm.
    pub rms_mm: f64,
    /// Degrees of freedom: readings with information, minus the rank.
    pub freedom: usize,
}

/// Solves the equations for readings with the standard uncertainty `sigma_mm`.
///
/// # Errors
/// If an equation holds a number that is not finite.
pub fn solve(equations: &Equations, reduction: &Reduction, sigma_mm: f64) -> Result<CalibrationSolution, Diagnostic> {
    let (columns, free) = (equations.columns(), reduction.free.len());
    let radius = usize::from(equations.reference == Reference::Estimated);
    let (outputs, parameters) = (columns + radius, free + radius);
    let count = equations.rows.len();
    let jacobian = Mat::from_fn(count, outputs, |i, j| equations.rows[i].get(j).copied().unwrap_or(1.0));
    let inputs = Mat::from_fn(count, 1, |i, _| equations.outward_mm[i]);
    let spread = Mat::from_fn(outputs, parameters, |i, k| match (i < columns, k < free) {
        (true, true) => reduction.spread[(i, k)],
        (false, false) => 1.0,
        _ => 0.0,
    });
    let rows = &jacobian * &spread;
    let entry = |i: usize, j: usize| if j < parameters { rows[(i, j)] } else { inputs[(i, 0)] };
    let triangle = Triangle::of(Mat::from_fn(count, parameters + 1, |i, j| entry(i, j) / sigma_mm));
    // The parameters are in the order of their functions and angles.
    let preference: Vec<usize> = (0..parameters).collect();
    let rank = Rank::decide(&triangle, &vec![1.0; parameters], &preference)?;
    let covariance = &spread * triangle.covariance(&rank.identifiable_basis)? * spread.transpose();
    let estimator = &covariance * jacobian.transpose() * faer::Scale(sigma_mm.powi(-2));
    let values = &estimator * &inputs;
    let residual = inputs - jacobian * &values;
    let is_identifiable = |i: usize| (0..parameters).all(|k| spread[(i, k)] == 0.0 || rank.is_identifiable(k));
    let informative = (0..count).filter(|i| rows.row(*i).iter().any(|a| *a != 0.0)).count();
    Ok(CalibrationSolution {
        values_mm: values.col(0).iter().copied().collect(),
        identifiable: (0..outputs).map(is_identifiable).collect(),
        freedom: informative.saturating_sub(rank.identifiable_basis.ncols()),
        covariance,
        estimator,
        rank,
        parameters,
        rms_mm: (residual.squared_norm_l2() / count.max(1) as f64).sqrt(),
    })
}

/// Rank of the equations without the boundary conditions.
///
/// # Errors
/// If an equation holds a number that is not finite.
pub fn rank_before(equations: &Equations) -> Result<usize, Diagnostic> {
    let rows = &equations.rows;
    let matrix = Mat::from_fn(rows.len(), equations.columns(), |i, j| rows[i][j]);
    Ok(Svd::of(matrix.as_ref())?.rank(COLLINEAR))
}
