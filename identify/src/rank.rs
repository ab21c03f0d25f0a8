//! What the readings can see, decided against noise.
//!
//! With the whitened Jacobian in physical units (1 mm, 0.01 rad) a singular value `s` says that a move by the physical size along its direction
//! changes the readings by `s` standard deviations in all. A direction with `s < 1` is not seen: even a gross error along it drowns. No
//! tolerance on floating-point numbers is involved; exact null directions of a nominal geometry come out at 10⁻¹⁰ and lower.

use faer::{Mat, MatRef};

use crate::error::IdentifyError;

/// Singular value, in standard deviations a physical size, below which a direction is not seen.
pub const LEAST_SEEN: f64 = 1.0;

/// The seen and the unseen directions of a problem.
#[derive(Clone, Debug)]
pub struct Rank {
    /// Singular values in descending order, standard deviations a physical size.
    pub singular_values: Vec<f64>,
    /// Columns span what is seen: unknowns × rank, in inside units (mm, rad), each column one physical size long.
    pub seen: Mat<f64>,
    /// Null combinations, sparse, in scaled unknowns: one row a combination, each with 1 at its leading unknown.
    pub unseen: Vec<Vec<f64>>,
}

impl Rank {
    /// From `R` (whitened, priors included) and the physical size of each unknown.
    ///
    /// # Errors
    /// If `R` has entries that are not finite.
    pub fn decide(r: MatRef<'_, f64>, size: &[f64]) -> Result<Rank, IdentifyError> {
        let n = size.len();
        if n == 0 {
            return Ok(Rank {
                singular_values: Vec::new(),
                seen: Mat::zeros(0, 0),
                unseen: Vec::new(),
            });
        }
        let scaled = Mat::from_fn(n, n, |i, j| r[(i, j)] * size[j]);
        let svd = scaled.svd().map_err(|_| IdentifyError::Decomposition)?;
        let singular_values: Vec<f64> = svd.S().column_vector().iter().copied().collect();
        let rounding = singular_values[0] * 1e-13 * n as f64;
        let rank = singular_values
            .iter()
            .filter(|s| **s >= LEAST_SEEN && **s > rounding)
            .count();
        let v = svd.V();
        let mut unseen = sparse_rows((rank..n).map(|k| (0..n).map(|j| v[(j, k)]).collect()).collect());
        for row in &mut unseen {
            prune(row, scaled.as_ref());
        }
        // Full rank: the unknowns themselves, so that nothing is mixed.
        let seen = if rank == n {
            Mat::from_fn(n, n, |i, j| if i == j { size[i] } else { 0.0 })
        } else {
            Mat::from_fn(n, rank, |i, k| v[(i, k)] * size[i])
        };
        Ok(Rank {
            singular_values,
            seen,
            unseen,
        })
    }

    /// The seen coordinates of unknowns in inside units; the least-squares ones where the unknowns hold unseen parts. `size` as in
    /// [`Rank::decide`].
    pub fn coordinates(&self, beta: &[f64], size: &[f64]) -> Vec<f64> {
        // The columns of `seen` over `size` are orthonormal.
        (0..self.seen.ncols())
            .map(|k| {
                (0..beta.len())
                    .map(|j| self.seen[(j, k)] / size[j] * (beta[j] / size[j]))
                    .sum()
            })
            .collect()
    }

    /// Whether an unknown takes part in no unseen combination.
    pub fn is_seen(&self, unknown: usize) -> bool {
        self.unseen.iter().all(|row| row[unknown] == 0.0)
    }
}

/// Leaves out the least coefficients one by one as long as what remains is still not seen: a combination that hides within the noise owes
/// its small coefficients to the noise.
fn prune(row: &mut [f64], scaled: MatRef<'_, f64>) {
    let signal = |row: &[f64]| -> f64 {
        let change: f64 = (0..scaled.nrows())
            .map(|i| {
                (0..row.len())
                    .map(|j| scaled[(i, j)] * row[j])
                    .sum::<f64>()
                    .powi(2)
            })
            .sum();
        change.sqrt() / row.iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    // What is named is an approximate direction; twice the limit still drowns.
    let limit = 2.0 * signal(row).max(LEAST_SEEN);
    let mut order: Vec<usize> = (0..row.len())
        .filter(|j| row[*j] != 0.0 && row[*j].abs() < PRUNED)
        .collect();
    order.sort_by(|a, b| row[*a].abs().total_cmp(&row[*b].abs()));
    for j in order {
        let kept = std::mem::take(&mut row[j]);
        if signal(row) > limit {
            row[j] = kept;
        }
    }
}

/// Coefficients that may be pruned: below this, relative to 1.
const PRUNED: f64 = 0.02;

/// Coefficients below this, relative to 1, are rounding.
const NEGLIGIBLE: f64 = 1e-5;

/// Turns an orthonormal basis into a sparse one of the same span: Gauss–Jordan with the largest remaining entry as pivot, then each row
/// divided by its largest entry.
fn sparse_rows(mut rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let count = rows.len();
    let mut pivots: Vec<usize> = Vec::new();
    for step in 0..count {
        let (mut best, mut row, mut column) = (0.0, step, 0);
        for (i, candidate) in rows.iter().enumerate().skip(step) {
            for (j, value) in candidate.iter().enumerate() {
                // Ties are broken by position, so that the result does not depend on rounding.
                if !pivots.contains(&j) && value.abs() > best * (1.0 + 1e-9) {
                    (best, row, column) = (value.abs(), i, j);
                }
            }
        }
        if best == 0.0 {
            break;
        }
        rows.swap(step, row);
        let pivot = rows[step][column];
        rows[step].iter_mut().for_each(|value| *value /= pivot);
        let pivot_row = rows[step].clone();
        for (i, other) in rows.iter_mut().enumerate() {
            let factor = other[column];
            if i != step && factor != 0.0 {
                other
                    .iter_mut()
                    .zip(&pivot_row)
                    .for_each(|(value, p)| *value -= factor * p);
            }
        }
        pivots.push(column);
    }
    for row in &mut rows {
        let largest = row
            .iter()
            .fold(0.0_f64, |a, b| if b.abs() > a.abs() { *b } else { a });
        for value in row.iter_mut() {
            *value /= largest;
            if value.abs() < NEGLIGIBLE {
                *value = 0.0;
            }
        }
    }
    rows.sort_by_key(|row| row.iter().position(|value| *value != 0.0));
    rows
}
