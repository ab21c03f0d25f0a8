//! Linear least squares over columns, with detection of collinear columns.

use faer::Mat;

use super::gain::quadratic_gain;
use super::solve::Svd;
use super::tolerances::COLLINEAR;
use super::triangle::Triangle;

/// A solved regression `y ≈ Σ βⱼ·xⱼ`.
pub struct Regression {
    columns: Vec<Vec<f64>>,
    /// The coefficients.
    pub beta: Vec<f64>,
    /// `(XᵀX)⁻¹`.
    pub inverse: Mat<f64>,
    /// The residual, row by row.
    pub residual: Vec<f64>,
}

impl Regression {
    /// Solves; `None` if the columns are collinear.
    pub fn solve(columns: Vec<Vec<f64>>, y: &[f64]) -> Option<Regression> {
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
        let directions = Svd::of(Mat::from_fn(n, n, |i, j| r[(i, j)] / norms[j]).as_ref()).ok()?;
        if directions.rank(COLLINEAR) < n {
            return None;
        }
        let root = directions.inverse_root();
        let root = Mat::from_fn(n, n, |j, k| root[(j, k)] / norms[j]);
        let beta: Vec<f64> = directions.solve(&c, 0.0).iter().zip(&norms).map(|(scaled, norm)| scaled / norm).collect();
        let residual = (0..y.len()).map(|i| y[i] - (0..n).map(|j| columns[j][i] * beta[j]).sum::<f64>()).collect();
        Some(Regression { columns, beta, inverse: &root * root.transpose(), residual })
    }

    /// Sum of squares of the residual.
    pub fn sum_of_squares(&self) -> f64 {
        self.residual.iter().map(|v| v * v).sum()
    }

    /// The decrease of the sum of squares by further columns beside those of this regression.
    pub fn gain(&self, further: &[Vec<f64>]) -> f64 {
        let products = |a: &[Vec<f64>], b: &[Vec<f64>]| Mat::from_fn(a.len(), b.len(), |i, j| dot(&a[i], &b[j]));
        let (cross, own) = (products(&self.columns, further), products(further, further));
        let d = &own - cross.transpose() * (&self.inverse * &cross);
        let g: Vec<f64> = further.iter().map(|column| dot(column, &self.residual)).collect();
        quadratic_gain(&d, &own, &g)
    }

    /// Standard uncertainty of `Σ wⱼ·βⱼ` for readings with the standard deviation `sigma`.
    pub fn u(&self, weights: &[(usize, f64)], sigma: f64) -> f64 {
        let variance: f64 =
            weights.iter().flat_map(|(j, a)| weights.iter().map(move |(k, b)| a * b * self.inverse[(*j, *k)])).sum();
        variance.max(0.0).sqrt() * sigma
    }
}

/// Number of partial sums, which the compiler keeps in vector registers.
const LANES: usize = 8;

/// `Σ a b` over the shorter of the two.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    for (a, b) in a.iter().zip(b) {
        for k in 0..LANES {
            lanes[k] += a[k] * b[k];
        }
    }
    lanes.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The gain of further columns is the decrease of the sum of squares in a new regression with them.
    #[test]
    fn the_gain_of_further_columns_is_that_of_a_new_regression() {
        let column = |k: i32| (0..20).map(|i| (0.1 * f64::from(i)).powi(k)).collect::<Vec<f64>>();
        let y: Vec<f64> = (0..20).map(|i| (0.4 * f64::from(i)).sin()).collect();
        let columns = vec![column(0), column(1)];
        let regression = Regression::solve(columns.clone(), &y).unwrap();
        let further = [column(2), column(3)];
        let both = Regression::solve([columns.clone(), further.to_vec()].concat(), &y).unwrap();
        let decrease = regression.sum_of_squares() - both.sum_of_squares();
        assert!((regression.gain(&further) / decrease - 1.0).abs() < 1e-9);
        assert!(regression.gain(&columns).abs() < 1e-9);
        assert!(Regression::solve(vec![columns[0].clone(), columns[0].clone()], &y).is_none());
    }
}
