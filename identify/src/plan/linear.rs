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
use crate::problem::Problem;
use crate::rank::Rank;
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
    /// Covariance of the unknowns, seen part, inside units.
    pub covariance: Mat<f64>,
    /// Physical size of each unknown.
    pub size: Vec<f64>,
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
        let rank = Rank::decide(whole.parts().0.as_ref(), &size)?;
        let covariance = fit::covariance(&whole, &rank.seen)?;
        Ok(Linearisation {
            tests,
            prior,
            readings,
            whole,
            rank,
            covariance,
            size,
        })
    }

    /// Standard uncertainty of an unknown, inside unit; `None` where it takes part in an unseen combination.
    pub fn u(&self, unknown: usize) -> Option<f64> {
        self.rank
            .is_seen(unknown)
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
        let rank = Rank::decide(whole.parts().0.as_ref(), &self.size)?;
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
/// A dropped unknown of which nothing is known beforehand is held at its physical size (1 mm, 0.01 rad): a thousandth of that is seen,
/// and a column of zeros would take a row of information along.
pub fn marginal(r: MatRef<'_, f64>, kept: &[usize], size: &[f64]) -> Mat<f64> {
    let n = size.len();
    let dropped: Vec<usize> = (0..n).filter(|j| !kept.contains(j)).collect();
    let order: Vec<usize> = dropped.iter().chain(kept).copied().collect();
    let rows = (r.nrows() + dropped.len()).max(n);
    let stacked = Mat::from_fn(rows, n, |i, j| {
        if i < r.nrows() {
            r[(i, order[j])]
        } else if i - r.nrows() < dropped.len() && i - r.nrows() == j {
            1.0 / size[order[j]]
        } else {
            0.0
        }
    });
    let upper = upper(stacked);
    let first = dropped.len();
    Mat::from_fn(kept.len(), kept.len(), |i, j| {
        if i <= j {
            upper[(first + i, first + j)]
        } else {
            0.0
        }
    })
}

/// The prior standard uncertainty of a set-up quantity, inside unit.
pub fn prior_u(parameter: &Parameter) -> Option<f64> {
    match parameter.prior {
        Prior::Gaussian(u) => Some(u),
        Prior::Known | Prior::Free => None,
    }
}
