//! Eigenvalues of symmetric matrices.

use abbe_model::Diagnostic;
use faer::{Mat, MatRef, Side};

use super::tolerances::ROUNDING_OF_SQUARES;
use crate::error;

/// The eigenvalues of a symmetric matrix in ascending order, and its eigenvectors, one column each.
pub struct Symmetric {
    /// The eigenvalues.
    pub values: Vec<f64>,
    /// The eigenvectors.
    pub vectors: Mat<f64>,
}

impl Symmetric {
    /// Of a symmetric matrix, of which the lower triangle is read.
    ///
    /// # Errors
    /// If the matrix has entries that are not finite.
    pub fn of(matrix: MatRef<'_, f64>) -> Result<Symmetric, Diagnostic> {
        match matrix.nrows() {
            0..3 if !matrix.is_all_finite() => Err(error::decomposition()),
            0 => Ok(Symmetric { values: Vec::new(), vectors: Mat::new() }),
            1 => Ok(Symmetric { values: vec![matrix[(0, 0)]], vectors: Mat::identity(1, 1) }),
            2 => Ok(Symmetric::of_two(matrix)),
            _ => {
                let eigen = matrix.self_adjoint_eigen(Side::Lower).map_err(|_| error::decomposition())?;
                let values = eigen.S().column_vector().iter().copied().collect();
                Ok(Symmetric { values, vectors: eigen.U().to_owned() })
            }
        }
    }

    fn of_two(matrix: MatRef<'_, f64>) -> Symmetric {
        let [low, high] = eigen_of_two(matrix[(0, 0)], matrix[(1, 0)], matrix[(1, 1)]);
        Symmetric {
            values: vec![low.0, high.0],
            vectors: Mat::from_fn(2, 2, |i, k| if k == 0 { low.1[i] } else { high.1[i] }),
        }
    }

    /// The smallest and the largest eigenvalue; zeros of a matrix without rows.
    pub fn extremes(&self) -> [f64; 2] {
        [self.values.first(), self.values.last()].map(|value| value.copied().unwrap_or(0.0))
    }
}

/// The eigenvalues of `[[a, b], [b, c]]` in ascending order with their vectors, as sine and cosine have them: one Jacobi
/// rotation (Golub & Van Loan, section 8.5).
pub(crate) fn eigen_of_two(a: f64, b: f64, c: f64) -> [(f64, [f64; 2]); 2] {
    let tangent = if b == 0.0 {
        0.0
    } else {
        let tau = (c - a) / (2.0 * b);
        tau.signum() / (tau.abs() + 1.0_f64.hypot(tau))
    };
    let cos = 1.0 / 1.0_f64.hypot(tangent);
    let sin = tangent * cos;
    let pairs = [(a - tangent * b, [cos, -sin]), (c + tangent * b, [sin, cos])];
    if pairs[0].0 <= pairs[1].0 { pairs } else { [pairs[1], pairs[0]] }
}

/// Inverse of a product `XᵀX`. Directions below rounding are excluded.
///
/// # Errors
/// If the product has entries that are not finite.
pub fn pseudo_inverse(gram: MatRef<'_, f64>) -> Result<Mat<f64>, Diagnostic> {
    let Symmetric { values, vectors } = Symmetric::of(gram)?;
    let least = values.iter().fold(0.0_f64, |a, b| a.max(*b)) * ROUNDING_OF_SQUARES;
    let entry = |i: usize, k: usize| if values[k] > least { vectors[(i, k)] / values[k] } else { 0.0 };
    let scaled = Mat::from_fn(gram.nrows(), values.len(), entry);
    Ok(&scaled * vectors.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pseudo_inverse_inverts_the_product_on_its_range() {
        // Rank 2: the third column is the sum of the first two.
        let columns = Mat::from_fn(4, 3, |i, j| {
            let of = |j: usize| ((i + 1) as f64).powi(j as i32);
            if j < 2 { of(j) } else { of(0) + of(1) }
        });
        let gram = columns.transpose() * &columns;
        let inverse = pseudo_inverse(gram.as_ref()).unwrap();
        let again = &gram * &inverse * &gram;
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            assert!((again[(i, j)] - gram[(i, j)]).abs() < 1e-9);
        }
    }

    #[test]
    fn non_finite_entries_are_an_error() {
        for size in 1..4 {
            let gram = Mat::from_fn(size, size, |i, j| if i + j + 1 == size { f64::NAN } else { 1.0 });
            assert_eq!(pseudo_inverse(gram.as_ref()).err(), Some(error::decomposition()));
        }
    }

    /// `A·v = λ·v` in every size, values in ascending order.
    #[test]
    fn eigenvectors_solve_the_eigenvalue_problem() {
        for (a, b, c) in [(2.0, 1.0, 5.0), (5.0, -1.0, 2.0), (3.0, 0.0, 1.0), (1.0, 2.0, 1.0)] {
            let entries = [[a, b, 0.0], [b, c, 0.0], [0.0, 0.0, 9.0]];
            for size in 1..4 {
                let matrix = Mat::from_fn(size, size, |i, j| entries[i][j]);
                let Symmetric { values, vectors } = Symmetric::of(matrix.as_ref()).unwrap();
                assert!(values.is_sorted());
                let image = &matrix * &vectors;
                for (i, k) in (0..size).flat_map(|i| (0..size).map(move |k| (i, k))) {
                    assert!((image[(i, k)] - values[k] * vectors[(i, k)]).abs() < 1e-12);
                }
            }
        }
    }
}
