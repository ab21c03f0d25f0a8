//! Numerical rank of the readings against their noise.
//!
//! The whitened Jacobian is in physical units (1 mm, 0.01 rad). A singular value `s` then means: a change by the
//! physical size along its direction changes the readings by `s` standard deviations in total. A direction with `s < 1`
//! is not identifiable, because even a gross error along it is below the noise. Two kinds of such directions are told
//! apart. A *structural* null direction has a singular value of zero but for the rounding of positions in a file: it changes
//! no reading, whatever the noise. A *weak* one changes readings by less than their noise.
//!
//! What the parameters are along a structural null direction is a choice of gauge. The set-up takes its part, so that the
//! other parameters have the least change in physical size: with `Z` a basis of these directions, `Z_m` its rows of the other
//! parameters and `β_m` these parameters,
//!
//! ```text
//! β ← β − Z · Z_m⁺ · β_m
//! ```
//!
//! The null space is reported in reduced row echelon form (`null_space`), in an order of preference of the
//! parameters that follows from their identifiers.

use abbe_model::Diagnostic;
use faer::Mat;

use super::null_space::{MIN_PIVOT, combinations};
use super::solve::Svd;
use super::tolerances::{COLLINEAR, MIN_IDENTIFIABLE, ROUNDING_OF_COMBINATIONS};
use super::triangle::Triangle;

/// The identifiable and the null directions of a problem.
#[derive(Clone, Debug)]
pub struct Rank {
    /// Singular values in descending order, standard deviations per physical size.
    pub singular_values: Vec<f64>,
    /// A basis of the identifiable space: parameters × rank, in internal units (mm, rad). Each column is one physical
    /// size long in the orthogonal complement of the null space, to which the gauge adds its part.
    pub identifiable_basis: Mat<f64>,
    /// Null-space combinations in scaled parameters, in reduced row echelon form. Each row is one combination, with 1
    /// at its pivot and 0 at the pivots of the other rows.
    pub null_combinations: Vec<Vec<f64>>,
    /// The pivot of each row, in the order of preference.
    pub pivots: Vec<usize>,
    /// Of each row that is weak, the standard uncertainty along it, in physical sizes of its pivot: it changes readings, by
    /// less than their noise. `None` of a structural one, which changes no reading.
    pub weak_u: Vec<Option<f64>>,
    /// Orthonormal basis of the null space, in scaled parameters: parameters × (parameters − rank), the weak directions first.
    pub null_space: Mat<f64>,
    /// Number of directions of the null space that change no reading: its last columns.
    pub structural: usize,
}

impl Rank {
    /// Decides the rank from the whitened factor, priors included, and the physical size of each parameter.
    /// `preference` lists every parameter once, the preferred pivots of null-space combinations first.
    ///
    /// # Errors
    /// If the factor has entries that are not finite.
    pub fn decide(triangle: &Triangle, size: &[f64], preference: &[usize]) -> Result<Rank, Diagnostic> {
        Rank::decide_above(triangle, size, preference, (MIN_IDENTIFIABLE, 0))
    }

    /// The same with another least singular value of an identifiable direction, and with at least so many of these.
    ///
    /// # Errors
    /// If the factor has entries that are not finite.
    pub fn decide_above(
        triangle: &Triangle,
        size: &[f64],
        preference: &[usize],
        (least, at_least): (f64, usize),
    ) -> Result<Rank, Diagnostic> {
        let n = size.len();
        let r = triangle.r();
        let scaled = Mat::from_fn(n, n, |i, j| r[(i, j)] * size[j]);
        let directions = Svd::of(scaled.as_ref())?;
        let numerical = directions.numerical_rank();
        let rank = directions.rank_above(least).max(at_least).min(numerical);
        let v = directions.right();
        let null_space = v.subcols(rank, n - rank).to_owned();
        let (null_combinations, pivots) = combinations(null_space.as_ref(), scaled.as_ref(), preference, MIN_PIVOT);
        let structural = n - directions.rank(COLLINEAR).clamp(rank, numerical);
        let signal = |row: &Vec<f64>| {
            let along = |i: usize| row.iter().enumerate().map(|(j, share)| scaled[(i, j)] * share).sum::<f64>();
            (0..n).map(|i| along(i).powi(2)).sum::<f64>().sqrt()
        };
        let weak_u = null_combinations.iter().map(signal).map(|signal| (signal > MIN_SIGNAL).then(|| 1.0 / signal));
        let weak_u = weak_u.collect();
        // At full rank the basis is that of the parameters themselves.
        let identifiable_basis = if rank == n {
            Mat::from_fn(n, n, |i, j| if i == j { size[i] } else { 0.0 })
        } else {
            Mat::from_fn(n, rank, |i, k| v[(i, k)] * size[i])
        };
        let singular_values = directions.singular_values;
        Ok(Rank { singular_values, identifiable_basis, null_combinations, pivots, weak_u, null_space, structural })
    }

    /// The same with the gauge of a set-up: along structural null directions the parameters of the set-up change, the others
    /// as little as possible.
    ///
    /// # Errors
    /// If the null space has entries that are not finite.
    pub fn with_set_up_first(mut self, is_set_up: &[bool], size: &[f64]) -> Result<Rank, Diagnostic> {
        let structural = self.structural;
        let n = size.len();
        let others: Vec<usize> = (0..n).filter(|j| !is_set_up[*j]).collect();
        if structural == 0 || others.len() == n {
            return Ok(self);
        }
        // Null directions are in descending order of their singular values.
        let weak = self.null_space.ncols() - structural;
        let space = self.null_space.subcols(weak, structural);
        let takes_part = |j: usize| (0..structural).any(|k| space[(j, k)].abs() > ROUNDING_OF_COMBINATIONS);
        if !(0..n).any(|j| is_set_up[j] && takes_part(j)) {
            return Ok(self);
        }
        let part = Mat::from_fn(others.len(), structural, |i, k| space[(others[i], k)]);
        let inverse = Svd::of(part.as_ref())?.pseudo_inverse_above(MIN_SHARE_OF_MACHINE);
        let basis = &mut self.identifiable_basis;
        let of_others = Mat::from_fn(others.len(), basis.ncols(), |i, k| basis[(others[i], k)] / size[others[i]]);
        let taken = space * (inverse * of_others);
        for k in 0..basis.ncols() {
            (0..n).for_each(|j| basis[(j, k)] -= taken[(j, k)] * size[j]);
        }
        Ok(self)
    }

    /// The same directions among more parameters. `kept` is the index of each of the present parameters among them,
    /// `size` the size of all. Priors determine the others: each is an identifiable direction of its own, which the
    /// priors determine to `least[j]` standard deviations per physical size.
    pub fn among(&self, kept: &[usize], size: &[f64], least: impl Fn(usize) -> f64) -> Rank {
        let count = size.len();
        let others: Vec<usize> = (0..count).filter(|j| kept.binary_search(j).is_err()).collect();
        let rank = self.identifiable_basis.ncols();
        let mut basis = Mat::zeros(count, rank + others.len());
        for (i, j) in kept.iter().enumerate() {
            (0..rank).for_each(|k| basis[(*j, k)] = self.identifiable_basis[(i, k)]);
        }
        others.iter().enumerate().for_each(|(k, j)| basis[(*j, rank + k)] = size[*j]);
        let mut null_space = Mat::zeros(count, self.null_space.ncols());
        for (i, j) in kept.iter().enumerate() {
            null_space.row_mut(*j).copy_from(self.null_space.row(i));
        }
        let wide = |row: &Vec<f64>| {
            let mut wide = vec![0.0; count];
            kept.iter().zip(row).for_each(|(j, value)| wide[*j] = *value);
            wide
        };
        let mut singular_values: Vec<f64> =
            self.singular_values.iter().copied().chain(others.iter().map(|j| least(*j))).collect();
        singular_values.sort_by(|a, b| b.total_cmp(a));
        Rank {
            singular_values,
            identifiable_basis: basis,
            null_combinations: self.null_combinations.iter().map(wide).collect(),
            pivots: self.pivots.iter().map(|pivot| kept[*pivot]).collect(),
            weak_u: self.weak_u.clone(),
            structural: self.structural,
            null_space,
        }
    }

    /// Coordinates of parameters in the identifiable basis; null-space parts are dropped. `size` as in [`Rank::decide`].
    /// Internal units.
    pub fn coordinates(&self, beta: &[f64], size: &[f64]) -> Vec<f64> {
        let mut scaled: Vec<f64> = beta.iter().zip(size).map(|(beta, size)| beta / size).collect();
        for null in self.null_space.col_iter() {
            let along: f64 = null.iter().zip(&scaled).map(|(null, beta)| null * beta).sum();
            scaled.iter_mut().zip(null.iter()).for_each(|(beta, null)| *beta -= along * null);
        }
        // The columns of the basis over `size`, without the part of the gauge in the null space, are orthonormal.
        let basis = self.identifiable_basis.col_iter();
        basis
            .map(|column| column.iter().zip(size).zip(&scaled).map(|((entry, size), beta)| entry / size * beta).sum())
            .collect()
    }

    /// The parameters at some coordinates in the identifiable basis. Internal units.
    pub fn parameters_at(&self, coordinates: &[f64]) -> Vec<f64> {
        let basis = &self.identifiable_basis;
        (0..basis.nrows()).map(|j| coordinates.iter().enumerate().map(|(k, z)| basis[(j, k)] * z).sum()).collect()
    }

    /// Whether a parameter takes part in no null-space combination.
    pub fn is_identifiable(&self, parameter: usize) -> bool {
        self.null_combinations.iter().all(|row| row[parameter] == 0.0)
    }
}

/// Signal of a combination, in standard deviations per physical size of its pivot, above which it is weak: rounding and what
/// is pruned from a structural one are less.
const MIN_SIGNAL: f64 = 1e-3;
/// Share of the other parameters in a null direction below which it is one of the set-up alone: taking a change of one
/// physical size out of the others would move the set-up by a hundred.
const MIN_SHARE_OF_MACHINE: f64 = 0.01;

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings of nine parameters with rank 5. The null space is the same, name by name, for every order of
    /// declaration and with rounding errors of 10⁻¹¹ in every entry.
    #[test]
    fn the_null_space_is_independent_of_the_order_of_declarations() {
        const N: usize = 9;
        let entry = |i: usize, j: usize| [1.0, -1.0, 2.0, 0.0, 0.5][(3 * i + 2 * j + i * j) % 5] * 1e4;
        let order = |turn: usize| (0..N).map(move |j| (4 * j + turn) % N).collect::<Vec<usize>>();
        let decide = |turn: usize| {
            let order = order(turn);
            let rows = Mat::from_fn(N, N + 1, |i, j| {
                let exact = if i < 5 && j < N { entry(i, order[j]) } else { 0.0 };
                exact * (1.0 + 1e-15 * ((5 * i + 3 * j + turn) % 7) as f64)
            });
            // Preferred by name: parameter 0 first.
            let mut preference: Vec<usize> = (0..N).collect();
            preference.sort_by_key(|j| order[*j]);
            let rank = Rank::decide(&Triangle::of(rows), &[1.0; N], &preference).unwrap();
            let rows: Vec<Vec<f64>> = (rank.null_combinations.iter())
                .map(|row| {
                    let mut by_name = vec![0.0; N];
                    order.iter().zip(row).for_each(|(name, value)| by_name[*name] = *value);
                    by_name
                })
                .collect();
            let pivots: Vec<usize> = rank.pivots.iter().map(|pivot| order[*pivot]).collect();
            (rows, pivots)
        };
        let (rows, pivots) = decide(0);
        assert!(pivots.is_sorted() && !pivots.is_empty(), "{pivots:?}");
        for turn in 1..N {
            let (others, of_others) = decide(turn);
            assert_eq!(of_others, pivots);
            for (row, other) in rows.iter().zip(&others) {
                for (a, b) in row.iter().zip(other) {
                    assert!((a - b).abs() < 1e-9, "{row:?} {other:?}");
                    assert_eq!(*a == 0.0, *b == 0.0);
                }
            }
        }
    }
}
