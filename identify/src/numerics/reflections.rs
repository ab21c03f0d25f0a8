//! Householder reflections that absorb rows into a triangular factor of few columns.
//!
//! Below the factor `R` lie the rows `B`. The reflection of column `j` annihilates `b_j`. Its vector is `α − β` in row `j`
//! and `b_j` below, with `α = R_jj` and `β = ∓√(α² + ‖b_j‖²)`. It changes only row `j` of `R`, which stays triangular
//! (Golub & Van Loan, Matrix Computations, 5.2.2 and 12.5.3):
//!
//! ```text
//! t_k = (β − α)/β · (R_jk + b_j·b_k / (α − β)),   R_jk ← R_jk − t_k,   b_k ← b_k − t_k/(α − β) · b_j
//! ```

use faer::{Mat, MatRef};
use pulp::{Simd, WithSimd};

/// Number of rows that are annihilated together: with all their columns they stay in the first-level cache.
const ROWS: usize = 128;
/// Numbers in a vector of any processor divide this number.
const LANES: usize = 8;
/// Columns that are reflected together, so that the vector of the reflection is loaded once for them.
const TOGETHER: usize = 4;

/// A column of rows. The alignment keeps vectors within cache lines.
#[derive(Clone)]
#[repr(align(64))]
struct Column([f64; ROWS]);

/// Absorbs rows into a triangular factor of as many columns, which may be zero.
pub(super) fn absorb(factor: &mut Mat<f64>, rows: MatRef<'_, f64>) {
    let mut below = vec![Column([0.0; ROWS]); factor.ncols()];
    for start in (0..rows.nrows()).step_by(ROWS) {
        let count = ROWS.min(rows.nrows() - start);
        for (column, from) in below.iter_mut().zip(rows.subrows(start, count).col_iter()) {
            match from.try_as_col_major() {
                Some(from) => column.0[..count].copy_from_slice(from.as_slice()),
                None => column.0.iter_mut().zip(from.iter()).for_each(|(to, from)| *to = *from),
            }
            column.0[count..].fill(0.0);
        }
        let count = count.next_multiple_of(LANES);
        pulp::Arch::new().dispatch(Annihilation { factor, below: &mut below, count });
    }
}

/// Annihilates the first `count` rows below a factor.
struct Annihilation<'a> {
    factor: &'a mut Mat<f64>,
    below: &'a mut [Column],
    count: usize,
}

impl WithSimd for Annihilation<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Annihilation { factor, below, count } = self;
        for j in 0..below.len() {
            let (own, others) = below.split_at_mut(j + 1);
            let (b, _) = S::as_simd_f64s(&own[j].0[..count]);
            let mut squares = simd.splat_f64s(0.0);
            for b in b {
                squares = simd.mul_add_e_f64s(*b, *b, squares);
            }
            let square = simd.reduce_sum_f64s(squares);
            if square == 0.0 {
                continue;
            }
            let alpha = factor[(j, j)];
            let beta = -(alpha * alpha + square).sqrt().copysign(alpha);
            factor[(j, j)] = beta;
            let reflection = Reflection { simd, b, over: 1.0 / (alpha - beta), share: (beta - alpha) / beta };
            let (groups, rest) = others.as_chunks_mut::<TOGETHER>();
            let mut k = j + 1;
            for group in groups {
                reflection.apply(group, factor, (j, k));
                k += TOGETHER;
            }
            for column in rest {
                reflection.apply(std::array::from_mut(column), factor, (j, k));
                k += 1;
            }
        }
    }
}

/// The reflection that annihilates `b`, with `over = 1/(α − β)` and `share = (β − α)/β`.
struct Reflection<'b, S: Simd> {
    simd: S,
    b: &'b [S::f64s],
    over: f64,
    share: f64,
}

impl<S: Simd> Reflection<'_, S> {
    /// Applies it to columns, and to the entries of the factor above them from row and column `(j, k)` on.
    #[inline(always)]
    fn apply<const N: usize>(&self, columns: &mut [Column; N], factor: &mut Mat<f64>, (j, k): (usize, usize)) {
        let (simd, b) = (self.simd, self.b);
        let mut columns = columns.each_mut().map(|column| &mut S::as_mut_simd_f64s(&mut column.0).0[..b.len()]);
        let mut products = [simd.splat_f64s(0.0); N];
        for (i, b) in b.iter().enumerate() {
            for (product, column) in products.iter_mut().zip(&columns) {
                *product = simd.mul_add_e_f64s(*b, column[i], *product);
            }
        }
        let mut factors = products;
        for (place, (product, along)) in products.into_iter().zip(&mut factors).enumerate() {
            let above = &mut factor[(j, k + place)];
            let t = self.share * (*above + self.over * simd.reduce_sum_f64s(product));
            *above -= t;
            *along = simd.splat_f64s(t * self.over);
        }
        for (i, b) in b.iter().enumerate() {
            for (along, column) in factors.iter().zip(&mut columns) {
                column[i] = simd.negate_mul_add_e_f64s(*along, *b, column[i]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// Compares with the decomposition of all rows together, of any number; the last two columns are those before them.
    #[test]
    fn the_factor_has_the_products_of_all_rows() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        for (width, counts) in [(1, [1, 200, 3]), (6, [2, 128, 0]), (17, [300, 129, 64]), (39, [5, 500, 40])] {
            let mut factor = Mat::zeros(width, width);
            let mut wanted = Mat::<f64>::zeros(width, width);
            for count in counts {
                let mut rows = Mat::from_fn(count, width, |_, _| random.random_range(-1.0..1.0));
                for i in (0..count).filter(|_| width > 4) {
                    (rows[(i, width - 2)], rows[(i, width - 1)]) = (rows[(i, 0)], 2.0 * rows[(i, 1)]);
                }
                absorb(&mut factor, rows.as_ref());
                wanted += rows.transpose() * &rows;
            }
            let found = factor.transpose() * &factor;
            for j in 0..width {
                assert!((j + 1..width).all(|i| factor[(i, j)] == 0.0));
                assert!((0..width).all(|i| (found[(i, j)] - wanted[(i, j)]).abs() < 1e-11), "{width}, {j}");
                assert!(width <= 4 || j < width - 2 || factor[(j, j)].abs() < 1e-12, "{width}: {}", factor[(j, j)]);
            }
        }
    }
}
