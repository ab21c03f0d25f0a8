//! The triangular factor of a least-squares problem, built from a stream of rows.
//!
//! Householder QR reduces the augmented matrix `[J | r]` block by block (tall-skinny QR: Demmel, Grigori, Hoemmen,
//! Langou, SIAM J. Sci. Comput. 34 (2012) A206). Memory does not grow with the number of readings. The factors of
//! different readings merge into one. With `[J | r] = Q·[R c; 0 ρ]` the sum of squares after a step `δ` is
//! `‖c − Rδ‖² + ρ²`.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor;
use faer::{Mat, MatRef, Par};

use super::reflections;

/// The triangular factor `[R c; 0 ρ]` of the rows absorbed so far.
#[derive(Clone, Debug)]
pub struct Triangle {
    columns: usize,
    /// Rows with the same normal matrix as the absorbed rows. They are reduced to triangular form only when they are
    /// many.
    factor: Mat<f64>,
}

/// Number of rows to absorb at once: enough for blocked QR, few enough for the cache.
pub(crate) const BLOCK_ROWS: usize = 1024;

impl Triangle {
    /// The factor of no rows, for the given number of parameters.
    pub fn new(columns: usize) -> Self {
        Triangle { columns, factor: Mat::zeros(0, columns + 1) }
    }

    /// The factor of some rows of `[J | r]`.
    pub fn of(rows: Mat<f64>) -> Self {
        let mut triangle = Triangle::new(rows.ncols() - 1);
        triangle.absorb(rows.as_ref());
        triangle
    }

    /// Number of parameters.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Absorbs rows: `block` is rows × (parameters + 1), residuals in the last column.
    pub fn absorb(&mut self, block: MatRef<'_, f64>) {
        if block.nrows() == 0 {
            return;
        }
        let kept = self.factor.nrows();
        let width = self.columns + 1;
        // Small blocks (folds of many tests) are collected until they are twice as many as the columns, then reduced
        // together. The factor grows by doubling, so that a block does not copy those before it.
        if kept + block.nrows() <= 2 * width {
            if self.factor.col_stride().unsigned_abs() < kept + block.nrows() {
                self.factor.reserve((kept + block.nrows()).max((2 * kept).min(2 * width)), width);
            }
            self.factor.resize_with(kept + block.nrows(), width, |_, _| 0.0);
            self.factor.get_mut(kept.., ..).copy_from(block);
            return;
        }
        if width < BLOCKED {
            if !self.is_triangular() {
                self.factor = upper(std::mem::replace(&mut self.factor, Mat::new()));
            }
            return reflections::absorb(&mut self.factor, block);
        }
        // A high block is reduced before it is stacked.
        let reduced = (block.nrows() > 8 * width).then(|| upper(block.to_owned()));
        let block = reduced.as_ref().map_or(block, Mat::as_ref);
        let mut stacked = Mat::zeros(kept + block.nrows(), width);
        stacked.get_mut(..kept, ..).copy_from(&self.factor);
        stacked.get_mut(kept.., ..).copy_from(block);
        self.factor = upper(stacked);
    }

    /// Whether the factor is reduced to triangular form.
    fn is_triangular(&self) -> bool {
        let width = self.columns + 1;
        self.factor.nrows() == width && (0..width).all(|j| (j + 1..width).all(|i| self.factor[(i, j)] == 0.0))
    }

    /// Rows of `[J | r]` with the same normal matrix as the absorbed rows: any number × (parameters + 1).
    pub fn rows(&self) -> MatRef<'_, f64> {
        self.factor.as_ref()
    }

    /// Absorbs the rows of another factor.
    pub fn merge(&mut self, other: &Triangle) {
        self.absorb(other.factor.as_ref());
    }

    /// This factor with others merged into it.
    pub fn merged<'t>(mut self, others: impl IntoIterator<Item = &'t Triangle>) -> Triangle {
        others.into_iter().for_each(|triangle| self.merge(triangle));
        self
    }

    /// The same rows over more parameters. `indices` gives the index of each of these parameters among all; the rows do
    /// not depend on the others.
    pub fn over_columns(&self, indices: &[usize], columns: usize) -> Triangle {
        let mut wide = Mat::zeros(self.factor.nrows(), columns + 1);
        for (index, column) in indices.iter().chain([&columns]).zip(self.factor.col_iter()) {
            wide.col_mut(*index).copy_from(column);
        }
        Triangle::of(wide)
    }

    /// The upper-triangular form `[R c; 0 ρ]`: (parameters + 1) × (parameters + 1).
    pub(crate) fn reduced(&self) -> Mat<f64> {
        if self.is_triangular() { self.factor.clone() } else { upper(self.factor.clone()) }
    }

    /// `R` (parameters × parameters), `c`, and the minimum `ρ²` of the sum of squares.
    pub fn parts(&self) -> (Mat<f64>, Vec<f64>, f64) {
        let reduced = self.reduced();
        let n = self.columns;
        let r = Mat::from_fn(n, n, |i, j| reduced[(i, j)]);
        let c = (0..n).map(|i| reduced[(i, n)]).collect();
        (r, c, reduced[(n, n)] * reduced[(n, n)])
    }

    /// `R`: parameters × parameters.
    pub fn r(&self) -> Mat<f64> {
        self.parts().0
    }

    /// The factor after a step `δ` with negligible nonlinearity: `[R c−Rδ; 0 ρ]`.
    pub fn after(&self, step: &[f64]) -> Triangle {
        let mut moved = self.clone();
        for i in 0..moved.factor.nrows() {
            let predicted: f64 = (0..self.columns).map(|j| self.factor[(i, j)] * step[j]).sum();
            moved.factor[(i, self.columns)] -= predicted;
        }
        moved
    }

    /// The sum of squares of the residuals.
    pub fn sum_of_squares(&self) -> f64 {
        self.factor.col(self.columns).iter().map(|residual| residual * residual).sum()
    }
}

/// Number of columns from which reflections are applied in blocks: below, this takes two to four times as long.
const BLOCKED: usize = 40;
/// Number of columns of such a block.
const BLOCK_COLUMNS: usize = 16;

/// The factor `R` of a matrix `Q·R`: columns × columns.
pub fn upper(mut matrix: Mat<f64>) -> Mat<f64> {
    let columns = matrix.ncols();
    if columns < BLOCKED {
        let mut factor = Mat::zeros(columns, columns);
        reflections::absorb(&mut factor, matrix.as_ref());
        return factor;
    }
    let rows = matrix.nrows().max(columns);
    matrix.resize_with(rows, columns, |_, _| 0.0);
    let mut reflections = Mat::zeros(BLOCK_COLUMNS, columns);
    let scratch = factor::qr_in_place_scratch::<f64>(rows, columns, BLOCK_COLUMNS, Par::Seq, Default::default());
    factor::qr_in_place(
        matrix.as_mut(),
        reflections.as_mut(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    );
    Mat::from_fn(columns, columns, |i, j| if i <= j { matrix[(i, j)] } else { 0.0 })
}
