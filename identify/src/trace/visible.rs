//! What of a candidate the readings see: the inverse of its projected product on the directions that are left beside a model.

use faer::Mat;

/// Share of a candidate's own length that has to remain beside the model for it to count as seen.
pub const LEAST_VISIBLE: f64 = 1e-7;

/// `gᵀ D⁻¹ g` on the directions that are seen.
pub fn quadratic_gain(d: &Mat<f64>, own: &Mat<f64>, g: &[f64]) -> f64 {
    Visible::of(d, own).quadratic(g)
}

/// The inverse of a candidate's projected product on the directions that are seen.
pub(super) struct Visible {
    vectors: Mat<f64>,
    values: Vec<f64>,
    scale: Vec<f64>,
    /// Number of directions that are seen.
    pub freedom: usize,
}

impl Visible {
    pub fn of(d: &Mat<f64>, own: &Mat<f64>) -> Visible {
        let n = d.nrows();
        let scale: Vec<f64> = (0..n)
            .map(|k| {
                if own[(k, k)] > 0.0 {
                    1.0 / own[(k, k)].sqrt()
                } else {
                    0.0
                }
            })
            .collect();
        let scaled = Mat::from_fn(n, n, |i, j| d[(i, j)] * scale[i] * scale[j]);
        if n == 1 {
            let seen = scaled[(0, 0)] > LEAST_VISIBLE;
            let values = vec![if seen { 1.0 / scaled[(0, 0)] } else { 0.0 }];
            return Visible {
                vectors: Mat::identity(1, 1),
                values,
                scale,
                freedom: usize::from(seen),
            };
        }
        if n == 2 {
            return Visible::of_two(scaled, scale);
        }
        let Ok(eigen) = scaled.self_adjoint_eigen(faer::Side::Lower) else {
            return Visible {
                vectors: Mat::identity(n, n),
                values: vec![0.0; n],
                scale,
                freedom: 0,
            };
        };
        let values: Vec<f64> = eigen
            .S()
            .column_vector()
            .iter()
            .map(|value| if *value > LEAST_VISIBLE { 1.0 / value } else { 0.0 })
            .collect();
        let freedom = values.iter().filter(|value| **value > 0.0).count();
        Visible {
            vectors: eigen.U().to_owned(),
            values,
            scale,
            freedom,
        }
    }

    /// Of two columns, as sine and cosine have: by one rotation (Jacobi; Golub & Van Loan 8.5).
    fn of_two(scaled: Mat<f64>, scale: Vec<f64>) -> Visible {
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
        let values: Vec<f64> = values
            .map(|value| if value > LEAST_VISIBLE { 1.0 / value } else { 0.0 })
            .collect();
        Visible {
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

/// Inverse of a symmetric product, directions below rounding left out.
pub(super) fn pseudo_inverse(gram: &Mat<f64>) -> Mat<f64> {
    let n = gram.nrows();
    let Ok(eigen) = gram.self_adjoint_eigen(faer::Side::Lower) else {
        return Mat::identity(n, n);
    };
    let values: Vec<f64> = eigen.S().column_vector().iter().copied().collect();
    let largest = values.iter().fold(0.0_f64, |a, b| a.max(*b));
    let u = eigen.U();
    let scaled = Mat::from_fn(n, n, |i, k| {
        if values[k] > largest * 1e-12 {
            u[(i, k)] / values[k]
        } else {
            0.0
        }
    });
    &scaled * u.transpose()
}
