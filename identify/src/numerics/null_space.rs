//! The canonical form of a null space: combinations of parameters in reduced row echelon form.
//!
//! The form depends on the space and on a fixed order of preference of the parameters only, not on the basis from the
//! decomposition. Neither rounding nor the order of declarations in a session affects it.

use faer::{Mat, MatRef};

use super::solve::solve_square;
use super::tolerances::{MIN_IDENTIFIABLE, ROUNDING_OF_COMBINATIONS};

/// The combinations of a null space in canonical form (see [`echelon`]), without coefficients that are due to noise,
/// and the pivot of each. `scaled` is the whitened triangular factor in scaled parameters.
pub fn combinations(
    null_space: MatRef<'_, f64>,
    scaled: MatRef<'_, f64>,
    preference: &[usize],
    least: f64,
) -> (Vec<Vec<f64>>, Vec<usize>) {
    let (mut rows, pivots) = echelon(null_space, preference, least);
    for (row, pivot) in rows.iter_mut().zip(&pivots) {
        prune(row, *pivot, scaled, preference);
    }
    (rows, pivots)
}

/// Drops the smallest coefficients one by one as long as the remaining combination is not identifiable: such
/// coefficients are due to noise. Coefficients of equal size are tried in reverse order of preference.
fn prune(row: &mut [f64], pivot: usize, scaled: MatRef<'_, f64>, preference: &[usize]) {
    let signal = |row: &[f64]| -> f64 {
        let change: f64 =
            (0..scaled.nrows()).map(|i| (0..row.len()).map(|j| scaled[(i, j)] * row[j]).sum::<f64>().powi(2)).sum();
        change.sqrt() / row.iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    // A reported combination is an approximate null direction. Twice the limit is still below the noise.
    let limit = 2.0 * signal(row).max(MIN_IDENTIFIABLE);
    let largest = row.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let mut order: Vec<usize> = preference
        .iter()
        .rev()
        .copied()
        .filter(|j| *j != pivot && row[*j] != 0.0 && row[*j].abs() < MAX_PRUNED_SHARE * largest)
        .collect();
    order.sort_by_key(|j| magnitude(row[*j]));
    for j in order {
        let kept = std::mem::take(&mut row[j]);
        if signal(row) > limit {
            row[j] = kept;
        }
    }
}

/// The magnitude of a number in steps of 10⁻⁴ of itself, so that numbers that differ by rounding alone compare equal.
/// It serves as a key for stable sorts, which leave equal entries in the order of their names.
pub fn magnitude(value: f64) -> i64 {
    (value.abs().max(f64::MIN_POSITIVE).ln() * 1e4).round() as i64
}

/// Coefficients below this share of the largest coefficient of the combination may be pruned.
const MAX_PRUNED_SHARE: f64 = 0.02;

/// A parameter is a pivot if its part in the remaining null space is at least this share of the largest such part. The
/// share is large enough for a stable elimination. It is no ratio of round lengths, so that parts of a geometry in
/// round numbers are not equal to it and rounding cannot decide.
pub const MIN_PIVOT: f64 = 0.0937;

/// The reduced row echelon form of a space, and the pivot of each row, in the order of preference. Each row has 1 at
/// its own pivot, 0 at the others, and 0 at coefficients that are rounding errors. `space` is an orthonormal basis
/// (parameters × dimension). The form is the same for every orthonormal basis of a space. The part of a parameter is
/// the distance of its unit vector's projection from the span of the earlier pivots' projections. No rotation of the
/// basis changes this distance.
///
/// A parameter is skipped if its part is smaller than `least` times the largest remaining part.
pub fn echelon(space: MatRef<'_, f64>, preference: &[usize], least: f64) -> (Vec<Vec<f64>>, Vec<usize>) {
    let (n, dimension) = (space.nrows(), space.ncols());
    // The remaining projection of each parameter, one row each.
    let mut remaining: Vec<Vec<f64>> = (0..n).map(|j| (0..dimension).map(|k| space[(j, k)]).collect()).collect();
    let mut pivots: Vec<usize> = Vec::new();
    while pivots.len() < dimension {
        let length = |j: usize| remaining[j].iter().map(|v| v * v).sum::<f64>().sqrt();
        let free = |j: &usize| !pivots.contains(j);
        let largest = (0..n).filter(free).map(length).fold(0.0, f64::max);
        let next = preference.iter().copied().filter(free).find(|j| length(*j) >= least * largest);
        let Some(pivot) = next.filter(|_| largest > ROUNDING_OF_COMBINATIONS) else {
            break;
        };
        let along = length(pivot);
        let unit: Vec<f64> = remaining[pivot].iter().map(|v| v / along).collect();
        for row in &mut remaining {
            let share: f64 = row.iter().zip(&unit).map(|(v, u)| v * u).sum();
            row.iter_mut().zip(&unit).for_each(|(v, u)| *v -= share * u);
        }
        pivots.push(pivot);
    }
    // A parameter that was skipped may become a pivot later, after larger parts are eliminated.
    pivots.sort_by_key(|pivot| preference.iter().position(|j| j == pivot));
    // With P the rows of the basis at the pivots, the form is (basis · P⁻¹)ᵀ.
    let count = pivots.len();
    if count == 0 || count < dimension {
        return (Vec::new(), Vec::new());
    }
    let at_pivots = Mat::from_fn(count, dimension, |i, k| space[(pivots[i], k)]);
    let form = space * solve_square(at_pivots.as_ref(), Mat::identity(count, count).as_ref());
    let rows = (0..count)
        .map(|i| {
            let largest = (0..n).fold(0.0_f64, |most, j| most.max(form[(j, i)].abs()));
            (0..n)
                .map(|j| match pivots.iter().position(|pivot| *pivot == j) {
                    Some(place) => f64::from(u8::from(place == i)),
                    None if form[(j, i)].abs() < ROUNDING_OF_COMBINATIONS * largest => 0.0,
                    None => form[(j, i)],
                })
                .collect()
        })
        .collect();
    (rows, pivots)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rotation in the plane of two columns.
    fn rotated(space: &Mat<f64>, a: usize, b: usize, angle: f64) -> Mat<f64> {
        let (sin, cos) = angle.sin_cos();
        Mat::from_fn(space.nrows(), space.ncols(), |i, k| {
            if k == a {
                cos * space[(i, a)] - sin * space[(i, b)]
            } else if k == b {
                sin * space[(i, a)] + cos * space[(i, b)]
            } else {
                space[(i, k)]
            }
        })
    }

    /// Five parameters with the null space `x0 − x1`, `x1 + 2 x2 − x3`, `x4`. The combinations are those of the
    /// equations, for every basis of the space and for rounding errors of 10⁻¹⁰.
    #[test]
    fn the_canonical_null_space_is_independent_of_the_basis() {
        let raw = [[1.0, -1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 2.0, -1.0, 0.0], [0.0, 0.0, 0.0, 0.0, 1.0]];
        // Gram–Schmidt.
        let mut orthonormal: Vec<Vec<f64>> = Vec::new();
        for vector in raw {
            let mut vector = vector.to_vec();
            for other in &orthonormal {
                let along: f64 = vector.iter().zip(other).map(|(a, b)| a * b).sum();
                vector.iter_mut().zip(other).for_each(|(v, o)| *v -= along * o);
            }
            let length = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
            orthonormal.push(vector.iter().map(|v| v / length).collect());
        }
        let space = Mat::from_fn(5, 3, |i, k| orthonormal[k][i]);
        for (preference, wanted) in [
            // Pivots x0, x1, x4: in terms of x2 and x3.
            (
                [0, 1, 2, 3, 4],
                vec![
                    (0, vec![1.0, 0.0, 2.0, -1.0, 0.0]),
                    (1, vec![0.0, 1.0, 2.0, -1.0, 0.0]),
                    (4, vec![0.0, 0.0, 0.0, 0.0, 1.0]),
                ],
            ),
            // Pivots x4, x3, x0: in terms of x1 and x2.
            (
                [4, 3, 0, 1, 2],
                vec![
                    (4, vec![0.0, 0.0, 0.0, 0.0, 1.0]),
                    (3, vec![0.0, -1.0, -2.0, 1.0, 0.0]),
                    (0, vec![1.0, -1.0, 0.0, 0.0, 0.0]),
                ],
            ),
        ] {
            for (angle, other) in [(0.0, 0.0), (0.3, 1.1), (2.0, -0.7), (std::f64::consts::PI, 0.5)] {
                let basis = rotated(&rotated(&space, 0, 1, angle), 1, 2, other);
                let noisy = Mat::from_fn(5, 3, |i, k| basis[(i, k)] + 1e-11 * ((7 * i + 3 * k) % 5) as f64);
                let (rows, pivots) = echelon(noisy.as_ref(), &preference, MIN_PIVOT);
                assert_eq!(pivots, wanted.iter().map(|(pivot, _)| *pivot).collect::<Vec<_>>());
                for (row, (_, wanted)) in rows.iter().zip(&wanted) {
                    for (value, wanted) in row.iter().zip(wanted) {
                        assert!((value - wanted).abs() < 1e-8, "{row:?} {wanted:?}");
                        assert_eq!(*value == 0.0, *wanted == 0.0, "{row:?}");
                    }
                }
            }
        }
    }
}
