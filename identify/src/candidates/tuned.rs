//! The gain of an effect whose shape numbers or positions differ from those of the library.
//!
//! Its products are computed from the readings. If one of several positions changes, only its column is computed again.

use std::ops::Range;

use faer::Mat;

use super::columns::{Columns, EffectColumns};
use super::gain::TrainedModel;
use super::moments::{Moments, transposed_product};
use crate::numerics::gain::quadratic_gain;

/// The columns of an effect and their products over the training folds of a model.
pub struct TunedEffect {
    /// Rows × columns of the effect.
    rows: Mat<f64>,
    products: EffectProducts,
}

#[derive(Clone)]
struct EffectProducts {
    /// `Xᵀ C`.
    cross: Mat<f64>,
    /// `Cᵀ C`.
    own: Mat<f64>,
    /// `Cᵀ y`.
    with_y: Mat<f64>,
}

impl TunedEffect {
    /// Computes the columns of an effect and their products.
    pub fn new(
        columns: &Columns<'_>,
        moments: &Moments,
        column_set: &EffectColumns,
        model: &TrainedModel<'_>,
    ) -> TunedEffect {
        let mut rows = Mat::zeros(columns.rows(), column_set.count);
        columns.fill(&[column_set], rows.as_mut());
        let mut products = EffectProducts {
            cross: Mat::zeros(model.base.len(), column_set.count),
            own: Mat::zeros(column_set.count, column_set.count),
            with_y: Mat::zeros(column_set.count, 1),
        };
        for stretch in columns.moved_stretches(&[column_set], model.folds.iter().copied()) {
            let (start, count) = (stretch.start, stretch.len());
            let fresh = rows.as_ref().subrows(start, count);
            let present = moments.base_columns().subrows(start, count);
            let mut row = 0;
            for run in model.base.chunk_by(|a, b| a + 1 == *b) {
                let mut rows_of_run = products.cross.as_mut().subrows_mut(row, run.len());
                rows_of_run += transposed_product(present.subcols(run[0], run.len()), fresh);
                row += run.len();
            }
            products.own += transposed_product(fresh, fresh);
            products.with_y += transposed_product(fresh, moments.residual().subrows(start, count));
        }
        TunedEffect { rows, products }
    }

    /// The gain of the effect with the model for which its products were computed.
    pub fn gain(&self, model: &TrainedModel<'_>) -> f64 {
        self.products.gain(model)
    }

    /// The gain with column `column` replaced by the column of `other`. `stretches` are the rows that the model is
    /// trained on.
    pub fn gain_with(
        &self,
        column: usize,
        other: &TunedEffect,
        stretches: &[Range<usize>],
        model: &TrainedModel<'_>,
    ) -> f64 {
        self.exchanged(column, other, stretches).gain(model)
    }

    /// Replaces column `column` by the column of `other`.
    pub fn exchange(&mut self, column: usize, other: &TunedEffect, stretches: &[Range<usize>]) {
        self.products = self.exchanged(column, other, stretches);
        self.rows.col_mut(column).copy_from(other.rows.col(0));
    }

    fn exchanged(&self, column: usize, other: &TunedEffect, stretches: &[Range<usize>]) -> EffectProducts {
        let mut products = self.products.clone();
        products.cross.col_mut(column).copy_from(other.products.cross.col(0));
        products.with_y[(column, 0)] = other.products.with_y[(0, 0)];
        for k in 0..self.rows.ncols() {
            let with_other = |rows: &Range<usize>| {
                let (own, other) = (self.rows.col(k), other.rows.col(0));
                own.subrows(rows.start, rows.len()).transpose() * other.subrows(rows.start, rows.len())
            };
            let product = if k == column { other.products.own[(0, 0)] } else { stretches.iter().map(with_other).sum() };
            products.own[(k, column)] = product;
            products.own[(column, k)] = product;
        }
        products
    }
}

impl EffectProducts {
    fn gain(&self, model: &TrainedModel<'_>) -> f64 {
        let solved = &model.inverse * &self.cross;
        let d = &self.own - transposed_product(self.cross.as_ref(), solved.as_ref());
        let modelled = |k: usize| -> f64 {
            let terms = (0..model.base.len()).map(|i| solved[(i, k)] * model.base_y[i]);
            terms.sum()
        };
        let g: Vec<f64> = (0..d.nrows()).map(|k| self.with_y[(k, 0)] - modelled(k)).collect();
        quadratic_gain(&d, &self.own, &g)
    }
}
