//! Linear least squares over columns, with detection of collinear columns.

use faer::Mat;

use super::solve::Directions;
use super::tolerances::COLLINEAR;
use super::triangle::Triangle;

/// A solved regression `y ≈ Σ βⱼ·xⱼ`.
pub(crate) struct Regression {
    /// The coefficients.
    pub beta: Vec<f64>,
    /// `(XᵀX)⁻¹`.
    pub inverse: Mat<f64>,
    /// The residual, row by row.
    pub residual: Vec<f64>,
}

impl Regression {
    /// Solves; `None` if the columns are collinear.
    pub fn solve(columns: &[Vec<f64>], y: &[f64]) -> Option<Regression> {
        let n = columns.len();
        if y.len() <= n {
            return None;
        }
        let rows = Mat::from_fn(y.len(), n + 1, |i, j| if j < n { columns[j][i] } else { y[i] });
        let (r, c, _) = Triangle::of(rows).parts();
        let norms: Vec<f64> = r.col_iter().map(|column| column.norm_l2()).collect();
        if norms.iter().any(|norm| *norm <= 0.0) {
            return None;
        }
        let directions = Directions::of(Mat::from_fn(n, n, |i, j| r[(i, j)] / norms[j]).as_ref()).ok()?;
        if directions.rank(COLLINEAR) < n {
            return None;
        }
        let root = directions.inverse_root();
        let root = Mat::from_fn(n, n, |j, k| root[(j, k)] / norms[j]);
        let beta: Vec<f64> = directions.solve(&c, 0.0).iter().zip(&norms).map(|(scaled, norm)| scaled / norm).collect();
        let residual = (0..y.len()).map(|i| y[i] - (0..n).map(|j| columns[j][i] * beta[j]).sum::<f64>()).collect();
        Some(Regression { beta, inverse: &root * root.transpose(), residual })
    }

    /// Sum of squares of the residual.
    pub fn sum_of_squares(&self) -> f64 {
        self.residual.iter().map(|v| v * v).sum()
    }

    /// Standard uncertainty of `Σ wⱼ·βⱼ` for readings with the standard deviation `sigma`.
    pub fn u(&self, weights: &[(usize, f64)], sigma: f64) -> f64 {
        let variance: f64 =
            weights.iter().flat_map(|(j, a)| weights.iter().map(move |(k, b)| a * b * self.inverse[(*j, *k)])).sum();
        variance.max(0.0).sqrt() * sigma
    }
}

/// An orthonormal basis of columns, for the gain from further columns.
pub(crate) struct Orthonormal(Vec<Vec<f64>>);

impl Orthonormal {
    /// Orthonormalises columns.
    pub fn of(columns: &[Vec<f64>]) -> Orthonormal {
        let mut basis = Orthonormal(Vec::new());
        for column in columns {
            basis.push(column.clone());
        }
        basis
    }

    fn push(&mut self, column: Vec<f64>) -> bool {
        let before = dot(&column, &column).sqrt();
        let mut remainder = column;
        // Two passes suffice (Giraud, Langou & Rozložník 2005).
        for _ in 0..2 {
            for q in &self.0 {
                let along = dot(q, &remainder);
                remainder.iter_mut().zip(q).for_each(|(r, q)| *r -= along * q);
            }
        }
        let norm = dot(&remainder, &remainder).sqrt();
        let independent = norm > COLLINEAR * before.max(f64::MIN_POSITIVE);
        if independent {
            remainder.iter_mut().for_each(|r| *r /= norm);
            self.0.push(remainder);
        }
        independent
    }

    /// The decrease of the sum of squares of a residual, orthogonal to these columns, by further columns.
    pub fn gain(&mut self, residual: &[f64], further: Vec<Vec<f64>>) -> f64 {
        let kept = self.0.len();
        for column in further {
            self.push(column);
        }
        let gain = self.0[kept..].iter().map(|q| dot(q, residual).powi(2)).sum();
        self.0.truncate(kept);
        gain
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
