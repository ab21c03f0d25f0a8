//! A linearised plan: the triangular factor of every test, the priors, and the resulting covariance.
//!
//! All predictions of a plan follow from it. A triangular factor is a square root of information, `RᵀR = JᵀV⁻¹J`.
//! Factors are merged and reduced by orthogonal transformations, so that squaring loses no precision (Bierman,
//! Factorization Methods for Discrete Sequential Estimation, 1977, ch. V).

use abbe_model::Diagnostic;
use abbe_model::session::Prior;
use faer::Mat;

use crate::numerics::rank::Rank;
use crate::numerics::triangle::Triangle;
use crate::parameters::{Parameter, pivot_preference};
use crate::problem::Problem;

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
    pub fn of(problem: &Problem, beta: &[f64]) -> Result<Linearisation, Diagnostic> {
        Linearisation::of_triangles(problem, beta, problem.triangles(beta)?)
    }

    /// The same from the triangular factors of the folds there.
    pub(crate) fn of_triangles(
        problem: &Problem,
        beta: &[f64],
        tests: Vec<Triangle>,
    ) -> Result<Linearisation, Diagnostic> {
        let prior = problem.prior_triangle(beta);
        let size = problem.parameters.sizes();
        let readings = Triangle::new(size.len()).merged(&tests);
        let whole = prior.clone().merged([&readings]);
        let preference = pivot_preference(&problem.parameters.list);
        let rank = Rank::decide(&whole, &size, &preference)?;
        let covariance = whole.covariance(&rank.identifiable_basis)?;
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
    pub fn without(&self, left_out: &[usize]) -> Result<(Rank, Mat<f64>), Diagnostic> {
        let kept = self.tests.iter().enumerate().filter(|(test, _)| !left_out.contains(test)).map(|(_, t)| t);
        self.with(&self.prior.clone().merged(kept))
    }

    /// Rank and covariance over the same parameters from another triangular factor.
    ///
    /// # Errors
    /// If the decomposition fails.
    pub fn with(&self, whole: &Triangle) -> Result<(Rank, Mat<f64>), Diagnostic> {
        let rank = Rank::decide(whole, &self.size, &self.preference)?;
        let covariance = whole.covariance(&rank.identifiable_basis)?;
        Ok((rank, covariance))
    }

    /// The square-root information on some parameters, priors included, with the others eliminated: see
    /// [`Triangle::marginal`].
    ///
    /// # Errors
    /// If the decomposition fails.
    pub fn marginal(&self, kept: &[usize]) -> Result<Mat<f64>, Diagnostic> {
        self.whole.marginal(kept, &self.size)
    }
}

/// Whether a parameter is a target of the plan: an error of the machine or a coefficient of a declared effect, not a
/// set-up quantity or a number of a shape.
pub fn is_of_interest(parameter: &Parameter) -> bool {
    parameter.id.is_error() || parameter.id.is_coefficient()
}

/// The prior standard uncertainty of a set-up quantity, internal unit.
pub fn prior_u(parameter: &Parameter) -> Option<f64> {
    match parameter.prior {
        Prior::Gaussian(u) => Some(u),
        Prior::Known | Prior::Free => None,
    }
}
