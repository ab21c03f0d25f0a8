//! Linear least-squares solution for the functions' values under the boundary conditions.

use faer::Mat;

use super::boundary::Reduction;
use super::equations::{Equations, Reference};
use crate::error::IdentifyError;
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
    /// Standard uncertainty of each input, mm.
    pub u_inputs_mm: Vec<f64>,
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
pub fn solve(
    equations: &Equations,
    reduction: &Reduction,
    sigma_mm: f64,
) -> Result<CalibrationSolution, IdentifyError> {
    let columns = equations.columns();
    let free = reduction.free.len();
    let radius = equations.reference == Reference::Estimated;
    let parameters = free + usize::from(radius);
    let inputs = &equations.outward_mm;
    let u_inputs_mm = vec![sigma_mm; inputs.len()];
    let rows: Vec<Vec<f64>> = equations
        .rows
        .iter()
        .map(|row| {
            let mut reduced = vec![0.0; parameters];
            for (column, coefficient) in row.iter().enumerate().filter(|(_, a)| **a != 0.0) {
                for k in 0..free {
                    reduced[k] += coefficient * reduction.spread[(column, k)];
                }
            }
            if radius {
                reduced[free] = 1.0;
            }
            reduced
        })
        .collect();
    let white = Mat::from_fn(rows.len(), parameters + 1, |i, j| {
        let entry = if j == parameters { inputs[i] } else { rows[i][j] };
        entry / u_inputs_mm[i]
    });
    let triangle = Triangle::of(white);
    // The parameters are in the order of their functions and angles.
    let preference: Vec<usize> = (0..parameters).collect();
    let rank = Rank::decide(&triangle, &vec![1.0; parameters], &preference)?;
    let of_free = triangle.covariance(&rank.identifiable_basis)?;

    let outputs = columns + usize::from(radius);
    let spread = Mat::from_fn(outputs, parameters, |i, k| match (i < columns, k < free) {
        (true, true) => reduction.spread[(i, k)],
        (false, false) => 1.0,
        _ => 0.0,
    });
    let weighted = Mat::from_fn(parameters, rows.len(), |k, i| rows[i][k] / u_inputs_mm[i].powi(2));
    let estimator = &spread * (&of_free * weighted);
    let covariance = &spread * of_free * spread.transpose();
    let values_mm: Vec<f64> =
        (0..outputs).map(|i| (0..inputs.len()).map(|j| estimator[(i, j)] * inputs[j]).sum()).collect();
    let identifiable =
        (0..outputs).map(|i| (0..parameters).all(|k| spread[(i, k)] == 0.0 || rank.is_identifiable(k))).collect();

    let residual = |(row, observed): (&Vec<f64>, &f64)| {
        let model: f64 = row.iter().zip(&values_mm).map(|(a, x)| a * x).sum();
        let radius = if radius { values_mm[columns] } else { 0.0 };
        observed - model - radius
    };
    let count = equations.rows.len();
    let sum: f64 = equations.rows.iter().zip(&equations.outward_mm).map(residual).map(|r| r * r).sum();
    let informative = rows.iter().filter(|row| row.iter().any(|a| *a != 0.0)).count();
    let freedom = informative.saturating_sub(rank.identifiable_basis.ncols());
    Ok(CalibrationSolution {
        values_mm,
        covariance,
        estimator,
        u_inputs_mm,
        rank,
        identifiable,
        parameters,
        rms_mm: (sum / count.max(1) as f64).sqrt(),
        freedom,
    })
}

/// Rank of the equations without the boundary conditions.
///
/// # Errors
/// If an equation holds a number that is not finite.
pub fn rank_before(equations: &Equations) -> Result<usize, IdentifyError> {
    let rows = &equations.rows;
    let matrix = Mat::from_fn(rows.len(), equations.columns(), |i, j| rows[i][j]);
    Ok(Svd::of(matrix.as_ref())?.rank(COLLINEAR))
}
