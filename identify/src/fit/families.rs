//! Families of effects: their prior scales, and the inflation of the noise that these require.
//!
//! The scales maximise the marginal likelihood ([`crate::numerics::evidence`]). The misfit of a model is correlated
//! between neighbouring readings, so `n` readings do not carry `n` independent pieces of information, and the plain
//! marginal likelihood claims scales and uncertainties that other readings contradict. The likelihood is therefore
//! tempered: the variance of a reading is `κ σ²`, with the inflation `κ ≥ 1` (power likelihood: Holmes & Walker,
//! Biometrika 104 (2017) 497; Grünwald & van Ommen, Bayesian Analysis 12 (2017) 1069). `κ` is the least value at which
//! the held-out folds are covered:
//!
//! ```text
//! mean over the readings of fold k of  ‖y_k − J_k b₋ₖ‖² / (n_k σ² + tr J_k C₋ₖ J_kᵀ) = 1
//! ```
//!
//! `b₋ₖ` and `C₋ₖ` are mean and covariance without the fold. `κ = 1` if the folds are covered without inflation, as for
//! independent noise. Everything follows from the products `J_kᵀJ_k`, `J_kᵀy_k` and `y_kᵀy_k` of the folds, without another
//! pass over the readings.

mod bordered;
mod estimate;

use faer::linalg::solvers::{DenseSolveCore, Llt};
use faer::prelude::Solve;
use faer::{Mat, Side};

use abbe_model::Diagnostic;
use abbe_model::session::Prior;

use crate::error;
use crate::noise::NoiseSource;
use crate::numerics::evidence::{NormalEquations, Posterior};
use crate::numerics::parallel;
use crate::numerics::products::NormalProducts;
use crate::parameters::Parameters;
use crate::problem::Problem;
pub use bordered::Bordered;

/// A family of a problem: the effects that share a prior scale.
#[derive(Clone, Debug)]
pub struct Family {
    /// Its name.
    pub name: String,
    /// Its coefficients, by index among the parameters.
    pub parameters: Vec<usize>,
}

/// The families of a problem whose scale is estimated, in the order of their first effects.
pub fn families(parameters: &Parameters) -> Vec<Family> {
    let mut families: Vec<Family> = Vec::new();
    for (j, parameter) in parameters.list.iter().enumerate() {
        let Some(effect) = parameter.coefficient_of() else { continue };
        let Some(name) = parameters.effects[effect].family() else { continue };
        match families.iter_mut().find(|family| family.name == name) {
            Some(family) => family.parameters.push(j),
            None => families.push(Family { name, parameters: vec![j] }),
        }
    }
    families
}

/// The inflation that is tried first.
const FIRST_INFLATION: f64 = 30.0;

/// The readings of the folds in the form of normal equations, linearised at given parameters. Parameters are in
/// physical sizes, those of one family in a common size. Readings are whitened with the noise of the problem.
pub struct FoldEquations {
    equations: NormalEquations,
    folds: Vec<Fold>,
    /// Number of scalar readings.
    readings: f64,
    /// Index of each parameter among those of the problem.
    parameters: Vec<usize>,
    /// Size of each parameter.
    sizes: Vec<f64>,
    /// For each parameter, the value that its coordinate refers to: 0 for a coefficient of a family, else the point of
    /// the linearisation.
    origin: Vec<f64>,
}

/// The readings of a fold over scaled parameters.
struct Fold {
    products: NormalProducts,
    /// Number of scalar readings.
    readings: f64,
}

/// The estimated scales, and the model that they give.
pub struct Scales {
    /// Precision of each family, over scaled parameters.
    precisions: Vec<f64>,
    /// Variance of a reading in units of the whitening.
    variance: f64,
    /// The inflation.
    pub inflation: f64,
    /// The posterior of the scaled parameters.
    posterior: Posterior,
    /// Sum of squares of the residual of each held-out fold, in units of the whitening.
    pub held_out: Vec<f64>,
}

impl Scales {
    /// Sum of squares of the residuals of all held-out folds, in units of the whitening.
    pub fn held_out_sum(&self) -> f64 {
        self.held_out.iter().sum()
    }

    /// Effective number of parameters of each family.
    pub fn effective(&self) -> &[f64] {
        &self.posterior.effective
    }
}

impl FoldEquations {
    /// The readings of a problem at the parameters `beta`.
    ///
    /// # Errors
    /// If the model yields a number that is not finite.
    pub fn of(problem: &Problem, beta: &[f64]) -> Result<FoldEquations, Diagnostic> {
        let list = &problem.parameters.list;
        let count = list.len();
        let families = families(&problem.parameters);
        let mut sizes = problem.parameters.sizes();
        let mut origin = beta.to_vec();
        for family in &families {
            let common = family.parameters.iter().map(|j| sizes[*j]).fold(f64::INFINITY, f64::min);
            for j in &family.parameters {
                sizes[*j] = common;
                origin[*j] = 0.0;
            }
        }
        // In the coordinates x = (b − origin)/size the present point is not zero for coefficients of families.
        let present: Vec<f64> = (0..count).map(|j| (beta[j] - origin[j]) / sizes[j]).collect();
        let products = problem.products(beta)?;
        let mut readings = vec![0.0; products.len()];
        for (test, fold_of) in problem.folds.of_row.iter().enumerate() {
            let channels = problem.channels(test);
            for i in (0..fold_of.len() * channels).filter(|i| problem.counts(test, *i)) {
                readings[fold_of[i / channels]] += 1.0;
            }
        }
        let folds = parallel::map(products.len(), &|fold| Fold {
            products: products[fold].normal().in_sizes(&sizes, &present),
            readings: readings[fold],
        });
        let mut all = NormalProducts::none(count);
        folds.iter().for_each(|fold| all.add(&fold.products));
        let (prior, prior_projection) = fixed_prior(problem, beta, &families, &sizes, &present);
        Ok(FoldEquations {
            equations: NormalEquations {
                readings: all,
                prior,
                prior_projection,
                families: families.into_iter().map(|family| family.parameters).collect(),
            },
            folds,
            readings: readings.iter().sum(),
            parameters: (0..count).collect(),
            sizes,
            origin,
        })
    }

    /// The same equations with some of the families only; the coefficients of the others are zero.
    pub fn with_families(&self, kept: &[usize]) -> FoldEquations {
        let families = &self.equations.families;
        let dropped = (0..families.len()).filter(|family| !kept.contains(family));
        let absent: Vec<usize> = dropped.flat_map(|family| families[family].iter().copied()).collect();
        let present: Vec<usize> = (0..self.sizes.len()).filter(|j| !absent.contains(j)).collect();
        self.with_parameters(&present)
    }

    /// The same equations with some of the parameters only, in ascending order; the others stay at the point of the
    /// linearisation. Families without parameters are dropped.
    pub fn with_parameters(&self, present: &[usize]) -> FoldEquations {
        let some = |values: &[f64]| -> Vec<f64> { present.iter().map(|j| values[*j]).collect() };
        FoldEquations {
            equations: self.equations_of(present),
            folds: (self.folds.iter())
                .map(|fold| Fold { products: fold.products.of_parameters(present), readings: fold.readings })
                .collect(),
            readings: self.readings,
            parameters: present.iter().map(|j| self.parameters[*j]).collect(),
            sizes: some(&self.sizes),
            origin: some(&self.origin),
        }
    }

    /// The normal equations of some of the parameters only.
    fn equations_of(&self, present: &[usize]) -> NormalEquations {
        let place = |j: &usize| present.binary_search(j).ok();
        let some = |values: &[f64]| -> Vec<f64> { present.iter().map(|j| values[*j]).collect() };
        let own = &self.equations;
        let families = own.families.iter().map(|family| family.iter().filter_map(place).collect::<Vec<usize>>());
        NormalEquations {
            readings: own.readings.of_parameters(present),
            prior: Mat::from_fn(present.len(), present.len(), |i, j| own.prior[(present[i], present[j])]),
            prior_projection: some(&own.prior_projection),
            families: families.filter(|family| !family.is_empty()).collect(),
        }
    }

    /// The present precision of the family of a parameter.
    fn precision(&self, parameter: usize, problem: &Problem) -> f64 {
        match problem.parameters.list[self.parameters[parameter]].prior {
            Prior::Gaussian(scale) => (self.sizes[parameter] / scale).powi(2),
            Prior::Free | Prior::Known => START_PRECISION,
        }
    }

    /// Effective number of parameters among some parameters of one family, by index among those of the problem.
    pub fn effective_among(&self, scales: &Scales, parameters: &[usize]) -> f64 {
        let effective = |j: &usize| {
            let place = self.parameters.binary_search(j).ok()?;
            let family = self.equations.families.iter().position(|family| family.contains(&place))?;
            Some((1.0 - scales.precisions[family] * scales.posterior.covariance[(place, place)]).max(0.0))
        };
        parameters.iter().filter_map(effective).sum()
    }

    /// Sum of squares of the residual of each held-out fold, in units of the whitening, with the present scales and the
    /// present noise of the problem that the equations are of.
    ///
    /// # Errors
    /// If the equations are not positive definite.
    pub fn held_out_at_present(&self, problem: &Problem) -> Result<Vec<f64>, Diagnostic> {
        let precisions = self.precisions(problem);
        let of_folds =
            parallel::map(self.folds.len(), &|k| Ok(self.residual_without(k, PRESENT_VARIANCE, &precisions)?.0));
        of_folds.into_iter().collect()
    }

    /// The precision of each family at the present scales of the problem.
    fn precisions(&self, problem: &Problem) -> Vec<f64> {
        self.equations.families.iter().map(|own| self.precision(own[0], problem)).collect()
    }

    /// For each fold, the sum of squares of its residual under the model without it, and the sum of its variances from
    /// the parameters.
    fn held_out(&self, variance: f64, precisions: &[f64]) -> Result<Vec<(f64, f64)>, Diagnostic> {
        let of_folds = parallel::map(self.folds.len(), &|k| self.without(k, variance, precisions));
        of_folds.into_iter().collect()
    }

    /// Number of scalar readings.
    pub fn readings(&self) -> f64 {
        self.readings
    }

    /// The families that the readings determine: those with at least `least` effective parameters at a wide scale and
    /// the inflation from which the estimation starts.
    ///
    /// # Errors
    /// If the equations are not positive definite.
    pub fn with_effect(&self, least: f64) -> Result<Vec<usize>, Diagnostic> {
        let start = vec![WIDE_PRECISION; self.equations.families.len()];
        let posterior = self.equations.posterior(FIRST_INFLATION, &start)?;
        let families = posterior.effective.iter().enumerate();
        Ok(families.filter(|(_, effective)| **effective >= least).map(|(family, _)| family).collect())
    }

    /// Sum of squares of a fold's residual under the model without it, and the sum of its variances from the parameters.
    fn without(&self, k: usize, variance: f64, precisions: &[f64]) -> Result<(f64, f64), Diagnostic> {
        let (square, factor) = self.residual_without(k, variance, precisions)?;
        let (gram, covariance) = (&self.folds[k].products.gram, factor.inverse());
        // tr J C Jᵀ
        let of_column = |j: usize| gram.col_as_slice(j).iter().zip(covariance.col_as_slice(j));
        let predicted = (0..gram.ncols()).flat_map(of_column).map(|(g, c)| g * c).sum();
        Ok((square, predicted))
    }

    /// Sum of squares of a fold's residual under the model without it, and the Cholesky factor of the information of that
    /// model.
    fn residual_without(&self, k: usize, variance: f64, precisions: &[f64]) -> Result<(f64, Llt<f64>), Diagnostic> {
        let fold = &self.folds[k].products;
        let information = self.equations.information(variance, precisions) - &fold.gram * faer::Scale(1.0 / variance);
        let factor = information.llt(Side::Lower).map_err(|_| error::decomposition())?;
        let right = self.equations.right_side(variance);
        let right = Mat::from_fn(right.len(), 1, |j, _| right[j] - fold.projection[j] / variance);
        Ok((fold.residual_square(factor.solve(&right).col_as_slice(0)), factor))
    }

    /// The parameters at the posterior mean, in internal units.
    pub fn beta(&self, scales: &Scales) -> Vec<f64> {
        (0..self.sizes.len()).map(|j| self.origin[j] + self.sizes[j] * scales.posterior.mean[j]).collect()
    }

    /// The prior standard deviation of each family, in internal units.
    fn scales(&self, scales: &Scales) -> Vec<f64> {
        let families = self.equations.families.iter().zip(&scales.precisions);
        families.map(|(family, precision)| self.sizes[family[0]] / precision.sqrt()).collect()
    }

    /// Sets priors and noise of the problem that the equations belong to.
    pub fn apply(&self, scales: &Scales, problem: &mut Problem) {
        for (family, scale) in families(&problem.parameters).iter().zip(self.scales(scales)) {
            for j in &family.parameters {
                problem.parameters.list[*j].prior = Prior::Gaussian(scale);
            }
        }
        let noise = &mut problem.noise;
        let sigma_mm = noise.likelihood_mm() * scales.variance.sqrt();
        if noise.source == NoiseSource::Residual {
            noise.sigma_mm = sigma_mm;
            noise.inflation = scales.inflation;
        } else {
            noise.inflation = (scales.inflation * (sigma_mm / noise.sigma_mm).powi(2)).max(1.0);
        }
    }
}

/// Variance of a reading at the present noise of the problem, which whitens the rows and includes the inflation.
const PRESENT_VARIANCE: f64 = 1.0;
/// Precision of a family of a wide scale: the physical size.
const WIDE_PRECISION: f64 = 1.0;
/// Precision of a family from which the estimation starts: a scale of a hundredth of the physical size.
const START_PRECISION: f64 = 1e4;

/// The priors other than those of the families, over scaled parameters. A parameter without a prior has a weak one of
/// one physical size about the point of the linearisation: directions that the readings do not identify stay there.
fn fixed_prior(
    problem: &Problem,
    beta: &[f64],
    families: &[Family],
    sizes: &[f64],
    present: &[f64],
) -> (Mat<f64>, Vec<f64>) {
    let count = sizes.len();
    let of_family = |j: usize| families.iter().any(|family| family.parameters.contains(&j));
    let triangle = problem.prior_triangle(beta);
    let rows = triangle.rows();
    let scaled = Mat::from_fn(rows.nrows(), count, |i, j| if of_family(j) { 0.0 } else { rows[(i, j)] * sizes[j] });
    // The rows of a family's own prior are zero now; their right-hand sides must not act either.
    let own = |i: usize| (0..count).any(|j| scaled[(i, j)] != 0.0);
    let y = Mat::from_fn(rows.nrows(), 1, |i, _| if own(i) { rows[(i, count)] } else { 0.0 });
    let mut precision = scaled.transpose() * &scaled;
    let projection = scaled.transpose() * &y;
    for (j, parameter) in problem.parameters.list.iter().enumerate() {
        if parameter.prior == Prior::Free {
            precision[(j, j)] += 1.0;
        }
    }
    // Parameters outside the families are at zero of their coordinates, so the priors' right-hand sides need no shift.
    debug_assert!((0..count).all(|j| of_family(j) || present[j] == 0.0));
    (precision, (0..count).map(|j| projection[(j, 0)]).collect())
}
