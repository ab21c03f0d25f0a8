//! A triangular factor in fewer directions: restricted to a subspace, or with parameters eliminated; and the
//! covariance that it gives.

use abbe_model::Diagnostic;
use faer::{Mat, MatRef};

use super::solve::Svd;
use super::triangle::{Triangle, upper};

impl Triangle {
    /// The factor of `[J·N | r]`, with the columns of `N` as directions.
    pub fn in_directions(&self, basis: &Mat<f64>) -> Triangle {
        let (r, c, rest) = self.parts();
        let (n, rank) = (basis.nrows(), basis.ncols());
        let reduced = &r * basis;
        Triangle::of(Mat::from_fn(n + 1, rank + 1, |i, j| match (i == n, j == rank) {
            (true, true) => rest.sqrt(),
            (true, false) => 0.0,
            (false, true) => c[i],
            (false, false) => reduced[(i, j)],
        }))
    }

    /// The covariance `N (NᵀRᵀRN)⁻¹ Nᵀ` of the parameters, over the directions `N`.
    ///
    /// # Errors
    /// If the factor has entries that are not finite.
    pub fn covariance(&self, basis: &Mat<f64>) -> Result<Mat<f64>, Diagnostic> {
        let root = basis * Svd::of((self.r() * basis).as_ref())?.inverse_root();
        Ok(&root * root.transpose())
    }

    /// The square-root information on the `kept` parameters with the others eliminated: the lower right block of the
    /// triangular factor of `[R_dropped R_kept]` (the Schur complement, without squaring).
    ///
    /// Directions of the dropped parameters on which the rows have less information than one standard deviation per
    /// physical size stay at their nominal values, as in a fit (see [`super::rank`]). A column of zeros would otherwise
    /// remove a row of information. No information is added to that of the rows.
    ///
    /// # Errors
    /// If the factor has entries that are not finite.
    pub fn marginal(&self, kept: &[usize], size: &[f64]) -> Result<Mat<f64>, Diagnostic> {
        let r = self.r();
        let rows = Mat::from_fn(r.nrows(), kept.len(), |i, j| r[(i, kept[j])]);
        Ok(upper(without_dropped(&r, rows, kept, size)?))
    }

    /// As [`Triangle::marginal`], with the residual: the factor `[R c; 0 ρ]` of the `kept` parameters after the best
    /// change of the others.
    ///
    /// # Errors
    /// If the factor has entries that are not finite.
    pub fn eliminated(&self, kept: &[usize], size: &[f64]) -> Result<Triangle, Diagnostic> {
        let (r, c, rest) = self.parts();
        let rows = Mat::from_fn(r.nrows(), kept.len() + 1, |i, j| kept.get(j).map_or(c[i], |kept| r[(i, *kept)]));
        let mut triangle = Triangle::of(without_dropped(&r, rows, kept, size)?);
        let mut last = Mat::zeros(1, kept.len() + 1);
        last[(0, kept.len())] = rest.sqrt();
        triangle.absorb(last.as_ref());
        Ok(triangle)
    }
}

/// The rows with the column space of the parameters that are not `kept` projected out, as far as it is identifiable.
fn without_dropped(r: &Mat<f64>, mut rows: Mat<f64>, kept: &[usize], size: &[f64]) -> Result<Mat<f64>, Diagnostic> {
    let dropped: Vec<usize> = (0..size.len()).filter(|j| !kept.contains(j)).collect();
    let scaled = Mat::from_fn(r.nrows(), dropped.len(), |i, j| r[(i, dropped[j])] * size[dropped[j]]);
    let directions = Svd::of(scaled.as_ref())?;
    let informed = directions.left().subcols(0, directions.identifiable_rank());
    let along = informed.transpose() * &rows;
    rows -= informed * along;
    Ok(rows)
}

/// The inverse of an upper triangular matrix. A zero pivot yields infinity.
pub fn inverse_of_upper(r: MatRef<'_, f64>) -> Mat<f64> {
    let n = r.ncols();
    let mut inverse = Mat::zeros(n, n);
    for j in 0..n {
        inverse[(j, j)] = 1.0 / r[(j, j)];
        for i in (0..j).rev() {
            let sum: f64 = (i + 1..=j).map(|l| r[(i, l)] * inverse[(l, j)]).sum();
            inverse[(i, j)] = -sum / r[(i, i)];
        }
    }
    inverse
}

/// Orthonormal columns of the space of the columns of a matrix, by pivoting. `negligible` is the share of the first pivot
/// below which a pivot is a rounding error.
pub fn orthonormal_basis(matrix: &Mat<f64>, negligible: f64) -> Mat<f64> {
    if matrix.nrows() == 0 || matrix.ncols() == 0 {
        return Mat::zeros(matrix.nrows(), 0);
    }
    let decomposed = matrix.col_piv_qr();
    let r = decomposed.thin_R();
    let least = negligible * r[(0, 0)].abs();
    let rank = (0..r.nrows()).take_while(|k| r[(*k, *k)].abs() > least).count();
    decomposed.compute_thin_Q().subcols(0, rank).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A reading with 0.1 µm noise depends on the sum of an error and a ball position with a prior of 300 µm. The prior
    /// then determines the error. A second ball position, with neither prior nor readings, removes no information.
    #[test]
    fn dropped_parameters_are_limited_by_their_priors() {
        let r = Mat::from_fn(3, 3, |i, j| [[1e4, 1e4, 0.0], [0.0, 1.0 / 0.3, 0.0], [0.0; 3]][i][j]);
        let triangle = Triangle::of(Mat::from_fn(3, 4, |i, j| if j < 3 { r[(i, j)] } else { 0.0 }));
        let left = triangle.marginal(&[0], &[1.0; 3]).unwrap();
        let u = 1.0 / left[(0, 0)].abs();
        assert!((u / 0.3_f64.hypot(1e-4) - 1.0).abs() < 1e-9, "{u}");
        // Only the second ball position is dropped: the information of the readings remains.
        let both = triangle.marginal(&[0, 1], &[1.0; 3]).unwrap();
        let information = both.transpose() * &both;
        let whole = r.transpose() * &r;
        for i in 0..2 {
            for j in 0..2 {
                assert!((information[(i, j)] / whole[(i, j)] - 1.0).abs() < 1e-12);
            }
        }
    }
}
