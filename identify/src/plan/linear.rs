//! A plan linearised: the triangle of every test, what is known before, and what follows for the unknowns.
//!
//! Everything that `abbe plan` says comes from here. Triangles are square roots of information, `RᵀR = JᵀV⁻¹J`: they are merged and
//! reduced by orthogonal transformations, so that nothing is lost by squaring (Bierman, Factorization Methods for Discrete Sequential
//! Estimation, 1977, ch. V).

use abbe_model::session::Prior;
use faer::{Mat, MatRef};

use crate::error::IdentifyError;
use crate::fit;
use crate::parameters::{Parameter, Role};
use crate::preference::pivot_preference;
use crate::problem::Problem;
use crate::rank::{MIN_IDENTIFIABLE, Rank};
use crate::triangle::{Triangle, upper};

/// A plan at its nominal state.
pub struct Linearisation {
    /// Readings of each test, without what is known before.
    pub tests: Vec<Triangle>,
    /// What is known before.
    pub prior: Triangle,
    /// All readings, without what is known before.
    pub readings: Triangle,
    /// Everything together.
    pub whole: Triangle,
    /// What is seen and what is not.
    pub rank: Rank,
    /// Covariance of the unknowns, seen part, internal units.
    pub covariance: Mat<f64>,
    /// Physical size of each unknown.
    pub size: Vec<f64>,
    /// The parameters in the order in which they are preferred as pivots.
    pub preference: Vec<usize>,
}

impl Linearisation {
    /// Of a problem whose folds are its tests, at the unknowns' values `beta`.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn of(problem: &Problem<'_>, beta: &[f64]) -> Result<Linearisation, IdentifyError> {
        let tests = problem.triangles(beta)?;
        let prior = problem.prior_triangle(beta);
        let size: Vec<f64> = problem
            .parameters
            .list
            .iter()
            .map(|parameter| parameter.size)
            .collect();
        let readings = merged(Triangle::new(size.len()), tests.iter());
        let whole = merged(prior.clone(), std::iter::once(&readings));
        let preference = pivot_preference(&problem.parameters.list);
        let rank = Rank::decide(whole.parts().0.as_ref(), &size, &preference)?;
        let covariance = fit::covariance(&whole, &rank.seen)?;
        Ok(Linearisation {
            tests,
            prior,
            readings,
            whole,
            rank,
            covariance,
            size,
            preference,
        })
    }

    /// Standard uncertainty of an unknown, internal unit; `None` where it takes part in an unseen combination.
    pub fn u(&self, unknown: usize) -> Option<f64> {
        self.rank
            .is_identifiable(unknown)
            .then(|| self.covariance[(unknown, unknown)].max(0.0).sqrt())
    }

    /// The same plan without some of its tests.
    ///
    /// # Errors
    /// If the decomposition fails.
    pub fn without(&self, left_out: &[usize]) -> Result<(Rank, Mat<f64>), IdentifyError> {
        let kept = self
            .tests
            .iter()
            .enumerate()
            .filter(|(test, _)| !left_out.contains(test))
            .map(|(_, t)| t);
        let whole = merged(self.prior.clone(), kept);
        let rank = Rank::decide(whole.parts().0.as_ref(), &self.size, &self.preference)?;
        let covariance = fit::covariance(&whole, &rank.seen)?;
        Ok((rank, covariance))
    }
}

/// A triangle with others merged into it.
pub fn merged<'t>(mut whole: Triangle, others: impl Iterator<Item = &'t Triangle>) -> Triangle {
    others.for_each(|triangle| whole.merge(triangle));
    whole
}

/// Whether an unknown is what a plan is made for: an error of the machine or a coefficient of a declared effect, not a set-up quantity.
pub fn is_wanted(parameter: &Parameter) -> bool {
    parameter.role != Role::Setup
}

/// The square-root information on `kept` unknowns once the others are unknown too: the lower right block of the triangle of
/// `[R_dropped R_kept]` (the Schur complement, without squaring).
///
/// Directions of the dropped unknowns of which `r` tells less than one standard deviation a physical size stay at their nominal values, as in a fit (see
/// [`crate::rank`]): a column of zeros would take a row of information along. Nothing is added to what `r` says.
///
/// # Errors
/// If `r` has entries that are not finite.
pub fn marginal(r: MatRef<'_, f64>, kept: &[usize], size: &[f64]) -> Result<Mat<f64>, IdentifyError> {
    let dropped: Vec<usize> = (0..size.len()).filter(|j| !kept.contains(j)).collect();
    let mut rows = Mat::from_fn(r.nrows().max(kept.len()), kept.len(), |i, j| {
        if i < r.nrows() { r[(i, kept[j])] } else { 0.0 }
    });
    if !dropped.is_empty() && r.nrows() > 0 {
        let scaled = Mat::from_fn(rows.nrows(), dropped.len(), |i, j| {
            if i < r.nrows() {
                r[(i, dropped[j])] * size[dropped[j]]
            } else {
                0.0
            }
        });
        let svd = scaled.thin_svd().map_err(|_| IdentifyError::Decomposition)?;
        let singular: Vec<f64> = svd.S().column_vector().iter().copied().collect();
        let rounding = singular.first().copied().unwrap_or(0.0) * 1e-13 * size.len() as f64;
        // What the dropped unknowns can explain is taken out of every column.
        let told = singular
            .iter()
            .filter(|s| **s >= MIN_IDENTIFIABLE && **s > rounding)
            .count();
        let directions = svd.U().subcols(0, told);
        let along = directions.transpose() * &rows;
        rows -= directions * along;
    }
    Ok(upper(rows))
}

/// The prior standard uncertainty of a set-up quantity, internal unit.
pub fn prior_u(parameter: &Parameter) -> Option<f64> {
    match parameter.prior {
        Prior::Gaussian(u) => Some(u),
        Prior::Known | Prior::Free => None,
    }
}
#[cfg(test)]
mod tests {
    use super::*;

    /// A reading of 0.1 µm sees an error and a ball together, and the ball is known to 300 µm: that is what is known of the error, all other errors being known,
    /// for there is none. A ball that nobody has placed and no reading sees takes nothing away.
    #[test]
    fn what_is_dropped_is_known_by_its_prior_and_no_better() {
        let r = Mat::from_fn(3, 3, |i, j| {
            [[1e4, 1e4, 0.0], [0.0, 1.0 / 0.3, 0.0], [0.0; 3]][i][j]
        });
        let left = marginal(r.as_ref(), &[0], &[1.0; 3]).unwrap();
        let u = 1.0 / left[(0, 0)].abs();
        assert!((u / 0.3_f64.hypot(1e-4) - 1.0).abs() < 1e-9, "{u}");
        // Nothing dropped but that ball: the readings themselves.
        let both = marginal(r.as_ref(), &[0, 1], &[1.0; 3]).unwrap();
        let information = both.transpose() * &both;
        let whole = r.transpose() * &r;
        for i in 0..2 {
            for j in 0..2 {
                assert!((information[(i, j)] / whole[(i, j)] - 1.0).abs() < 1e-12);
            }
        }
    }
}
