//! The χ² gain of further columns: the decrease of the sum of squares, and the number of directions that it has.
//!
//! `D` is the product of the columns with themselves after projection on the model, `g` their product with the
//! residual. The gain is `gᵀ D⁻¹ g` over the directions in which `D` keeps enough of the columns.

use faer::{Mat, MatRef};

use super::symmetric::{Symmetric, eigen_of_two};
use super::tolerances::MIN_OBSERVABLE;

/// `gᵀ D⁻¹ g` on the observable directions. `own` is the product before projection.
pub fn quadratic_gain(d: &Mat<f64>, own: &Mat<f64>, g: &[f64]) -> f64 {
    ObservableSubspace::of(d, own).quadratic(g)
}

/// `gᵀ D⁻¹ g` of one or two columns, and the number of observable directions. `own` are the squared lengths before
/// projection.
pub fn gain_of_few(count: usize, d: [[f64; 2]; 2], own: [f64; 2], g: [f64; 2]) -> (f64, usize) {
    let scale = own.map(|own| if own > 0.0 { 1.0 / own.sqrt() } else { 0.0 });
    let scaled = |k: usize, l: usize| d[k][l] * scale[k] * scale[l];
    let pairs = match count {
        1 => [(scaled(0, 0), [1.0, 0.0]), (0.0, [0.0, 0.0])],
        _ => eigen_of_two(scaled(0, 0), scaled(1, 0), scaled(1, 1)),
    };
    let g = [g[0] * scale[0], g[1] * scale[1]];
    pairs.iter().filter(|(value, _)| *value > MIN_OBSERVABLE).fold((0.0, 0), |(gain, freedom), (value, vector)| {
        let along = vector[0] * g[0] + vector[1] * g[1];
        (gain + along * along / value, freedom + 1)
    })
}

/// The inverse of a projected product on its observable directions.
pub struct ObservableSubspace {
    vectors: Mat<f64>,
    /// The inverse of each eigenvalue; zero for a direction that is not observable.
    values: Vec<f64>,
    scale: Vec<f64>,
    /// Number of observable directions.
    pub freedom: usize,
}

impl ObservableSubspace {
    /// Of columns with the product `d` after projection and `own` before it.
    pub fn of(d: &Mat<f64>, own: &Mat<f64>) -> ObservableSubspace {
        let n = d.nrows();
        let scale: Vec<f64> = (0..n).map(|k| if own[(k, k)] > 0.0 { 1.0 / own[(k, k)].sqrt() } else { 0.0 }).collect();
        let scaled = Mat::from_fn(n, n, |i, j| d[(i, j)] * scale[i] * scale[j]);
        ObservableSubspace { scale, ..ObservableSubspace::above(scaled.as_ref(), MIN_OBSERVABLE) }
    }

    /// The directions along which a symmetric matrix exceeds `least`.
    pub fn above(matrix: MatRef<'_, f64>, least: f64) -> ObservableSubspace {
        let n = matrix.nrows();
        let symmetric =
            Symmetric::of(matrix).unwrap_or_else(|_| Symmetric { values: vec![0.0; n], vectors: Mat::identity(n, n) });
        let inverse = |value: &f64| if *value > least { 1.0 / value } else { 0.0 };
        let values: Vec<f64> = symmetric.values.iter().map(inverse).collect();
        let freedom = values.iter().filter(|value| **value > 0.0).count();
        ObservableSubspace { vectors: symmetric.vectors, values, scale: vec![1.0; n], freedom }
    }

    /// `gᵀ D⁻¹ g`.
    pub fn quadratic(&self, g: &[f64]) -> f64 {
        self.components(g).map(|(k, along)| along * along * self.values[k]).sum()
    }

    /// `D⁻¹ g`.
    pub fn solve(&self, g: &[f64]) -> Vec<f64> {
        let mut solution = vec![0.0; g.len()];
        for (k, along) in self.components(g) {
            for (i, value) in solution.iter_mut().enumerate() {
                *value += self.vectors[(i, k)] * self.scale[i] * along * self.values[k];
            }
        }
        solution
    }

    /// The component of `g` along each observable direction.
    fn components(&self, g: &[f64]) -> impl Iterator<Item = (usize, f64)> {
        let along = |k: usize| (0..g.len()).map(|i| self.vectors[(i, k)] * g[i] * self.scale[i]).sum();
        (0..g.len()).filter(|k| self.values[*k] > 0.0).map(move |k| (k, along(k)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The gain of a column that the model holds already is zero, and that of an orthogonal one is `g²/d`.
    #[test]
    fn only_observable_directions_contribute() {
        let d = Mat::from_fn(2, 2, |i, j| if i == j { [4.0, 1e-9][i] } else { 0.0 });
        let own = Mat::from_fn(2, 2, |i, j| if i == j { 4.0 } else { 0.0 });
        let subspace = ObservableSubspace::of(&d, &own);
        assert_eq!(subspace.freedom, 1);
        assert!((subspace.quadratic(&[6.0, 5.0]) - 9.0).abs() < 1e-12);
        assert!((subspace.solve(&[6.0, 5.0])[0] - 1.5).abs() < 1e-12);
        assert_eq!(subspace.solve(&[6.0, 5.0])[1], 0.0);
    }

    /// Two columns without matrices give the same as with them.
    #[test]
    fn few_columns_have_the_gain_of_the_general_case() {
        for (a, b, c) in [(4.0, 0.3, 2.0), (1e-9, 1e-12, 3.0), (2.0, 2.0, 2.0), (0.0, 0.0, 0.0)] {
            let d = Mat::from_fn(2, 2, |i, j| [[a, b], [b, c]][i][j]);
            let own = Mat::from_fn(2, 2, |i, j| [[4.0, 0.5], [0.5, 3.0]][i][j]);
            let subspace = ObservableSubspace::of(&d, &own);
            let (gain, freedom) = gain_of_few(2, [[a, b], [b, c]], [4.0, 3.0], [1.5, -0.7]);
            assert_eq!(freedom, subspace.freedom);
            let expected = subspace.quadratic(&[1.5, -0.7]);
            assert!((gain - expected).abs() <= 1e-12 * expected);
            let one = |of: &Mat<f64>| of.submatrix(1, 1, 1, 1).to_owned();
            let subspace = ObservableSubspace::of(&one(&d), &one(&own));
            let (gain, freedom) = gain_of_few(1, [[c, 0.0], [0.0, 0.0]], [3.0, 0.0], [-0.7, 0.0]);
            assert_eq!(freedom, subspace.freedom);
            assert!((gain - subspace.quadratic(&[-0.7])).abs() <= 1e-12 * gain);
        }
    }
}
