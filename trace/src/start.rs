//! The start of a search: the fitted model in orthonormal columns, priors included.
//!
//! `J` is the Jacobian, `V` the basis of the identifiable directions, and `R` the triangular factor of `J V` with its
//! prior rows. The columns are `J V R⁻¹`. Normal equations over orthonormal columns lose no precision.

use std::sync::Arc;

use abbe_identify::fit::Fit;
use abbe_identify::numerics::reduction::inverse_of_upper;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use faer::Mat;

use super::state::UnwhitenedModel;
use crate::candidates::columns::Columns;
use crate::candidates::gram::PriorGram;

/// The fitted model for the search: orthonormal columns and residual, whitened, in fold order.
pub(super) struct Start {
    /// Rows × rank.
    pub model: Arc<Mat<f64>>,
    /// One value per row.
    pub residual: Vec<f64>,
    /// Maps orthonormal coordinates to parameters in internal units: parameters × rank.
    pub to_parameters: Mat<f64>,
    prior_rows: Mat<f64>,
    prior_residual: Vec<f64>,
}

impl Start {
    /// Computes the start from a fit, whose triangular factors contain the readings.
    pub fn of(problem: &Problem, columns: &Columns<'_>, fit: &Fit) -> Result<Start, Diagnostic> {
        let parameters = fit.beta.len();
        let basis = &fit.rank.identifiable_basis;
        let rank = basis.ncols();
        let rows = columns.model_rows(&fit.beta)?;
        let residual = (0..rows.nrows()).map(|i| rows[(i, parameters)]).collect();
        let prior = problem.prior_triangle(&fit.beta);
        let r = prior.clone().merged(&fit.triangles).in_directions(basis).r();
        let inverse = inverse_of_upper(r.as_ref());
        let to_parameters = basis * &inverse;
        let model = rows.as_ref().subcols(0, parameters) * &to_parameters;
        let (of_prior, prior_residual, _) = prior.parts();
        let prior_rows = &of_prior * &to_parameters;
        debug_assert_eq!(model.ncols(), rank);
        Ok(Start { model: Arc::new(model), residual, to_parameters, prior_rows, prior_residual })
    }

    /// The same model and residual without whitening.
    pub fn unwhitened(
        &self,
        columns: &Columns<'_>,
        beta: &[f64],
        sigma_mm: f64,
    ) -> Result<UnwhitenedModel, Diagnostic> {
        let (mut model, mut residual) = columns.unwhitened_model_rows(beta, &self.to_parameters)?;
        model.col_iter_mut().flat_map(|column| column.iter_mut()).for_each(|value| *value /= sigma_mm);
        residual.iter_mut().for_each(|value| *value /= sigma_mm);
        Ok(UnwhitenedModel {
            model,
            residual,
            folds: columns.unwhitened_folds(),
            units: columns.unwhitened_units(),
            sigma_mm,
        })
    }

    /// The priors as products with the orthonormal columns.
    pub fn prior(&self) -> PriorGram {
        let rank = self.to_parameters.ncols();
        PriorGram {
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
