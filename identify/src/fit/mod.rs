//! Estimation of the parameters of a session from its readings.
//!
//! The rank is decided on the linearisation at the nominal machine, and once more where the fit ends. Gauss–Newton iterates
//! in the identifiable directions only. A non-identifiable combination keeps its nominal value and is reported as a
//! combination, never as a number. The law of propagation gives the uncertainties, `Cov = N (Nᵀ JᵀV⁻¹J N)⁻¹ Nᵀ`. The columns of `N` span the
//! identifiable directions (JCGM 100, 5.2; JCGM 102, 6.2).

mod aliases;
mod assume;
pub mod base;
mod covariance;
mod cover;
pub mod families;
pub mod frames;
mod further_steps;
pub(crate) mod numbers;
pub mod outcome;
mod positions;
mod prepare;
mod quantities;
mod reported;
mod result;
pub mod tpoint;

use std::cell::RefCell;

use abbe_model::Diagnostic;
use abbe_model::parameter_id::ParameterId;
use abbe_model::session::Prior;
use abbe_model::words::listed;
use faer::Mat;

use crate::heldout::{HeldOut, held_out};
use crate::noise::{NoiseSource, Repeatability, ShownNoise};
use crate::numerics::least_squares::{LeastSquares, Scaling, minimise};
use crate::numerics::rank::Rank;
use crate::numerics::tails::residual_tail;
use crate::numerics::triangle::Triangle;
use crate::parameters::Parameter;
use crate::problem::Problem;

pub use aliases::{AliasChange, EffectAliases, at_solution as aliases_at_solution};
pub use assume::{assume, statements as assumptions};
pub use covariance::{null_space, of_parameters as covariance_of_parameters};
pub use cover::contribution as contribution_beside_noise;
pub use numbers::NumberInterval;
pub(crate) use outcome::{doubt_on_unit, ratio_of_another_unit};
pub use positions::StepPosition;
pub use prepare::{NearMinimum, prepare, prepare_with, refit, with_families_linearised, with_lever};
pub(crate) use quantities::{Quantity, quantities, values_at};
pub(crate) use reported::parameters_of_noise;
pub use reported::{JudgedBy, model, outliers, parameters, report, unobservable};
pub use result::FitResult;

/// The result of a fit, in internal units.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Estimates of all parameters. A parameter in a null-space combination holds its identifiable part only.
    pub beta: Vec<f64>,
    /// Identifiable and null directions.
    pub rank: Rank,
    /// Covariance of the parameters (identifiable part), from the noise alone.
    pub covariance: Mat<f64>,
    /// The triangular factors of the folds at the solution.
    pub triangles: Vec<Triangle>,
    /// Those at the nominal machine, if the fit has decided its rank there.
    pub nominal: Option<Vec<Triangle>>,
    /// Residuals by test, mm.
    pub residuals: Vec<Vec<f64>>,
    /// What repeats show at these residuals, if the search for the noise has computed it.
    pub repeats: Option<Repeatability>,
    /// Held-out residuals.
    pub held_out: HeldOut,
    /// χ², with each prior as an observation.
    pub chi_square: f64,
    /// Degrees of freedom of χ².
    pub degrees_of_freedom: usize,
    /// The Birge ratio `√(χ²/ν)`. It is below 1 if the readings scatter less than the assumed noise; without degrees of
    /// freedom it is `√χ²`.
    pub birge_ratio: f64,
    /// Probability of a larger χ² if the model lacks nothing. A noise from repeats has the degrees of freedom of their
    /// pure error.
    pub p_value: f64,
    /// Factor on the standard uncertainties: the Birge ratio if it is significantly above 1, else 1.
    pub u_enlargement: f64,
    /// How the parameters change if an alias takes the place of an effect, for each effect with aliases.
    pub aliases: Vec<EffectAliases>,
    /// The 95 % intervals of the numbers of shapes in which χ² is not parabolic.
    pub intervals: Vec<NumberInterval>,
    /// The estimated positions of steps.
    pub positions: Vec<StepPosition>,
    /// What steps beside the estimated ones may change: the change of each parameter, internal units, with its weight.
    pub further_steps: Vec<(f64, Vec<f64>)>,
}

/// Significance level of the χ² test of the residual against the noise.
const BIRGE_SIGNIFICANCE: f64 = 1e-3;

/// The least-squares problem of a session, restricted to the identifiable directions.
struct IdentifiableDirections<'p> {
    problem: &'p Problem,
    rank: &'p Rank,
    /// The last linearisation: the parameters, and the triangular factors of the folds at these values.
    last: RefCell<(Vec<f64>, Vec<Triangle>)>,
}

/// Number of parameters that a message about the iterations names.
const MAX_NAMED: usize = 3;

impl LeastSquares for IdentifiableDirections<'_> {
    fn parameters(&self) -> usize {
        self.rank.identifiable_basis.ncols()
    }

    fn linearise(&self, z: &[f64]) -> Result<Triangle, Diagnostic> {
        let beta = self.rank.parameters_at(z);
        if self.last.borrow().0 != beta {
            let triangles = self.problem.triangles(&beta)?;
            self.last.replace((beta, triangles));
        }
        let (beta, triangles) = &*self.last.borrow();
        Ok(self.problem.prior_triangle(beta).merged(triangles).in_directions(&self.rank.identifiable_basis))
    }

    fn sum_of_squares(&self, z: &[f64]) -> f64 {
        self.problem.sum_of_squares(&self.rank.parameters_at(z))
    }

    fn degrees_of_freedom(&self) -> f64 {
        freedom(self.problem, self.rank).max(1) as f64
    }

    /// The largest step against its physical size first.
    fn still_moved(&self, step: &[f64]) -> String {
        let list = &self.problem.parameters.list;
        let mut moved: Vec<(f64, &ParameterId)> = (self.rank.parameters_at(step).iter().zip(list))
            .map(|(step, parameter)| ((step / parameter.size).abs(), &parameter.id))
            .filter(|(share, _)| *share > 0.0)
            .collect();
        moved.sort_by(|a, b| b.0.total_cmp(&a.0));
        let names: Vec<String> = moved.iter().take(MAX_NAMED).map(|(_, id)| id.to_string()).collect();
        match names[..] {
            [] => String::new(),
            _ => format!(
                "; the iterations still move {}, which these readings hardly determine: state their uncertainties, leave errors \
                 out of `[unknowns]`, or add readings that separate them",
                listed(&names, "and")
            ),
        }
    }
}

/// Fits a problem, starting from the nominal machine or from given parameters.
///
/// # Errors
/// If there are no parameters, the model cannot be evaluated, or the iterations do not converge.
pub fn fit(problem: &Problem, start: Option<&[f64]>) -> Result<Fit, Diagnostic> {
    finish(problem, minimum(problem, start)?)
}

/// The minimum of the sum of squares of readings and priors.
pub struct Minimum {
    /// Estimates of all parameters, in internal units (mm, rad).
    pub beta: Vec<f64>,
    /// The triangular factors of the folds at `beta`.
    pub triangles: Vec<Triangle>,
    /// The rank at the nominal machine, or at `beta` where it is larger.
    pub rank: Rank,
    /// The triangular factors of the folds at the nominal machine, if they decided the rank of all parameters.
    pub nominal: Option<Vec<Triangle>>,
}

/// Singular value at the solution, in standard deviations per physical size, from which a direction is identifiable that
/// is none at the nominal machine: its uncertainty is a tenth of the physical size.
const IDENTIFIED_BY_ERRORS: f64 = 10.0;
/// Maximum number of ranks at solutions.
const MAX_RANKS: usize = 3;
/// Change of an error by such a direction, in physical sizes, from which it is no estimate.
const FAR: f64 = 10.0;
/// Step from a linearisation, in physical sizes, at which the readings are linear.
const LINEAR: f64 = 1e-5;

/// Minimises the sum of squares in the identifiable directions, from the nominal machine or from given parameters. Errors of
/// the machine may make directions identifiable that the nominal machine hides: the iterations then go on with these.
///
/// # Errors
/// If the model cannot be evaluated, or the iterations do not converge.
pub fn minimum(problem: &Problem, start: Option<&[f64]>) -> Result<Minimum, Diagnostic> {
    minimum_beside(problem, start, None)
}

/// The same after a change of noise and outliers alone, which leaves the rank of the fit `before` where all parameters are
/// well determined. The linearisation at the nominal machine is spared then.
fn minimum_beside(problem: &Problem, start: Option<&[f64]>, before: Option<&Fit>) -> Result<Minimum, Diagnostic> {
    let has_families = !families::families(&problem.parameters).is_empty();
    let is_determined = |rank: &Rank| rank.singular_values.last().is_none_or(|least| *least > IDENTIFIED_BY_ERRORS);
    let again = match before.filter(|before| !has_families && is_determined(&before.rank)) {
        Some(before) => Some(rank_at(problem, &in_sizes(problem, &before.beta))?),
        None => None,
    };
    let again = again.filter(|(rank, _)| is_determined(rank));
    let is_nominal = again.is_none() && !has_families;
    let (rank, linearised) = again.map_or_else(|| rank_at_nominal(problem), Ok)?;
    let nominal = is_nominal.then(|| linearised.1.clone());
    let mut found = minimum_of_rank(problem, rank, linearised, start)?;
    for _ in 0..MAX_RANKS {
        let is_full = found.rank.null_space.ncols() == 0;
        if is_full || has_families {
            break;
        }
        let whole = problem.prior_triangle(&found.beta).merged(&found.triangles);
        let rank =
            problem.parameters.rank_above(&whole, (IDENTIFIED_BY_ERRORS, found.rank.identifiable_basis.ncols()))?;
        if rank.null_space.ncols() >= found.rank.null_space.ncols() {
            break;
        }
        let Ok(further) =
            minimum_of_rank(problem, rank, (found.beta.clone(), found.triangles.clone()), Some(&found.beta))
        else {
            break;
        };
        // Far from the machine the readings depend on these directions in another way: what is found there is no estimate.
        let list = problem.parameters.list.iter();
        let is_far = |((after, before), parameter): ((&f64, &f64), &Parameter)| {
            !parameter.id.is_setup() && (after - before).abs() > FAR * parameter.size
        };
        let lowered = problem.sum_of_squares(&further.beta) <= problem.sum_of_squares(&found.beta);
        if !lowered || further.beta.iter().zip(&found.beta).zip(list).any(is_far) {
            break;
        }
        found = further;
    }
    Ok(Minimum { nominal, ..found })
}

/// The same in the identifiable directions of a rank. `linearised` are parameters and their triangular factors.
fn minimum_of_rank(
    problem: &Problem,
    rank: Rank,
    linearised: (Vec<f64>, Vec<Triangle>),
    start: Option<&[f64]>,
) -> Result<Minimum, Diagnostic> {
    let count = rank.identifiable_basis.ncols();
    let restricted = IdentifiableDirections { problem, rank: &rank, last: RefCell::new(linearised) };
    let sizes = problem.parameters.sizes();
    let from = start.map_or_else(|| vec![0.0; count], |beta| rank.coordinates(beta, &sizes));
    let mut end = None;
    if count > 0 {
        let scale = Scaling::Physical(vec![1.0; count]);
        let found = minimise(&restricted, &from, &scale)?;
        let last = rank.coordinates(&restricted.last.borrow().0, &sizes);
        if last.iter().zip(&found.x).any(|(last, end)| (end - last).abs() > LINEAR) {
            restricted.linearise(&found.x)?;
        }
        end = Some(rank.parameters_at(&found.x));
    }
    let (last, triangles) = restricted.last.into_inner();
    let beta = end.unwrap_or_else(|| last.clone());
    // After the last linearisation the parameters move by a step at which nonlinearity is negligible.
    let step: Vec<f64> = beta.iter().zip(&last).map(|(end, last)| end - last).collect();
    let triangles = triangles.iter().map(|triangle| triangle.after(&step)).collect();
    Ok(Minimum { beta, triangles, rank, nominal: None })
}

/// Degrees of freedom of χ². Each prior counts as an observation.
fn freedom(problem: &Problem, rank: &Rank) -> usize {
    let determined = rank.identifiable_basis.ncols() + problem.parameters.positions().count();
    (problem.scalars() + problem.prior_rows()).saturating_sub(determined)
}

/// The rank at the nominal machine, and the parameters and triangular factors of its linearisation. The priors of
/// families determine their coefficients, so the rank is that of the other parameters, and their linearisation is not
/// computed: there may be hundreds of them.
fn rank_at_nominal(problem: &Problem) -> Result<(Rank, (Vec<f64>, Vec<Triangle>)), Diagnostic> {
    let decided = |problem: &Problem| rank_at(problem, &vec![0.0; problem.parameters.list.len()]);
    if families::families(&problem.parameters).is_empty() {
        return decided(problem);
    }
    let (without, kept) = problem.without_families();
    let (rank, _) = decided(&without)?;
    let list = &problem.parameters.list;
    let least = |j: usize| match list[j].prior {
        Prior::Gaussian(scale) => list[j].size / scale,
        Prior::Free | Prior::Known => 0.0,
    };
    Ok((rank.among(&kept, &problem.parameters.sizes(), least), (Vec::new(), Vec::new())))
}

/// Parameters as multiples of their physical sizes, in which the iterations go on: equal but for the last digit.
fn in_sizes(problem: &Problem, beta: &[f64]) -> Vec<f64> {
    beta.iter().zip(problem.parameters.sizes()).map(|(beta, size)| beta / size * size).collect()
}

/// The rank at some parameters, and the linearisation there.
fn rank_at(problem: &Problem, beta: &[f64]) -> Result<(Rank, (Vec<f64>, Vec<Triangle>)), Diagnostic> {
    let triangles = problem.triangles(beta)?;
    let whole = problem.prior_triangle(beta).merged(&triangles);
    Ok((problem.parameters.rank(&whole)?, (beta.to_vec(), triangles)))
}

/// The parameters with each combination that is not identifiable at its nominal value.
fn identifiable(problem: &Problem, beta: &[f64]) -> Result<Vec<f64>, Diagnostic> {
    let (rank, _) = rank_at_nominal(problem)?;
    Ok(rank.parameters_at(&rank.coordinates(beta, &problem.parameters.sizes())))
}

/// Computes covariance, residuals, cross-validation and χ² at the solution.
fn finish(problem: &Problem, minimum: Minimum) -> Result<Fit, Diagnostic> {
    let Minimum { beta, triangles, rank, nominal } = minimum;
    let whole = problem.prior_triangle(&beta).merged(&triangles);
    let covariance = whole.covariance(&rank.identifiable_basis)?;
    let (residuals, held_out) = held_out(problem, &beta, &triangles, &whole, &rank.identifiable_basis)?;
    // The inflation of the likelihood is no noise: readings count with the noise, priors as they are.
    let (penalised, of_priors) = (whole.sum_of_squares(), problem.prior_triangle(&beta).sum_of_squares());
    let chi_square = penalised + (problem.noise.inflation - 1.0) * (penalised - of_priors);
    let degrees_of_freedom = freedom(problem, &rank);
    let free = degrees_of_freedom as f64;
    let p_value = residual_tail(chi_square, free, freedom_of_noise(problem, &residuals));
    let birge_ratio = (chi_square / free.max(1.0)).sqrt();
    let aliases = aliases::at_solution(problem, &beta)?;
    let mut fit = Fit {
        beta,
        rank,
        covariance,
        triangles,
        nominal,
        residuals,
        repeats: None,
        held_out,
        chi_square,
        degrees_of_freedom,
        birge_ratio,
        p_value,
        u_enlargement: 1.0,
        aliases,
        intervals: Vec::new(),
        positions: Vec::new(),
        further_steps: Vec::new(),
    };
    if fit.exceeds_noise() {
        // The inflation of the likelihood enlarges the uncertainties already.
        fit.u_enlargement = (birge_ratio / problem.noise.inflation.sqrt()).max(1.0);
    }
    Ok(fit)
}

impl Fit {
    /// Whether the residual exceeds the noise significantly.
    pub(crate) fn exceeds_noise(&self) -> bool {
        self.p_value < BIRGE_SIGNIFICANCE && self.birge_ratio > 1.0
    }
}

/// Degrees of freedom of a noise that follows from repeats or targets; `None` for a noise that is known.
fn freedom_of_noise(problem: &Problem, residuals: &[Vec<f64>]) -> Option<usize> {
    let kept = |test: usize, row: usize| !problem.rejected[test][row];
    match problem.noise.source {
        NoiseSource::Repeats => Some(problem.repeatability(residuals).freedom),
        NoiseSource::Targets => ShownNoise::of(&problem.tests, residuals, kept).map(|shown| shown.freedom),
        _ => None,
    }
}

/// Factor on the standard uncertainties: the Birge ratio `√(χ²/ν)` if it is significantly above 1, else 1. A noise from
/// repeats has degrees of freedom of its own.
pub(crate) fn u_enlargement(chi_square: f64, free: f64, of_noise: Option<usize>) -> f64 {
    if residual_tail(chi_square, free, of_noise) < BIRGE_SIGNIFICANCE {
        (chi_square / free).sqrt().max(1.0)
    } else {
        1.0
    }
}

/// The warning about enlarged uncertainties, if they are enlarged.
pub fn enlargement_warning(enlargement: f64) -> Option<String> {
    (enlargement > 1.0).then(|| {
        format!(
            "the residual exceeds the noise (χ² is {:.2} times its degrees of freedom); uncertainties are enlarged by {enlargement:.2}; \
             trace the residual to find the unmodelled effect",
            enlargement.powi(2)
        )
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use statrs::distribution::{ContinuousCDF, FisherSnedecor};

    use super::*;
    use crate::numerics::tails::chi_square_tail;

    /// A noise from repeats is known to as many degrees of freedom as its repeats have: readings of all runs but one for
    /// each place, since a mean of each place is taken off, and a straight line of each run but one.
    #[test]
    fn a_noise_from_repeats_is_tested_by_f() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        session.noise_mm = None;
        let (mut problem, first) = prepare(&session, 1).unwrap();
        assert_eq!(problem.noise.source, NoiseSource::Repeats);
        // A residual beyond the noise by three hundredths.
        problem.noise.sigma_mm *= first.birge_ratio / 1.03;
        let fit = fit(&problem, None).unwrap();
        let freedom = freedom_of_noise(&problem, &fit.residuals).unwrap();
        assert!(freedom > 0 && freedom < problem.scalars(), "{freedom} of {}", problem.scalars());
        let free = fit.degrees_of_freedom as f64;
        let law = FisherSnedecor::new(free, freedom as f64).unwrap();
        let wanted = law.sf(fit.chi_square / free);
        assert!((fit.p_value - wanted).abs() <= 1e-9 * wanted, "{} and {wanted}", fit.p_value);
        assert!(wanted > 1.2 * chi_square_tail(fit.chi_square, free) && wanted < 0.5, "{wanted}");
    }
}
