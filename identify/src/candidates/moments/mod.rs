//! Products of candidates with the model and the residual, for each fold.
//!
//! With these products, the search needs no further pass over the readings. The gain of any candidate added to any
//! model on any set of folds is a small matrix expression. With `X` the model's columns, `y` the residual and `C` a
//! candidate's columns over the training folds,
//! ```text
//! gain = gᵀ D⁻¹ g,   D = CᵀC − CᵀX (XᵀX)⁻¹ XᵀC,   g = Cᵀy − CᵀX (XᵀX)⁻¹ Xᵀy
//! ```
//!
//! `X` begins with an orthonormal basis of the fitted model (priors included), so that the normal equations lose no
//! precision.

mod products;

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use super::columns::{Columns, EffectColumns};
use products::{CandidateChunk, multiply, with_side};

/// Products over one fold.
#[derive(Clone, Debug)]
pub struct FoldMoments {
    /// Base with base: the orthonormal model columns, then those of the added candidates.
    pub base: Mat<f64>,
    /// Base with the residual.
    pub base_y: Vec<f64>,
    /// Residual with itself.
    pub yy: f64,
    /// Base with candidates: base × all candidate columns.
    pub cross: Mat<f64>,
    /// Residual with candidates.
    pub cross_y: Vec<f64>,
    /// Each candidate with itself, count × count.
    pub own: Vec<Mat<f64>>,
}

impl FoldMoments {
    /// The sum over several folds.
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
            sum.own.iter_mut().zip(&fold.own).for_each(|(to, more)| *to += more);
        }
        sum
    }

    /// Adds base columns by their products with the whole base (base × added), with the candidates (added × candidate
    /// columns) and with the residual.
    fn extend_base(&mut self, gram: &Mat<f64>, cross: &Mat<f64>, with_y: impl Iterator<Item = f64>) {
        let base = gram.nrows();
        let old = base - gram.ncols();
        grow(&mut self.base, base, base, |i, j| if j < old { gram[(j, i - old)] } else { gram[(i, j - old)] });
        grow(&mut self.cross, base, cross.ncols(), |i, j| cross[(i - old, j)]);
        self.base_y.extend(with_y);
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
    /// Base with null draws (rows of readings): base × draws.
    pub null_base: Mat<f64>,
    /// First column of each candidate.
    pub first: Vec<usize>,
    /// Number of columns of each candidate.
    pub count: Vec<usize>,
    /// Number of tuned shape numbers of each candidate.
    pub numbers: Vec<usize>,
    chunks: Vec<CandidateChunk>,
    /// Base columns, rows × base. They are kept because the base grows.
    base_columns: Mat<f64>,
    residual: Vec<f64>,
    null: Mat<f64>,
}

/// Increments of the reserved capacity.
const BUFFER_ROWS: usize = 32;
const BUFFER_COLUMNS: usize = 128;

/// Enlarges a matrix and reserves capacity. Candidates and effects are added one at a time, and large matrices are not
/// copied each time.
pub(crate) fn grow(matrix: &mut Mat<f64>, rows: usize, columns: usize, value: impl FnMut(usize, usize) -> f64) {
    matrix.reserve(rows.next_multiple_of(BUFFER_ROWS), columns.next_multiple_of(BUFFER_COLUMNS));
    matrix.resize_with(rows, columns, value);
}

pub(crate) fn transposed_product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut product = Mat::zeros(a.ncols(), b.ncols());
    matmul(product.as_mut(), Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
    product
}

impl Moments {
    /// From the orthonormal model columns (rows × rank), the residual and the null draws (rows × draws). Returns `None`
    /// if `go_on` returns `false`.
    pub fn new(
        columns: &Columns<'_>,
        column_sets: &[&EffectColumns],
        model: Mat<f64>,
        residual: &[f64],
        null: Mat<f64>,
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Option<Moments> {
        let mut first = Vec::with_capacity(column_sets.len());
        let mut total = 0;
        for column_set in column_sets {
            first.push(total);
            total += column_set.count;
        }
        let count: Vec<usize> = column_sets.iter().map(|column_set| column_set.count).collect();
        let rank = model.ncols();
        let side = beside(&model, residual);
        let all = 0..column_sets.len();
        let (chunks, products) = multiply(columns, column_sets, all, &[], (&side, &null), go_on)?;
        let folds = (columns.fold_rows.iter().zip(products.side).zip(products.own))
            .map(|((range, product), own)| {
                let part = side.as_ref().subrows(range.start, range.len());
                let gram = transposed_product(part, part);
                FoldMoments {
                    base: Mat::from_fn(rank, rank, |i, j| gram[(i, j)]),
                    base_y: (0..rank).map(|i| gram[(i, rank)]).collect(),
                    yy: gram[(rank, rank)],
                    cross: product.subrows(0, rank).to_owned(),
                    cross_y: (0..total).map(|j| product[(rank, j)]).collect(),
                    own,
                }
            })
            .collect::<Vec<_>>();
        let null_base = transposed_product(model.as_ref(), null.as_ref());
        let whole = FoldMoments::sum(&folds);
        Some(Moments {
            folds,
            whole,
            null_cross: products.null,
            null_base,
            first,
            count,
            numbers: column_sets.iter().map(|column_set| column_set.numbers).collect(),
            chunks,
            base_columns: model,
            residual: residual.to_vec(),
            null,
        })
    }

    /// Number of base columns.
    pub fn base(&self) -> usize {
        self.base_columns.ncols()
    }

    /// Adds the columns of candidates to the base, each at unit length. Returns their ranges in the base.
    pub fn add_to_base(
        &mut self,
        columns: &Columns<'_>,
        column_sets: &[&EffectColumns],
        candidates: &[usize],
    ) -> Vec<Range<usize>> {
        let chosen: Vec<&EffectColumns> = candidates.iter().map(|candidate| column_sets[*candidate]).collect();
        let added: usize = chosen.iter().map(|column_set| column_set.count).sum();
        let (rows, old) = (columns.rows(), self.base());
        let mut places = Vec::new();
        let mut next = old;
        for column_set in &chosen {
            places.push(next..next + column_set.count);
            next += column_set.count;
        }
        if added == 0 {
            return places;
        }
        let fresh = unit_columns(columns, &chosen);
        grow(&mut self.base_columns, rows, next, |i, j| fresh[(i, j - old)]);
        let products = with_side(&self.chunks, columns, column_sets, fresh.as_ref());
        let null_fresh = transposed_product(fresh.as_ref(), self.null.as_ref());
        let draws = self.null.ncols();
        grow(&mut self.null_base, next, draws, |i, d| null_fresh[(i - old, d)]);
        let total = self.null_cross.ncols();
        for (fold, range) in columns.fold_rows.iter().enumerate() {
            let moments = &mut self.folds[fold];
            let fresh_part = fresh.as_ref().subrows(range.start, range.len());
            let base_part = self.base_columns.as_ref().subrows(range.start, range.len());
            let gram = transposed_product(base_part, fresh_part);
            let with_y = |j: usize| range.clone().map(|i| fresh[(i, j)] * self.residual[i]).sum();
            moments.extend_base(&gram, &products[fold], (0..added).map(with_y));
        }
        self.accumulate_totals(next, total);
        places
    }

    /// Computes the products of those effects in `column_sets` that are not yet candidates.
    pub fn append(&mut self, columns: &Columns<'_>, column_sets: &[&EffectColumns]) {
        let rank = self.base();
        let side = beside(&self.base_columns, &self.residual);
        let candidates = self.count.len()..column_sets.len();
        let beside = (&side, &self.null);
        let Some((fresh, products)) =
            multiply(columns, column_sets, candidates.clone(), &self.chunks, beside, &|| true)
        else {
            return;
        };
        let draws = self.null.ncols();
        let total = self.null_cross.ncols();
        let mut added = 0;
        for column_set in &column_sets[candidates] {
            self.first.push(total + added);
            self.count.push(column_set.count);
            self.numbers.push(column_set.numbers);
            added += column_set.count;
        }
        self.chunks.extend(fresh);
        let of_null = products.null;
        for ((moments, product), own) in self.folds.iter_mut().zip(products.side).zip(products.own) {
            grow(&mut moments.cross, rank, total + added, |i, j| product[(i, j - total)]);
            moments.cross_y.extend((0..added).map(|k| product[(rank, k)]));
            moments.own.extend(own);
        }
        self.accumulate_totals(rank, total + added);
        grow(&mut self.null_cross, draws, total + added, |d, j| of_null[(d, j - total)]);
    }

    /// Extends the products over all folds to the present number of base columns and candidate columns.
    fn accumulate_totals(&mut self, base: usize, total: usize) {
        let (folds, whole) = (&self.folds, &mut self.whole);
        grow(&mut whole.base, base, base, |i, j| folds.iter().map(|fold| fold.base[(i, j)]).sum());
        grow(&mut whole.cross, base, total, |i, j| folds.iter().map(|fold| fold.cross[(i, j)]).sum());
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

    /// The base columns, rows × base, in fold order.
    pub fn base_columns(&self) -> MatRef<'_, f64> {
        self.base_columns.as_ref()
    }

    /// The residual in fold order: rows × 1.
    pub fn residual(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.residual, self.residual.len(), 1)
    }
}

/// The columns of effects, each at unit length.
fn unit_columns(columns: &Columns<'_>, column_sets: &[&EffectColumns]) -> Mat<f64> {
    let width = column_sets.iter().map(|column_set| column_set.count).sum();
    let mut fresh = Mat::zeros(columns.rows(), width);
    columns.fill(column_sets, fresh.as_mut());
    for j in 0..width {
        let norm = fresh.col(j).norm_l2();
        if norm > 0.0 {
            for i in 0..columns.rows() {
                fresh[(i, j)] /= norm;
            }
        }
    }
    fresh
}

/// Model and residual side by side, so that one product with each chunk of candidates is enough.
fn beside(model: &Mat<f64>, residual: &[f64]) -> Mat<f64> {
    let rank = model.ncols();
    let mut side = Mat::zeros(residual.len(), rank + 1);
    side.as_mut().subcols_mut(0, rank).copy_from(model);
    for (i, value) in residual.iter().enumerate() {
        side[(i, rank)] = *value;
    }
    side
}
