//! Least squares as a stream: whatever the number of rows, what remains of them is one triangle.
//!
//! The augmented matrix `[J | r]` is reduced block by block by Householder QR (tall-skinny QR: Demmel, Grigori, Hoemmen, Langou, SIAM J. Sci.
//! Comput. 34 (2012) A206), so that memory does not grow with the number of readings and two triangles of different readings merge into one.
//! With `[J | r] = Q·[R c; 0 ρ]` the sum of squares at a step `δ` is `‖c − Rδ‖² + ρ²`.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor;
use faer::{Mat, MatRef, Par};

/// The triangle `[R c; 0 ρ]` of the rows absorbed so far.
#[derive(Clone, Debug)]
pub struct Triangle {
    columns: usize,
    /// Rows that are worth the triangle: not yet reduced to it as long as they are few.
    factor: Mat<f64>,
}

/// Rows absorbed at once: enough for the QR to work in blocks, few enough to stay in cache.
pub const BLOCK_ROWS: usize = 1024;

impl Triangle {
    /// Of no rows, for this many unknowns.
    pub fn new(columns: usize) -> Self {
        Triangle {
            columns,
            factor: Mat::zeros(0, columns + 1),
        }
    }

    /// Number of unknowns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Adds rows: `block` is rows × (unknowns + 1), residuals in the last column.
    pub fn absorb(&mut self, block: MatRef<'_, f64>) {
        if block.nrows() == 0 {
            return;
        }
        let kept = self.factor.nrows();
        let width = self.columns + 1;
        let mut stacked = Mat::zeros(kept + block.nrows(), width);
        stacked.get_mut(..kept, ..).copy_from(&self.factor);
        stacked.get_mut(kept.., ..).copy_from(block);
        // Many small pieces, as folds of many tests are, are reduced a width of them at a time.
        self.factor = if stacked.nrows() <= 2 * width {
            stacked
        } else {
            upper(stacked)
        };
    }

    /// Rows of `[J | r]` that are worth those absorbed: some × (unknowns + 1).
    pub fn rows(&self) -> MatRef<'_, f64> {
        self.factor.as_ref()
    }

    /// Adds the rows of another triangle.
    pub fn merge(&mut self, other: &Triangle) {
        self.absorb(other.factor.as_ref());
    }

    /// The same rows for more unknowns: `places` says which of them these are; the rows do not depend on the others.
    pub fn among(&self, places: &[usize], columns: usize) -> Triangle {
        let mut wide = Mat::zeros(self.factor.nrows(), columns + 1);
        for (place, column) in places.iter().chain([&columns]).zip(self.factor.col_iter()) {
            wide.col_mut(*place).copy_from(column);
        }
        let mut triangle = Triangle::new(columns);
        triangle.absorb(wide.as_ref());
        triangle
    }

    /// The same triangle with few rows made upper-triangular, so that `R`, `c`, `ρ` can be read off.
    fn reduced(&self) -> Mat<f64> {
        let width = self.columns + 1;
        if self.factor.nrows() == width && (0..width).all(|i| (0..i).all(|j| self.factor[(i, j)] == 0.0)) {
            return self.factor.clone();
        }
        let rows = self.factor.nrows().max(width);
        let padded = Mat::from_fn(rows, width, |i, j| {
            if i < self.factor.nrows() {
                self.factor[(i, j)]
            } else {
                0.0
            }
        });
        upper(padded)
    }

    /// `R` (unknowns × unknowns), `c`, and the sum of squares `ρ²` that no step can remove.
    pub fn parts(&self) -> (Mat<f64>, Vec<f64>, f64) {
        let reduced = self.reduced();
        let n = self.columns;
        let r = Mat::from_fn(n, n, |i, j| reduced[(i, j)]);
        let c = (0..n).map(|i| reduced[(i, n)]).collect();
        (r, c, reduced[(n, n)] * reduced[(n, n)])
    }

    /// The triangle after a step `δ` that is too small for the model to bend: `[R c−Rδ; 0 ρ]`.
    pub fn after(&self, step: &[f64]) -> Triangle {
        let mut moved = self.clone();
        for i in 0..moved.factor.nrows() {
            let predicted: f64 = (0..self.columns).map(|j| self.factor[(i, j)] * step[j]).sum();
            moved.factor[(i, self.columns)] -= predicted;
        }
        moved
    }

    /// The sum of squares of the rows after a step `δ`.
    pub fn sum_of_squares_after(&self, step: &[f64]) -> f64 {
        (0..self.factor.nrows())
            .map(|i| {
                let predicted: f64 = (0..self.columns).map(|j| self.factor[(i, j)] * step[j]).sum();
                (self.factor[(i, self.columns)] - predicted).powi(2)
            })
            .sum()
    }
}

/// The triangle `R` of a matrix `Q·R` with at least as many rows as columns.
///
/// Few columns are reduced one at a time: blocks of them, with which the library's own choice begins at sixteen columns, take two to four times as
/// long up to some forty.
pub(crate) fn upper(mut matrix: Mat<f64>) -> Mat<f64> {
    let (rows, columns) = (matrix.nrows(), matrix.ncols());
    let together = if columns < 40 { 1 } else { 16 };
    let mut reflections = Mat::zeros(together, columns);
    let scratch = factor::qr_in_place_scratch::<f64>(rows, columns, together, Par::Seq, Default::default());
    factor::qr_in_place(
        matrix.as_mut(),
        reflections.as_mut(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    );
    Mat::from_fn(columns, columns, |i, j| if i <= j { matrix[(i, j)] } else { 0.0 })
}
