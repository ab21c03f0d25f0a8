//! The held-out error: each fold, as it was read, under the model of the search that did not see it.

use faer::Mat;
use rayon::prelude::*;

use super::{ALL, Search};
use crate::error::IdentifyError;
use crate::trace::moments::grow;
use crate::trace::score::Trained;

/// Readings as they are, not whitened: what held-out errors are of. In units of the noise.
pub struct Plain {
    /// The base: rows × columns, extended as candidates are taken up.
    pub base: Mat<f64>,
    /// The residual.
    pub residual: Vec<f64>,
    /// The fold of each row.
    pub folds: Vec<usize>,
    /// Standard deviation of a reading, mm.
    pub sigma_mm: f64,
}

impl Plain {
    /// Adds base columns in mm, which the base has divided by these norms.
    pub(super) fn extend(&mut self, rows: &Mat<f64>, norms: &[f64]) {
        let old = self.base.ncols();
        let sigma_mm = self.sigma_mm;
        grow(&mut self.base, rows.nrows(), old + rows.ncols(), |i, j| {
            let norm = norms[j - old];
            if norm > 0.0 {
                rows[(i, j - old)] / (norm * sigma_mm)
            } else {
                0.0
            }
        });
    }
}

impl Search<'_> {
    /// Sum of squares of held-out residuals over the variance of the noise: each fold under the model of the search that did not see it.
    pub(super) fn held_out_now(&self) -> Result<f64, IdentifyError> {
        let models: Vec<Trained<'_>> = self.tracks[ALL + 1..]
            .par_iter()
            .map(|track| self.lean_model_of(&track.chosen(), &track.folds))
            .collect::<Result<_, _>>()?;
        let predicted = |model: &Trained<'_>, row: usize| -> f64 {
            let along = model.base.iter().zip(&model.coefficients);
            along.map(|(column, c)| self.plain.base[(row, *column)] * c).sum()
        };
        let squares = self.plain.folds.iter().enumerate();
        let squares =
            squares.map(|(row, fold)| (self.plain.residual[row] - predicted(&models[*fold], row)).powi(2));
        Ok(squares.sum())
    }

    /// Writes down the held-out error with as many effects as there are now.
    pub(in crate::trace) fn note_held_out(&mut self) -> Result<(), IdentifyError> {
        let held_out = self.held_out_now()?;
        let taken = self.taken().len();
        self.held_out.truncate(taken);
        self.held_out.resize(taken + 1, held_out);
        Ok(())
    }
}
