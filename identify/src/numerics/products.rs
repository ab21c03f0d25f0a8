//! The normal equations of a least-squares problem, built from a stream of rows.
//!
//! `[J | r]ᵀ[J | r]` takes about a third of the operations of the triangular factor, and squares the condition number.
//! It serves where priors determine what the readings do not, and where models are compared. It does not serve the
//! decision on a rank.

use std::borrow::Cow;

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par};

use super::triangle::Triangle;

/// What rows `[J | r]` are reduced to, block by block.
pub trait RowSum: Clone + Send + Sync {
    /// No rows, for the given number of parameters.
    fn new(columns: usize) -> Self;
    /// Adds rows: `block` is rows × (parameters + 1), residuals in the last column.
    fn absorb(&mut self, block: MatRef<'_, f64>);
    /// Adds the rows of another sum.
    fn merge(&mut self, other: &Self);
    /// The same rows over more parameters: `indices` gives the index of each of these parameters among all.
    fn over_columns(&self, indices: &[usize], columns: usize) -> Self;
}

impl RowSum for Triangle {
    fn new(columns: usize) -> Self {
        Triangle::new(columns)
    }

    fn absorb(&mut self, block: MatRef<'_, f64>) {
        Triangle::absorb(self, block);
    }

    fn merge(&mut self, other: &Self) {
        Triangle::merge(self, other);
    }

    fn over_columns(&self, indices: &[usize], columns: usize) -> Self {
        Triangle::over_columns(self, indices, columns)
    }
}

/// The normal equations of readings `y = J b + e`.
#[derive(Clone, Debug)]
pub struct NormalProducts {
    /// `JᵀJ`: parameters × parameters.
    pub gram: Mat<f64>,
    /// `Jᵀy`.
    pub projection: Vec<f64>,
    /// `yᵀy`.
    pub square: f64,
}

impl NormalProducts {
    /// Those of no readings.
    pub fn none(parameters: usize) -> NormalProducts {
        NormalProducts { gram: Mat::zeros(parameters, parameters), projection: vec![0.0; parameters], square: 0.0 }
    }

    /// Adds those of other readings.
    pub fn add(&mut self, other: &NormalProducts) {
        self.gram += &other.gram;
        self.projection.iter_mut().zip(&other.projection).for_each(|(sum, more)| *sum += more);
        self.square += other.square;
    }

    /// Those of the readings at other units of the parameters, `b_j = sizes_j x_j`, and `y` with what the parameters
    /// `present` predict, in these units.
    pub fn in_sizes(&self, sizes: &[f64], present: &[f64]) -> NormalProducts {
        let count = sizes.len();
        let gram = Mat::from_fn(count, count, |i, j| self.gram[(i, j)] * sizes[i] * sizes[j]);
        let along = &gram * Mat::from_fn(count, 1, |j, _| present[j]);
        let residual: Vec<f64> =
            self.projection.iter().zip(sizes).map(|(projection, size)| projection * size).collect();
        let shift = |j: usize| present[j] * (2.0 * residual[j] + along[(j, 0)]);
        NormalProducts {
            square: self.square + (0..count).map(shift).sum::<f64>(),
            projection: (0..count).map(|j| residual[j] + along[(j, 0)]).collect(),
            gram,
        }
    }

    /// Those of some of the parameters.
    pub fn of_parameters(&self, some: &[usize]) -> NormalProducts {
        NormalProducts {
            gram: Mat::from_fn(some.len(), some.len(), |i, j| self.gram[(some[i], some[j])]),
            projection: some.iter().map(|j| self.projection[*j]).collect(),
            square: self.square,
        }
    }

    /// `‖y − J b‖²`.
    pub fn residual_square(&self, b: &[f64]) -> f64 {
        let mut square = self.square;
        for (j, value) in b.iter().enumerate() {
            let along: f64 = self.gram.col_as_slice(j).iter().zip(b).map(|(g, b)| g * b).sum();
            square += value * (along - 2.0 * self.projection[j]);
        }
        square.max(0.0)
    }
}

/// `[J | r]ᵀ[J | r]` of the rows absorbed so far.
#[derive(Clone, Debug)]
pub struct Products {
    /// The lower triangle: (parameters + 1) × (parameters + 1).
    lower: Mat<f64>,
    /// Rows that are not multiplied yet: [`ROWS_AT_ONCE`] × (parameters + 1), of which `waiting` hold values.
    rows: Mat<f64>,
    waiting: usize,
}

/// Number of rows that are multiplied at once, so that the products are read and written seldom.
const ROWS_AT_ONCE: usize = 256;

impl Products {
    /// The normal equations, with the residual as `y`.
    pub fn normal(&self) -> NormalProducts {
        let lower = self.multiplied();
        let n = lower.nrows() - 1;
        NormalProducts {
            gram: Mat::from_fn(n, n, |i, j| lower[(i.max(j), i.min(j))]),
            projection: (0..n).map(|j| lower[(n, j)]).collect(),
            square: lower[(n, n)],
        }
    }

    /// The lower triangle with the waiting rows.
    fn multiplied(&self) -> Cow<'_, Mat<f64>> {
        if self.waiting == 0 {
            return Cow::Borrowed(&self.lower);
        }
        let mut lower = self.lower.clone();
        add(&mut lower, self.rows.get(..self.waiting, ..));
        Cow::Owned(lower)
    }
}

/// Adds the products of rows to a lower triangle.
fn add(to: &mut Mat<f64>, rows: MatRef<'_, f64>) {
    let lower = BlockStructure::TriangularLower;
    let all = BlockStructure::Rectangular;
    matmul(to.as_mut(), lower, Accum::Add, rows.transpose(), all, rows, all, 1.0, Par::Seq);
}

impl RowSum for Products {
    fn new(columns: usize) -> Self {
        Products { lower: Mat::zeros(columns + 1, columns + 1), rows: Mat::zeros(0, 0), waiting: 0 }
    }

    fn absorb(&mut self, block: MatRef<'_, f64>) {
        if self.waiting > 0 && self.waiting + block.nrows() > ROWS_AT_ONCE {
            add(&mut self.lower, self.rows.get(..self.waiting, ..));
            self.waiting = 0;
        }
        if block.nrows() > ROWS_AT_ONCE {
            return add(&mut self.lower, block);
        }
        if self.rows.nrows() == 0 {
            self.rows = Mat::zeros(ROWS_AT_ONCE, self.lower.ncols());
        }
        self.rows.get_mut(self.waiting..self.waiting + block.nrows(), ..).copy_from(block);
        self.waiting += block.nrows();
    }

    fn merge(&mut self, other: &Self) {
        self.lower += &other.lower;
        if other.waiting > 0 {
            self.absorb(other.rows.get(..other.waiting, ..));
        }
    }

    fn over_columns(&self, indices: &[usize], columns: usize) -> Self {
        let own = self.multiplied();
        let places: Vec<usize> = indices.iter().copied().chain([columns]).collect();
        let mut wide = Products::new(columns);
        for (j, column) in places.iter().enumerate() {
            for (i, row) in places.iter().enumerate().skip(j) {
                wide.lower[(*row.max(column), *row.min(column))] = own[(i, j)];
            }
        }
        wide
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// Blocks below and above the number of rows at once, merged, and spread over more parameters in another order.
    #[test]
    fn the_products_of_blocks_are_those_of_all_rows() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        let (columns, indices) = (9, [7, 2, 4]);
        let mut all: Vec<[f64; 4]> = Vec::new();
        let mut sums = [Products::new(3), Products::new(3)];
        for (k, count) in [3, 300, 0, 255, 20, 257].into_iter().enumerate() {
            let rows: Vec<[f64; 4]> =
                (0..count).map(|_| std::array::from_fn(|_| random.random_range(-1.0..1.0))).collect();
            sums[k % 2].absorb(Mat::from_fn(count, 4, |i, j| rows[i][j]).as_ref());
            all.extend(rows);
        }
        let [mut sum, other] = sums;
        sum.merge(&other);
        let NormalProducts { gram, projection, square } = sum.over_columns(&indices, columns).normal();
        let product = |a: usize, b: usize| all.iter().map(|row| row[a] * row[b]).sum::<f64>();
        let place = |j: usize| indices.iter().position(|index| *index == j);
        for i in 0..columns {
            for j in 0..columns {
                let expected = place(i).zip(place(j)).map_or(0.0, |(a, b)| product(a, b));
                assert!((gram[(i, j)] - expected).abs() < 1e-10, "{i} {j}");
            }
            assert!((projection[i] - place(i).map_or(0.0, |a| product(a, 3))).abs() < 1e-10, "{i}");
        }
        assert!((square - product(3, 3)).abs() < 1e-10);
    }
}
