//! The gain of an effect whose shape numbers or positions differ from those of the library.
//!
//! Its products are computed from the readings. If one of several positions changes, only the column of that position is computed
//! anew.

use std::ops::Range;

use faer::Mat;

use super::columns::{Columns, Layout};
use super::moments::{Moments, transposed_product};
use super::observable::quadratic_gain;
use super::score::TrainedModel;

/// The columns of an effect and their products over the training folds of a model.
pub struct Trial {
    /// Rows × columns of the effect.
    rows: Mat<f64>,
    products: Products,
}

#[derive(Clone)]
struct Products {
    /// `Xᵀ C`.
    cross: Mat<f64>,
    /// `Cᵀ C`.
    own: Mat<f64>,
    /// `Cᵀ y`.
    with_y: Mat<f64>,
}

impl Trial {
    /// Computes the columns of an effect and their products.
    pub fn new(
        columns: &Columns<'_, '_>,
        moments: &Moments,
        layout: &Layout,
        model: &TrainedModel<'_>,
    ) -> Trial {
        let mut rows = Mat::zeros(columns.rows(), layout.count);
        columns.fill(&[layout], rows.as_mut());
        let mut products = Products {
            cross: Mat::zeros(model.base.len(), layout.count),
            own: Mat::zeros(layout.count, layout.count),
            with_y: Mat::zeros(layout.count, 1),
        };
        for stretch in columns.moved_stretches(std::slice::from_ref(layout), model.folds.iter().copied()) {
            let (start, count) = (stretch.start, stretch.len());
            let fresh = rows.as_ref().subrows(start, count);
            let present = moments.base_columns().subrows(start, count);
            let mut place = 0;
            for run in model.base.chunk_by(|a, b| a + 1 == *b) {
                let mut part = products.cross.as_mut().subrows_mut(place, run.len());
                part += transposed_product(present.subcols(run[0], run.len()), fresh);
                place += run.len();
            }
            products.own += transposed_product(fresh, fresh);
            products.with_y += transposed_product(fresh, moments.residual().subrows(start, count));
        }
        Trial { rows, products }
    }

    /// The gain of the effect beside the model that it was computed for.
    pub fn gain(&self, model: &TrainedModel<'_>) -> f64 {
        self.products.gain(model)
    }

    /// The gain with column `place` replaced by the column of `other`. `stretches` are the rows that the model is trained on.
    pub fn gain_with(
        &self,
        place: usize,
        other: &Trial,
        stretches: &[Range<usize>],
        model: &TrainedModel<'_>,
    ) -> f64 {
        self.exchanged(place, other, stretches).gain(model)
    }

    /// Replaces column `place` by the column of `other`.
    pub fn exchange(&mut self, place: usize, other: &Trial, stretches: &[Range<usize>]) {
        self.products = self.exchanged(place, other, stretches);
        self.rows.col_mut(place).copy_from(other.rows.col(0));
    }

    fn exchanged(&self, place: usize, other: &Trial, stretches: &[Range<usize>]) -> Products {
        let mut products = self.products.clone();
        products
            .cross
            .col_mut(place)
            .copy_from(other.products.cross.col(0));
        products.with_y[(place, 0)] = other.products.with_y[(0, 0)];
        for k in 0..self.rows.ncols() {
            let with_other = |rows: &Range<usize>| {
                let (own, other) = (self.rows.col(k), other.rows.col(0));
                own.subrows(rows.start, rows.len()).transpose() * other.subrows(rows.start, rows.len())
            };
            let product = if k == place {
                other.products.own[(0, 0)]
            } else {
                stretches.iter().map(with_other).sum()
            };
            products.own[(k, place)] = product;
            products.own[(place, k)] = product;
        }
        products
    }
}

impl Products {
    fn gain(&self, model: &TrainedModel<'_>) -> f64 {
        let solved = &model.inverse * &self.cross;
        let d = &self.own - transposed_product(self.cross.as_ref(), solved.as_ref());
        let modelled = |k: usize| -> f64 {
            let terms = (0..model.base.len()).map(|i| solved[(i, k)] * model.base_y[i]);
            terms.sum()
        };
        let g: Vec<f64> = (0..d.nrows())
            .map(|k| self.with_y[(k, 0)] - modelled(k))
            .collect();
        quadratic_gain(&d, &self.own, &g)
    }
}
