//! The start of a search: the fitted model in orthonormal columns, priors included.
//!
//! `J` is the Jacobian, `V` the basis of the identifiable directions, and `R` the triangular factor of `J V` with its
//! prior rows. The columns are `J V R⁻¹`. Normal equations over orthonormal columns lose no precision.

use faer::Mat;

use super::search::UnwhitenedModel;
use crate::candidates::columns::Columns;
use crate::candidates::gain::PriorMoments;
use crate::error::IdentifyError;
use crate::fit::{Fit, in_directions};
use crate::problem::Problem;
use crate::triangle::Triangle;

/// The fitted model for the search: orthonormal columns and residual, whitened, in fold order.
pub(super) struct Start {
    /// Rows × rank.
    pub model: Mat<f64>,
    /// One value per row.
    pub residual: Vec<f64>,
    /// Maps orthonormal coordinates to parameters in internal units: parameters × rank.
    pub to_parameters: Mat<f64>,
    prior_rows: Mat<f64>,
    prior_residual: Vec<f64>,
}

impl Start {
    /// Computes the start from a fit, whose triangular factors contain the readings.
    pub fn of(problem: &Problem, columns: &Columns<'_>, fit: &Fit) -> Result<Start, IdentifyError> {
        let parameters = fit.beta.len();
        let basis = &fit.rank.identifiable_basis;
        let rank = basis.ncols();
        let rows = columns.model_rows(&fit.beta)?;
        let residual = (0..rows.nrows()).map(|i| rows[(i, parameters)]).collect();
        let prior = problem.prior_triangle(&fit.beta);
        let mut whole = Triangle::new(parameters);
        whole.merge(&prior);
        fit.triangles.iter().for_each(|triangle| whole.merge(triangle));
        let (r, _, _) = in_directions(&whole, basis).parts();
        let inverse = inverse_of_triangle(&r);
        let to_parameters = basis * &inverse;
        let model = rows.as_ref().subcols(0, parameters) * &to_parameters;
        let (of_prior, prior_residual, _) = prior.parts();
        let prior_rows = &of_prior * &to_parameters;
        debug_assert_eq!(model.ncols(), rank);
        Ok(Start { model, residual, to_parameters, prior_rows, prior_residual })
    }

    /// The same model and residual without whitening.
    pub fn unwhitened(
        &self,
        columns: &Columns<'_>,
        beta: &[f64],
        sigma_mm: f64,
    ) -> Result<UnwhitenedModel, IdentifyError> {
        let rows = columns.unwhitened_model_rows(beta)?;
        let parameters = beta.len();
        let base = rows.as_ref().subcols(0, parameters) * &self.to_parameters;
        Ok(UnwhitenedModel {
            base: Mat::from_fn(base.nrows(), base.ncols(), |i, j| base[(i, j)] / sigma_mm),
            residual: (0..rows.nrows()).map(|i| rows[(i, parameters)] / sigma_mm).collect(),
            folds: columns.unwhitened_folds(),
            units: columns.unwhitened_units(),
            sigma_mm,
        })
    }

    /// The priors as products with the orthonormal columns.
    pub fn prior(&self) -> PriorMoments {
        let rank = self.to_parameters.ncols();
        PriorMoments {
            base: self.prior_rows.transpose() * &self.prior_rows,
            base_y: (0..rank)
                .map(|k| {
                    let with = |i: usize| self.prior_rows[(i, k)] * self.prior_residual[i];
                    (0..self.prior_rows.nrows()).map(with).sum()
                })
                .collect(),
        }
    }
}

/// The inverse of an upper triangular matrix by back substitution.
fn inverse_of_triangle(r: &Mat<f64>) -> Mat<f64> {
    let n = r.nrows();
    let mut inverse = Mat::zeros(n, n);
    for column in 0..n {
        for i in (0..=column).rev() {
            let unit = if i == column { 1.0 } else { 0.0 };
            let sum: f64 = (i + 1..=column).map(|k| r[(i, k)] * inverse[(k, column)]).sum();
            inverse[(i, column)] = if r[(i, i)] != 0.0 { (unit - sum) / r[(i, i)] } else { 0.0 };
        }
    }
    inverse
}
