//! A linearised plan: the triangular factor of every test, the priors, and the resulting covariance.
//!
//! All predictions of a plan follow from it. A triangular factor is a square root of information, `RᵀR = JᵀV⁻¹J`.
//! Factors are merged and reduced by orthogonal transformations, so that squaring loses no precision (Bierman,
//! Factorization Methods for Discrete Sequential Estimation, 1977, ch. V).

use abbe_model::session::Prior;
use faer::{Mat, MatRef};

use crate::error::IdentifyError;
use crate::fit;
use crate::parameters::{Parameter, Role};
use crate::preference::pivot_preference;
use crate::problem::Problem;
use crate::rank::{MIN_IDENTIFIABLE, Rank};
use crate::triangle::{Triangle, upper};

/// A plan, linearised at nominal parameters.
pub struct Linearisation {
    /// Triangular factor of each test's readings, without priors.
    pub tests: Vec<Triangle>,
    /// Triangular factor of the priors.
    pub prior: Triangle,
    /// Triangular factor of all readings, without priors.
    pub readings: Triangle,
    /// Triangular factor of all readings and priors.
    pub whole: Triangle,
    /// Rank: identifiable directions and null space.
    pub rank: Rank,
    /// Covariance of the parameters over the identifiable directions, internal units.
    pub covariance: Mat<f64>,
    /// Physical size of each parameter.
    pub size: Vec<f64>,
    /// The parameters in the order in which they are preferred as pivots.
    pub preference: Vec<usize>,
}

impl Linearisation {
    /// Linearises a problem whose folds are its tests, at the parameter values `beta`.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn of(problem: &Problem, beta: &[f64]) -> Result<Linearisation, IdentifyError> {
        let tests = problem.triangles(beta)?;
        let prior = problem.prior_triangle(beta);
        let size: Vec<f64> = problem.parameters.list.iter().map(|parameter| parameter.size).collect();
        let readings = merged(Triangle::new(size.len()), tests.iter());
        let whole = merged(prior.clone(), std::iter::once(&readings));
        let preference = pivot_preference(&problem.parameters.list);
        let rank = Rank::decide(whole.parts().0.as_ref(), &size, &preference)?;
        let covariance = fit::parameter_covariance(&whole, &rank.identifiable_basis)?;
        Ok(Linearisation { tests, prior, readings, whole, rank, covariance, size, preference })
    }

    /// Standard uncertainty of a parameter, internal unit. `None` if the parameter is not identifiable.
    pub fn u(&self, parameter: usize) -> Option<f64> {
        self.rank.is_identifiable(parameter).then(|| self.covariance[(parameter, parameter)].max(0.0).sqrt())
    }

    /// The same plan without some of its tests.
    ///
    /// # Errors
    /// If the decomposition fails.
    pub fn without(&self, left_out: &[usize]) -> Result<(Rank, Mat<f64>), IdentifyError> {
        let kept = self.tests.iter().enumerate().filter(|(test, _)| !left_out.contains(test)).map(|(_, t)| t);
        let whole = merged(self.prior.clone(), kept);
        let rank = Rank::decide(whole.parts().0.as_ref(), &self.size, &self.preference)?;
        let covariance = fit::parameter_covariance(&whole, &rank.identifiable_basis)?;
        Ok((rank, covariance))
    }
}

/// A triangular factor with others merged into it.
pub fn merged<'t>(mut whole: Triangle, others: impl Iterator<Item = &'t Triangle>) -> Triangle {
    others.for_each(|triangle| whole.merge(triangle));
    whole
}

/// Whether a parameter is a target of the plan: an error of the machine or a coefficient of a declared effect, not a
/// set-up quantity.
pub fn is_of_interest(parameter: &Parameter) -> bool {
    parameter.role != Role::Setup
}

/// The square-root information on the `kept` parameters with the others eliminated: the lower right block of the
/// triangular factor of `[R_dropped R_kept]` (the Schur complement, without squaring).
///
/// Directions of the dropped parameters on which `r` has less information than one standard deviation per physical size
/// stay at their nominal values, as in a fit (see [`crate::rank`]). A column of zeros would otherwise remove a row of
/// information. No information is added to that of `r`.
///
/// # Errors
/// If `r` has entries that are not finite.
pub fn marginal(r: MatRef<'_, f64>, kept: &[usize], size: &[f64]) -> Result<Mat<f64>, IdentifyError> {
    let dropped: Vec<usize> = (0..size.len()).filter(|j| !kept.contains(j)).collect();
    let mut rows =
        Mat::from_fn(r.nrows().max(kept.len()), kept.len(), |i, j| if i < r.nrows() { r[(i, kept[j])] } else { 0.0 });
    if !dropped.is_empty() && r.nrows() > 0 {
        let scaled = Mat::from_fn(rows.nrows(), dropped.len(), |i, j| {
            if i < r.nrows() { r[(i, dropped[j])] * size[dropped[j]] } else { 0.0 }
        });
        let svd = scaled.thin_svd().map_err(|_| IdentifyError::Decomposition)?;
        let singular: Vec<f64> = svd.S().column_vector().iter().copied().collect();
        let rounding = singular.first().copied().unwrap_or(0.0) * 1e-13 * size.len() as f64;
        // The column space of the dropped parameters is projected out of every column.
        let informed = singular.iter().filter(|s| **s >= MIN_IDENTIFIABLE && **s > rounding).count();
        let directions = svd.U().subcols(0, informed);
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

    /// A reading with 0.1 µm noise depends on the sum of an error and a ball position with a prior of 300 µm. The prior
    /// then determines the error. A second ball position, with neither prior nor readings, removes no information.
    #[test]
    fn dropped_parameters_are_limited_by_their_priors() {
        let r = Mat::from_fn(3, 3, |i, j| [[1e4, 1e4, 0.0], [0.0, 1.0 / 0.3, 0.0], [0.0; 3]][i][j]);
        let left = marginal(r.as_ref(), &[0], &[1.0; 3]).unwrap();
        let u = 1.0 / left[(0, 0)].abs();
        assert!((u / 0.3_f64.hypot(1e-4) - 1.0).abs() < 1e-9, "{u}");
        // Only the second ball position is dropped: the information of the readings remains.
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
