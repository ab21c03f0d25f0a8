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

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use rayon::prelude::*;

use super::columns::{Columns, Layout};

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

impl FoldMoments {
    /// Over several folds together.
    fn sum(folds: &[FoldMoments]) -> FoldMoments {
        let Some((first, rest)) = folds.split_first() else {
            return FoldMoments {
                base: Mat::zeros(0, 0),
                base_y: Vec::new(),
                yy: 0.0,
                cross: Mat::zeros(0, 0),
                cross_y: Vec::new(),
                own: Vec::new(),
            };
        };
        let mut sum = first.clone();
        let add = |to: &mut [f64], more: &[f64]| to.iter_mut().zip(more).for_each(|(to, more)| *to += more);
        for fold in rest {
            sum.base += &fold.base;
            sum.cross += &fold.cross;
            sum.yy += fold.yy;
            add(&mut sum.base_y, &fold.base_y);
            add(&mut sum.cross_y, &fold.cross_y);
            sum.own
                .iter_mut()
                .zip(&fold.own)
                .for_each(|(to, more)| *to += more);
        }
        sum
    }
}

/// All products.
pub struct Moments {
    /// By fold.
    pub folds: Vec<FoldMoments>,
    /// Over all folds.
    pub whole: FoldMoments,
    /// Null draws with candidates: draws × all candidate columns.
    pub null_cross: Mat<f64>,
    /// Base with null draws (readings part): base × draws.
    pub null_base: Mat<f64>,
    /// First column of each candidate.
    pub first: Vec<usize>,
    /// Number of columns of each candidate.
    pub count: Vec<usize>,
    /// How many numbers of its shape are chosen to fit.
    pub numbers: Vec<usize>,
    /// Base columns, rows × base, kept to extend.
    base_columns: Mat<f64>,
    residual: Vec<f64>,
    null: Mat<f64>,
}

fn transposed_product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut product = Mat::zeros(a.ncols(), b.ncols());
    matmul(product.as_mut(), Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
    product
}

impl Moments {
    /// From the orthonormal model columns (rows × rank), the residual and null draws (rows × draws).
    pub fn new(
        columns: &Columns<'_, '_>,
        layouts: &[Layout],
        model: Mat<f64>,
        residual: &[f64],
        null: Mat<f64>,
    ) -> Moments {
        let mut first = Vec::with_capacity(layouts.len());
        let mut total = 0;
        for layout in layouts {
            first.push(total);
            total += layout.count;
        }
        let count: Vec<usize> = layouts.iter().map(|layout| layout.count).collect();
        let (rank, draws) = (model.ncols(), null.ncols());
        let side = beside(&model, residual, &null);
        let products = products_by_fold(columns, layouts, side.as_ref());
        let mut null_cross = Mat::zeros(draws, total);
        let mut folds = Vec::new();
        for (fold, range) in columns.fold_rows.iter().enumerate() {
            let part = side.as_ref().subrows(range.start, range.len());
            let base_part = part.subcols(0, rank + 1);
            let gram = transposed_product(base_part, base_part);
            let (product, own) = &products[fold];
            for j in 0..total {
                for d in 0..draws {
                    null_cross[(d, j)] += product[(rank + 1 + d, j)];
                }
            }
            folds.push(FoldMoments {
                base: Mat::from_fn(rank, rank, |i, j| gram[(i, j)]),
                base_y: (0..rank).map(|i| gram[(i, rank)]).collect(),
                yy: gram[(rank, rank)],
                cross: product.subrows(0, rank).to_owned(),
                cross_y: (0..total).map(|j| product[(rank, j)]).collect(),
                own: own.clone(),
            });
        }
        let null_base = transposed_product(model.as_ref(), null.as_ref());
        let whole = FoldMoments::sum(&folds);
        Moments {
            folds,
            whole,
            null_cross,
            null_base,
            first,
            count,
            numbers: layouts.iter().map(|layout| layout.numbers).collect(),
            base_columns: model,
            residual: residual.to_vec(),
            null,
        }
    }

    /// Number of base columns so far.
    pub fn base(&self) -> usize {
        self.base_columns.ncols()
    }

    /// Adds the columns of candidates to the base, each of unit length; returns their places there.
    pub fn materialise(
        &mut self,
        columns: &Columns<'_, '_>,
        layouts: &[Layout],
        candidates: &[usize],
    ) -> Vec<Range<usize>> {
        let chosen: Vec<&Layout> = candidates.iter().map(|candidate| &layouts[*candidate]).collect();
        let added: usize = chosen.iter().map(|layout| layout.count).sum();
        let (rows, old) = (columns.rows(), self.base());
        let mut places = Vec::new();
        let mut next = old;
        for layout in &chosen {
            places.push(next..next + layout.count);
            next += layout.count;
        }
        if added == 0 {
            return places;
        }
        let mut fresh = Mat::zeros(rows, added);
        columns.fill(&chosen, fresh.as_mut());
        for j in 0..added {
            let norm = fresh.col(j).norm_l2();
            if norm > 0.0 {
                for i in 0..rows {
                    fresh[(i, j)] /= norm;
                }
            }
        }
        self.base_columns
            .resize_with(rows, next, |i, j| fresh[(i, j - old)]);
        let products = products_by_fold(columns, layouts, fresh.as_ref());
        let null_fresh = transposed_product(fresh.as_ref(), self.null.as_ref());
        let draws = self.null.ncols();
        self.null_base
            .resize_with(next, draws, |i, d| null_fresh[(i - old, d)]);
        let total = self.null_cross.ncols();
        for (fold, range) in columns.fold_rows.iter().enumerate() {
            let moments = &mut self.folds[fold];
            let fresh_part = fresh.as_ref().subrows(range.start, range.len());
            let base_part = self.base_columns.as_ref().subrows(range.start, range.len());
            let gram = transposed_product(base_part, fresh_part);
            moments.base.resize_with(next, next, |i, j| {
                if j < old {
                    gram[(j, i - old)]
                } else {
                    gram[(i, j - old)]
                }
            });
            let product = &products[fold].0;
            moments
                .cross
                .resize_with(next, total, |i, j| product[(i - old, j)]);
            for j in 0..added {
                let sum = (range.start..range.end)
                    .map(|i| fresh[(i, j)] * self.residual[i])
                    .sum();
                moments.base_y.push(sum);
            }
        }
        self.sum_up(next, total);
        places
    }

    /// Adds candidates to those that are scored.
    pub fn append(&mut self, columns: &Columns<'_, '_>, layouts: &[Layout]) {
        let side = self.side();
        let rank = self.base();
        let products = products_by_fold(columns, layouts, side.as_ref());
        let draws = self.null.ncols();
        let total = self.null_cross.ncols();
        let mut added = 0;
        for layout in layouts {
            self.first.push(total + added);
            self.count.push(layout.count);
            self.numbers.push(layout.numbers);
            added += layout.count;
        }
        let mut of_null = Mat::<f64>::zeros(draws, added);
        for (fold, (product, own)) in products.into_iter().enumerate() {
            let moments = &mut self.folds[fold];
            moments
                .cross
                .resize_with(rank, total + added, |i, j| product[(i, j - total)]);
            moments.cross_y.extend((0..added).map(|k| product[(rank, k)]));
            moments.own.extend(own);
            for d in 0..draws {
                for k in 0..added {
                    of_null[(d, k)] += product[(rank + 1 + d, k)];
                }
            }
        }
        self.sum_up(rank, total + added);
        self.null_cross
            .resize_with(draws, total + added, |d, j| of_null[(d, j - total)]);
    }

    /// Extends the products over all folds to what each fold has now: so many base columns and candidate columns.
    fn sum_up(&mut self, base: usize, total: usize) {
        let (folds, whole) = (&self.folds, &mut self.whole);
        whole.base.resize_with(base, base, |i, j| {
            folds.iter().map(|fold| fold.base[(i, j)]).sum()
        });
        whole.cross.resize_with(base, total, |i, j| {
            folds.iter().map(|fold| fold.cross[(i, j)]).sum()
        });
        for i in whole.base_y.len()..base {
            whole.base_y.push(folds.iter().map(|fold| fold.base_y[i]).sum());
        }
        for j in whole.cross_y.len()..total {
            whole.cross_y.push(folds.iter().map(|fold| fold.cross_y[j]).sum());
        }
        for candidate in whole.own.len()..self.count.len() {
            let mut own = Mat::zeros(self.count[candidate], self.count[candidate]);
            folds.iter().for_each(|fold| own += &fold.own[candidate]);
            whole.own.push(own);
        }
    }

    /// What a layout would gain on all readings beside a model trained on all readings.
    pub fn gain_of(
        &self,
        columns: &Columns<'_, '_>,
        layout: &Layout,
        model: &super::score::Trained<'_>,
    ) -> f64 {
        let (base, inverse, base_y) = (&model.base, &model.inverse, &model.base_y);
        let mut fresh = Mat::zeros(columns.rows(), layout.count);
        columns.fill(&[layout], fresh.as_mut());
        let cross_all = transposed_product(self.base_columns.as_ref(), fresh.as_ref());
        let cross = Mat::from_fn(base.len(), layout.count, |i, k| cross_all[(base[i], k)]);
        let own = transposed_product(fresh.as_ref(), fresh.as_ref());
        let solved = inverse * &cross;
        let d = Mat::from_fn(layout.count, layout.count, |k, l| {
            own[(k, l)]
                - (0..base.len())
                    .map(|i| cross[(i, k)] * solved[(i, l)])
                    .sum::<f64>()
        });
        let g: Vec<f64> = (0..layout.count)
            .map(|k| {
                let with_y: f64 = (0..columns.rows())
                    .map(|i| fresh[(i, k)] * self.residual[i])
                    .sum();
                with_y - (0..base.len()).map(|i| solved[(i, k)] * base_y[i]).sum::<f64>()
            })
            .collect();
        super::score::quadratic_gain(&d, &own, &g)
    }

    /// Model, residual and null draws side by side: one product with each chunk of candidates.
    fn side(&self) -> Mat<f64> {
        beside(&self.base_columns, &self.residual, &self.null)
    }

    /// The base columns, rows × base, in the order of the folds.
    pub fn base_columns(&self) -> MatRef<'_, f64> {
        self.base_columns.as_ref()
    }
}

fn beside(model: &Mat<f64>, residual: &[f64], null: &Mat<f64>) -> Mat<f64> {
    let (rank, rows) = (model.ncols(), residual.len());
    let mut side = Mat::zeros(rows, rank + 1 + null.ncols());
    for j in 0..rank {
        side.col_mut(j).copy_from(model.col(j));
    }
    for (i, value) in residual.iter().enumerate() {
        side[(i, rank)] = *value;
    }
    for j in 0..null.ncols() {
        side.col_mut(rank + 1 + j).copy_from(null.col(j));
    }
    side
}

/// For each fold: `sideᵀ · candidates`, and each candidate's product with itself. Candidates are made chunk by chunk, so that memory does not grow
/// with their number.
fn products_by_fold(
    columns: &Columns<'_, '_>,
    layouts: &[Layout],
    side: MatRef<'_, f64>,
) -> Vec<(Mat<f64>, Vec<Mat<f64>>)> {
    type Part = (Mat<f64>, Vec<Mat<f64>>);
    let count: Vec<usize> = layouts.iter().map(|layout| layout.count).collect();
    let total: usize = count.iter().sum();
    let chunks = chunked(&count);
    let parts: Vec<Vec<Part>> = chunks
        .par_iter()
        .map(|chunk| {
            let chosen: Vec<&Layout> = layouts[chunk.clone()].iter().collect();
            let width: usize = chosen.iter().map(|layout| layout.count).sum();
            let mut block = Mat::zeros(columns.rows(), width);
            columns.fill(&chosen, block.as_mut());
            columns
                .fold_rows
                .iter()
                .map(|range| {
                    let part = block.as_ref().subrows(range.start, range.len());
                    let product = transposed_product(side.subrows(range.start, range.len()), part);
                    let mut start = 0;
                    let own = chosen
                        .iter()
                        .map(|layout| {
                            let of = part.subcols(start, layout.count);
                            start += layout.count;
                            transposed_product(of, of)
                        })
                        .collect();
                    (product, own)
                })
                .collect()
        })
        .collect();
    (0..columns.fold_rows.len())
        .map(|fold| {
            let mut whole = Mat::zeros(side.ncols(), total);
            let mut own = Vec::with_capacity(layouts.len());
            let mut column = 0;
            for part in &parts {
                let (product, of_candidates) = &part[fold];
                for j in 0..product.ncols() {
                    whole.col_mut(column + j).copy_from(product.col(j));
                }
                column += product.ncols();
                own.extend(of_candidates.iter().cloned());
            }
            (whole, own)
        })
        .collect()
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
