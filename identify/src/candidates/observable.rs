//! The observable subspace of a candidate: the directions that remain after projection on the model, and the inverse of
//! the projected product on them.

use faer::Mat;

use crate::error::IdentifyError;

/// Least share of a candidate's squared column length that has to remain after projection for the candidate to count as
/// observable.
pub const MIN_OBSERVABLE: f64 = 1e-7;

/// `gᵀ D⁻¹ g` on the observable directions.
pub fn quadratic_gain(d: &Mat<f64>, own: &Mat<f64>, g: &[f64]) -> f64 {
    ObservableSubspace::of(d, own).quadratic(g)
}

/// The inverse of a candidate's projected product on its observable directions.
pub(crate) struct ObservableSubspace {
    vectors: Mat<f64>,
    values: Vec<f64>,
    scale: Vec<f64>,
    /// Number of observable directions.
    pub freedom: usize,
}

impl ObservableSubspace {
    pub fn of(d: &Mat<f64>, own: &Mat<f64>) -> ObservableSubspace {
        let n = d.nrows();
        let scale: Vec<f64> = (0..n).map(|k| if own[(k, k)] > 0.0 { 1.0 / own[(k, k)].sqrt() } else { 0.0 }).collect();
        let scaled = Mat::from_fn(n, n, |i, j| d[(i, j)] * scale[i] * scale[j]);
        if n == 1 {
            let observable = scaled[(0, 0)] > MIN_OBSERVABLE;
            let values = vec![if observable { 1.0 / scaled[(0, 0)] } else { 0.0 }];
            return ObservableSubspace {
                vectors: Mat::identity(1, 1),
                values,
                scale,
                freedom: usize::from(observable),
            };
        }
        if n == 2 {
            return ObservableSubspace::of_two(scaled, scale);
        }
        let Ok(eigen) = scaled.self_adjoint_eigen(faer::Side::Lower) else {
            return ObservableSubspace { vectors: Mat::identity(n, n), values: vec![0.0; n], scale, freedom: 0 };
        };
        let values: Vec<f64> = eigen
            .S()
            .column_vector()
            .iter()
            .map(|value| if *value > MIN_OBSERVABLE { 1.0 / value } else { 0.0 })
            .collect();
        let freedom = values.iter().filter(|value| **value > 0.0).count();
        ObservableSubspace { vectors: eigen.U().to_owned(), values, scale, freedom }
    }

    /// For two columns, as sine and cosine have: one Jacobi rotation (Golub & Van Loan, section 8.5).
    fn of_two(scaled: Mat<f64>, scale: Vec<f64>) -> ObservableSubspace {
        let (a, b, c) = (scaled[(0, 0)], scaled[(1, 0)], scaled[(1, 1)]);
        let tangent = if b == 0.0 {
            0.0
        } else {
            let tau = (c - a) / (2.0 * b);
            tau.signum() / (tau.abs() + 1.0_f64.hypot(tau))
        };
        let cos = 1.0 / 1.0_f64.hypot(tangent);
        let sin = tangent * cos;
        let values = vec![a - tangent * b, c + tangent * b].into_iter();
        let values: Vec<f64> = values.map(|value| if value > MIN_OBSERVABLE { 1.0 / value } else { 0.0 }).collect();
        ObservableSubspace {
            vectors: Mat::from_fn(2, 2, |i, k| match (i, k) {
                (0, 1) => sin,
                (1, 0) => -sin,
                _ => cos,
            }),
            freedom: values.iter().filter(|value| **value > 0.0).count(),
            values,
            scale,
        }
    }

    pub fn quadratic(&self, g: &[f64]) -> f64 {
        let n = g.len();
        (0..n)
            .filter(|k| self.values[*k] > 0.0)
            .map(|k| {
                let along: f64 = (0..n).map(|i| self.vectors[(i, k)] * g[i] * self.scale[i]).sum();
                along * along * self.values[k]
            })
            .sum()
    }

    pub fn solve(&self, g: &[f64]) -> Vec<f64> {
        let n = g.len();
        let mut solution = vec![0.0; n];
        for k in (0..n).filter(|k| self.values[*k] > 0.0) {
            let along: f64 = (0..n).map(|i| self.vectors[(i, k)] * g[i] * self.scale[i]).sum();
            for i in 0..n {
                solution[i] += self.vectors[(i, k)] * self.scale[i] * along * self.values[k];
            }
        }
        solution
    }
}

/// Inverse of a symmetric product. Directions below rounding are excluded.
///
/// # Errors
/// If the product has entries that are not finite.
pub(crate) fn pseudo_inverse(gram: &Mat<f64>) -> Result<Mat<f64>, IdentifyError> {
    let n = gram.nrows();
    let eigen = gram.self_adjoint_eigen(faer::Side::Lower).map_err(|_| IdentifyError::Decomposition)?;
    let values: Vec<f64> = eigen.S().column_vector().iter().copied().collect();
    let largest = values.iter().fold(0.0_f64, |a, b| a.max(*b));
    let u = eigen.U();
    let scaled = Mat::from_fn(n, n, |i, k| if values[k] > largest * 1e-12 { u[(i, k)] / values[k] } else { 0.0 });
    Ok(&scaled * u.transpose())
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
        let inverse = pseudo_inverse(&gram).unwrap();
        let again = &gram * &inverse * &gram;
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            assert!((again[(i, j)] - gram[(i, j)]).abs() < 1e-9);
        }
    }

    #[test]
    fn non_finite_entries_are_an_error() {
        let gram = Mat::from_fn(3, 3, |i, j| if i + j == 2 { f64::NAN } else { 1.0 });
        assert!(matches!(pseudo_inverse(&gram), Err(IdentifyError::Decomposition)));
    }
}
