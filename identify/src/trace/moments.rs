//! Products of candidates with the model and the residual, fold by fold.
//!
//! With these every question of the search is small algebra: the gain of any candidate over any model on any set of folds needs no second look
//! at the readings. With `X` the model's columns, `y` the residual and `C` a candidate's columns over the folds of a training set,
//!
//! ```text
//! gain = gᵀ D⁻¹ g,   D = CᵀC − CᵀX (XᵀX)⁻¹ XᵀC,   g = Cᵀy − CᵀX (XᵀX)⁻¹ Xᵀy
//! ```
//!
//! `X` begins with an orthonormal basis of what the fit has (priors included), so that the normal equations lose nothing.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use rayon::prelude::*;

use super::columns::{Columns, Layout};
use crate::error::IdentifyError;

/// Candidates whose columns are made together.
const CHUNK_COLUMNS: usize = 48;

/// Products over one fold.
#[derive(Clone, Debug)]
pub struct FoldMoments {
    /// Base with base: the orthonormal model columns, then those of materialised candidates.
    pub base: Mat<f64>,
    /// Base with the residual.
    pub base_y: Vec<f64>,
    /// Residual with itself.
    pub yy: f64,
    /// Base with candidates: base × all candidate columns.
    pub cross: Mat<f64>,
    /// Residual with candidates.
    pub cross_y: Vec<f64>,
    /// Candidate with itself, one after another, each count × count.
    pub own: Vec<Mat<f64>>,
}

/// All products.
pub struct Moments {
    /// By fold.
    pub folds: Vec<FoldMoments>,
    /// Null draws with candidates: draws × all candidate columns.
    pub null_cross: Mat<f64>,
    /// Base with null draws (readings part): base × draws.
    pub null_base: Mat<f64>,
    /// First column of each candidate.
    pub first: Vec<usize>,
    /// Number of columns of each candidate.
    pub count: Vec<usize>,
    /// Base columns, rows × base, kept to extend.
    base_columns: Mat<f64>,
    null: Mat<f64>,
}

fn transposed_product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut product = Mat::zeros(a.ncols(), b.ncols());
    matmul(product.as_mut(), Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
    product
}

impl Moments {
    /// From the orthonormal model columns (rows × rank), the residual and null draws (rows × draws).
    ///
    /// # Errors
    /// None at present; the signature leaves room for columns that cannot be made.
    pub fn new(
        columns: &Columns<'_, '_>,
        layouts: &[Layout],
        model: Mat<f64>,
        residual: &[f64],
        null: Mat<f64>,
    ) -> Result<Moments, IdentifyError> {
        let mut first = Vec::with_capacity(layouts.len());
        let mut total = 0;
        for layout in layouts {
            first.push(total);
            total += layout.count;
        }
        let count: Vec<usize> = layouts.iter().map(|layout| layout.count).collect();
        // Model, residual, and null draws side by side: one product with each chunk of candidates.
        let (rank, draws, rows) = (model.ncols(), null.ncols(), columns.rows());
        let side = Mat::from_fn(rows, rank + 1 + draws, |i, j| {
            if j < rank {
                model[(i, j)]
            } else if j == rank {
                residual[i]
            } else {
                null[(i, j - rank - 1)]
            }
        });
        let chunks = chunked(&count);
        let products: Vec<_> = chunks
            .par_iter()
            .map(|chunk| {
                let chosen: Vec<&Layout> = layouts[chunk.clone()].iter().collect();
                let width: usize = chosen.iter().map(|layout| layout.count).sum();
                let mut block = Mat::zeros(rows, width);
                columns.fill(&chosen, block.as_mut());
                columns
                    .fold_rows
                    .iter()
                    .map(|range| {
                        let part = block.as_ref().subrows(range.start, range.len());
                        let cross = transposed_product(side.as_ref().subrows(range.start, range.len()), part);
                        let mut start = 0;
                        let own: Vec<Mat<f64>> = chosen
                            .iter()
                            .map(|layout| {
                                let of = part.subcols(start, layout.count);
                                start += layout.count;
                                transposed_product(of, of)
                            })
                            .collect();
                        (cross, own)
                    })
                    .collect::<Vec<_>>()
            })
            .collect();
        let mut null_cross = Mat::zeros(draws, total);
        let mut folds = Vec::new();
        for (fold, range) in columns.fold_rows.iter().enumerate() {
            let part = side.as_ref().subrows(range.start, range.len());
            let base_part = part.subcols(0, rank + 1);
            let gram = transposed_product(base_part, base_part);
            let mut cross = Mat::zeros(rank, total);
            let mut cross_y = vec![0.0; total];
            let mut own = Vec::with_capacity(layouts.len());
            let mut column = 0;
            for product in &products {
                let (block, of_candidates) = &product[fold];
                for j in 0..block.ncols() {
                    for i in 0..rank {
                        cross[(i, column + j)] = block[(i, j)];
                    }
                    cross_y[column + j] = block[(rank, j)];
                    for d in 0..draws {
                        null_cross[(d, column + j)] += block[(rank + 1 + d, j)];
                    }
                }
                column += block.ncols();
                own.extend(of_candidates.iter().cloned());
            }
            folds.push(FoldMoments {
                base: Mat::from_fn(rank, rank, |i, j| gram[(i, j)]),
                base_y: (0..rank).map(|i| gram[(i, rank)]).collect(),
                yy: gram[(rank, rank)],
                cross,
                cross_y,
                own,
            });
        }
        let null_base = transposed_product(model.as_ref(), null.as_ref());
        Ok(Moments {
            folds,
            null_cross,
            null_base,
            first,
            count,
            base_columns: model,
            null,
        })
    }

    /// Number of base columns so far.
    pub fn base(&self) -> usize {
        self.base_columns.ncols()
    }

    /// Adds the columns of a candidate to the base; returns their places there.
    pub fn materialise(
        &mut self,
        columns: &Columns<'_, '_>,
        layouts: &[Layout],
        candidate: usize,
    ) -> std::ops::Range<usize> {
        let layout = &layouts[candidate];
        let rows = columns.rows();
        let old = self.base();
        let mut fresh = Mat::zeros(rows, layout.count);
        columns.fill(&[layout], fresh.as_mut());
        // Unit length, so that the normal equations stay well scaled.
        for j in 0..layout.count {
            let norm = fresh.col(j).norm_l2();
            if norm > 0.0 {
                for i in 0..rows {
                    fresh[(i, j)] /= norm;
                }
            }
        }
        let mut base = Mat::zeros(rows, old + layout.count);
        for j in 0..old {
            base.col_mut(j).copy_from(self.base_columns.col(j));
        }
        for j in 0..layout.count {
            base.col_mut(old + j).copy_from(fresh.col(j));
        }
        let chunks = chunked(&self.count);
        let products: Vec<Vec<Mat<f64>>> = chunks
            .par_iter()
            .map(|chunk| {
                let chosen: Vec<&Layout> = layouts[chunk.clone()].iter().collect();
                let width: usize = chosen.iter().map(|layout| layout.count).sum();
                let mut block = Mat::zeros(rows, width);
                columns.fill(&chosen, block.as_mut());
                columns
                    .fold_rows
                    .iter()
                    .map(|range| {
                        transposed_product(
                            fresh.as_ref().subrows(range.start, range.len()),
                            block.as_ref().subrows(range.start, range.len()),
                        )
                    })
                    .collect()
            })
            .collect();
        let null_fresh = transposed_product(fresh.as_ref(), self.null.as_ref());
        self.null_base = stacked(&self.null_base, &null_fresh);
        for (fold, range) in columns.fold_rows.iter().enumerate() {
            let moments = &mut self.folds[fold];
            let fresh_part = fresh.as_ref().subrows(range.start, range.len());
            let gram = transposed_product(base.as_ref().subrows(range.start, range.len()), fresh_part);
            let width = old + layout.count;
            let before = &moments.base;
            moments.base = Mat::from_fn(width, width, |i, j| match (i < old, j < old) {
                (true, true) => before[(i, j)],
                (_, false) => gram[(i, j - old)],
                (false, true) => gram[(j, i - old)],
            });
            let mut added = Mat::zeros(layout.count, moments.cross.ncols());
            let mut column = 0;
            for product in &products {
                let block = &product[fold];
                for j in 0..block.ncols() {
                    for i in 0..layout.count {
                        added[(i, column + j)] = block[(i, j)];
                    }
                }
                column += block.ncols();
            }
            moments.cross = stacked(&moments.cross, &added);
        }
        // Residual with fresh columns, by fold, from the candidate's own products rescaled.
        for (fold, range) in columns.fold_rows.iter().enumerate() {
            let own_first = self.first[candidate];
            for k in 0..layout.count {
                let fresh_norm = fresh.col(k).subrows(range.start, range.len()).norm_l2();
                let own_norm = self.folds[fold].own[candidate][(k, k)].max(0.0).sqrt();
                let ratio = if own_norm > 0.0 {
                    fresh_norm / own_norm
                } else {
                    0.0
                };
                let value = self.folds[fold].cross_y[own_first + k] * ratio;
                self.folds[fold].base_y.push(value);
            }
        }
        self.base_columns = base;
        old..old + layout.count
    }

    /// The base columns, rows × base, in the order of the folds.
    pub fn base_columns(&self) -> MatRef<'_, f64> {
        self.base_columns.as_ref()
    }
}

fn stacked(above: &Mat<f64>, below: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(above.nrows() + below.nrows(), above.ncols(), |i, j| {
        if i < above.nrows() {
            above[(i, j)]
        } else {
            below[(i - above.nrows(), j)]
        }
    })
}

/// Consecutive candidates whose columns together make a chunk.
fn chunked(count: &[usize]) -> Vec<std::ops::Range<usize>> {
    let mut chunks = Vec::new();
    let (mut start, mut width) = (0, 0);
    for (index, columns) in count.iter().enumerate() {
        if width > 0 && width + columns > CHUNK_COLUMNS {
            chunks.push(start..index);
            (start, width) = (index, 0);
        }
        width += columns;
    }
    if start < count.len() {
        chunks.push(start..count.len());
    }
    chunks
}
