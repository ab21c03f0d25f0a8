//! Solutions of linear systems: the singular values of a matrix, and what follows from them.

use abbe_model::Diagnostic;
use faer::prelude::Solve;
use faer::{Mat, MatRef};

use super::tolerances::{MIN_IDENTIFIABLE, ROUNDING};
use crate::error;

/// A matrix `A = U·S·Vᵀ` with its singular values in descending order.
pub struct Svd {
    left: Mat<f64>,
    right: Mat<f64>,
    /// The singular values.
    pub singular_values: Vec<f64>,
}

impl Svd {
    /// Of a matrix.
    ///
    /// # Errors
    /// If the matrix has entries that are not finite.
    pub fn of(matrix: MatRef<'_, f64>) -> Result<Svd, Diagnostic> {
        if !matrix.is_all_finite() {
            return Err(error::decomposition());
        }
        // The iteration of the decomposition ends without convergence at few finite matrices (one of 39 parameters in some
        // thousand traces). That of the transposed matrix, or of the rows in reverse order, takes another course.
        Svd::directly(matrix)
            .or_else(|| Svd::directly(matrix.transpose()).map(Svd::transposed))
            .or_else(|| Svd::directly(matrix.reverse_rows()).map(Svd::with_reversed_rows))
            .ok_or_else(error::decomposition)
    }

    fn directly(matrix: MatRef<'_, f64>) -> Option<Svd> {
        let svd = matrix.thin_svd().ok()?;
        let singular_values = svd.S().column_vector().iter().copied().collect();
        Some(Svd { left: svd.U().to_owned(), right: svd.V().to_owned(), singular_values })
    }

    /// The decomposition of the transposed matrix.
    fn transposed(self) -> Svd {
        Svd { left: self.right, right: self.left, ..self }
    }

    /// The decomposition of the matrix with its rows in reverse order.
    fn with_reversed_rows(self) -> Svd {
        Svd { left: self.left.as_ref().reverse_rows().to_owned(), ..self }
    }

    /// The left singular vectors `U`, one column each.
    pub fn left(&self) -> MatRef<'_, f64> {
        self.left.as_ref()
    }

    /// The right singular vectors `V`, one column each.
    pub fn right(&self) -> MatRef<'_, f64> {
        self.right.as_ref()
    }

    /// Number of singular values above a share of the largest.
    pub fn rank(&self, share: f64) -> usize {
        let largest = self.singular_values.first().copied().unwrap_or(0.0);
        self.singular_values.iter().filter(|s| **s > share * largest).count()
    }

    /// Number of singular values above rounding, which grows with the number of columns.
    pub fn numerical_rank(&self) -> usize {
        self.rank(ROUNDING * self.right().nrows() as f64)
    }

    /// Number of singular values of at least some size.
    pub fn rank_above(&self, least: f64) -> usize {
        self.singular_values.iter().filter(|s| **s >= least).count()
    }

    /// Number of singular values, in standard deviations per physical size, that are identifiable and above rounding.
    pub fn identifiable_rank(&self) -> usize {
        self.rank_above(MIN_IDENTIFIABLE).min(self.numerical_rank())
    }

    /// The solution of least norm of `min ‖c − A·x‖² + damping·‖x‖²`. Directions below rounding are excluded.
    pub fn solve(&self, c: &[f64], damping: f64) -> Vec<f64> {
        let mut solution = vec![0.0; self.right().nrows()];
        for (k, s) in self.singular_values.iter().enumerate().take(self.numerical_rank()) {
            let projected: f64 = self.left().col(k).iter().zip(c).map(|(u, c)| u * c).sum();
            let gain = s * projected / (s * s + damping);
            solution.iter_mut().zip(self.right().col(k).iter()).for_each(|(x, v)| *x += v * gain);
        }
        solution
    }

    /// The solution of least norm of `min ‖c − A·x‖²` over the identifiable directions.
    pub fn solve_identifiable(&self, c: &[f64]) -> Vec<f64> {
        let mut solution = vec![0.0; self.right().nrows()];
        for k in 0..self.identifiable_rank() {
            let projected: f64 = self.left().col(k).iter().zip(c).map(|(u, c)| u * c).sum();
            let along = projected / self.singular_values[k];
            solution.iter_mut().zip(self.right().col(k).iter()).for_each(|(x, v)| *x += v * along);
        }
        solution
    }

    /// By how much the undamped solution lowers `‖c − A·x‖²`.
    pub fn explained(&self, c: &[f64]) -> f64 {
        let along = |k: usize| self.left().col(k).iter().zip(c).map(|(u, c)| u * c).sum::<f64>();
        (0..self.numerical_rank()).map(|k| along(k).powi(2)).sum()
    }

    /// `A⁺` over the singular values of at least some size.
    pub fn pseudo_inverse_above(&self, least: f64) -> Mat<f64> {
        let rank = self.rank_above(least);
        let scaled = Mat::from_fn(self.right.nrows(), rank, |i, k| self.right[(i, k)] / self.singular_values[k]);
        scaled * self.left.subcols(0, rank).transpose()
    }

    /// `W` with `W·Wᵀ = (AᵀA)⁻¹`: the right singular vectors over the singular values. Columns of directions below
    /// rounding are zero.
    pub fn inverse_root(&self) -> Mat<f64> {
        let (v, rank) = (self.right(), self.numerical_rank());
        let entry = |i: usize, k: usize| if k < rank { v[(i, k)] / self.singular_values[k] } else { 0.0 };
        Mat::from_fn(v.nrows(), self.singular_values.len(), entry)
    }

    /// `A⁺`: the matrix that gives the least-squares solution of least norm.
    pub fn pseudo_inverse(&self) -> Mat<f64> {
        self.inverse_root() * self.left().transpose()
    }
}

/// `A⁻¹ B` of a regular square matrix.
pub fn solve_square(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    a.partial_piv_lu().solve(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The solution of the normal equations, written out for two columns.
    #[test]
    fn solution_and_covariance_are_those_of_the_normal_equations() {
        let a = Mat::from_fn(4, 2, |i, j| if j == 0 { 1.0 } else { i as f64 });
        let c = [1.0, 3.0, 2.0, 5.0];
        let directions = Svd::of(a.as_ref()).unwrap();
        let found = directions.solve(&c, 0.0);
        // Mean 2.75 at the mean abscissa 1.5, and the slope 5.5/5.
        assert!((found[1] - 1.1).abs() < 1e-12 && (found[0] - (2.75 - 1.5 * 1.1)).abs() < 1e-12, "{found:?}");
        // Of the sum of squares 39 the residual keeps 8.75 - 5.5²/5.
        assert!((directions.explained(&c) - (39.0 - 2.7)).abs() < 1e-12);
        let root = directions.inverse_root();
        let covariance = &root * root.transpose();
        for (place, expected) in [((0, 0), 14.0 / 20.0), ((0, 1), -6.0 / 20.0), ((1, 1), 4.0 / 20.0)] {
            assert!((covariance[place] - expected).abs() < 1e-12);
        }
        let inverse = directions.pseudo_inverse();
        for k in 0..2 {
            let of_inverse: f64 = (0..4).map(|i| inverse[(k, i)] * c[i]).sum();
            assert!((of_inverse - found[k]).abs() < 1e-12);
        }
    }

    /// The ways around a decomposition that does not converge give the matrix again.
    #[test]
    fn every_way_gives_the_matrix_again() {
        let a = Mat::from_fn(5, 3, |i, j| ((3 * i + 7 * j * j + i * j) as f64).sin());
        let ways = [
            Svd::directly(a.as_ref()).unwrap(),
            Svd::directly(a.transpose()).map(Svd::transposed).unwrap(),
            Svd::directly(a.as_ref().reverse_rows()).map(Svd::with_reversed_rows).unwrap(),
        ];
        for way in ways {
            let scaled = Mat::from_fn(5, 3, |i, k| way.left()[(i, k)] * way.singular_values[k]);
            let difference = scaled * way.right().transpose() - &a;
            assert!(difference.norm_max() < 1e-14, "{difference:?}");
        }
        let mut broken = a;
        broken[(2, 1)] = f64::NAN;
        assert_eq!(Svd::of(broken.as_ref()).err(), Some(error::decomposition()));
    }

    /// The third column is the sum of the first two; of all solutions, the one of least norm is returned. A matrix
    /// without columns has no directions.
    #[test]
    fn dependent_columns_have_the_solution_of_least_norm() {
        let a = Mat::from_fn(3, 3, |i, j| [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]][i][j]);
        let directions = Svd::of(a.as_ref()).unwrap();
        assert_eq!(directions.numerical_rank(), 2);
        let found = directions.solve(&[1.0, 1.0, 7.0], 0.0);
        for (found, expected) in found.iter().zip([1.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0]) {
            assert!((found - expected).abs() < 1e-12, "{found}");
        }
        let none = Svd::of(Mat::<f64>::zeros(3, 0).as_ref()).unwrap();
        assert_eq!((none.numerical_rank(), none.solve(&[1.0; 3], 0.0).len()), (0, 0));
    }
}
