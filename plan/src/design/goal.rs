//! What a design makes small: one set of goals for tests and poses.

use abbe_identify::linear::is_of_interest;
use abbe_identify::numerics::solve::Svd;
use abbe_identify::parameters::Parameter;
use abbe_identify::problem::Problem;
use faer::Mat;

use super::information::{Root, SharedParameters};

/// Share of the mean variance in the figure of the worst one, so that it decides between equal ones.
const TIE: f64 = 1e-3;

/// The goal of a design. Of uncertainties, 1 µm has the same weight as 1″.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// The smallest maximum standard uncertainty of the errors.
    WorstUncertainty,
    /// The smallest mean variance of the errors.
    A,
    /// The smallest volume of the confidence ellipsoid of the errors.
    D,
    /// The largest separation, in standard deviations, of an effect from the best approximation by all other
    /// parameters, the other effect included. `coefficients` are in internal units. If they are empty, the effect has
    /// one display unit at the worst phase.
    Separation {
        /// The effect that is present.
        effect: String,
        /// Its coefficients.
        coefficients: Vec<f64>,
    },
}

impl Goal {
    /// What its value is, with its unit.
    pub fn words(&self) -> &'static str {
        match self {
            Goal::WorstUncertainty => "worst standard uncertainty, um or arcsec",
            Goal::A => "root mean square standard uncertainty, um or arcsec",
            Goal::D => {
                "geometric mean of the standard deviations along the axes of the confidence ellipsoid, um or arcsec"
            }
            Goal::Separation { .. } => "separation, standard deviations",
        }
    }

    /// Whether it is about uncertainties of errors.
    pub fn is_of_uncertainties(&self) -> bool {
        !matches!(self, Goal::Separation { .. })
    }

    /// Indices of its target parameters in a problem.
    pub fn targets(&self, problem: &Problem) -> Vec<usize> {
        let list = &problem.parameters.list;
        let is_target = |parameter: &Parameter| match self {
            Goal::Separation { effect, .. } => {
                parameter.coefficient_of().is_some_and(|own| problem.parameters.effects[own].id() == *effect)
            }
            _ => is_of_interest(parameter),
        };
        (0..list.len()).filter(|j| is_target(&list[*j])).collect()
    }

    /// The value at some information: an uncertainty in display units, or a separation.
    pub fn value(&self, shared: &SharedParameters, root: &Root) -> f64 {
        match self {
            Goal::WorstUncertainty => shared.uncertainties(root).into_iter().fold(0.0, f64::max),
            Goal::A => self.of_variances(shared.uncertainties(root).into_iter().map(|u| u * u)),
            Goal::D => self.of_log_determinant(shared.log_determinant(root), shared.targets),
            Goal::Separation { coefficients, .. } => separation(shared, root, coefficients),
        }
    }

    /// The figure that is compared at some information. Smaller ones are better.
    pub fn figure(&self, shared: &SharedParameters, root: &Root) -> f64 {
        match self {
            Goal::WorstUncertainty => self.of_variances(shared.uncertainties(root).into_iter().map(|u| u * u)),
            Goal::A | Goal::D => self.value(shared, root),
            Goal::Separation { .. } => -self.value(shared, root),
        }
    }

    /// The value that a figure stands for.
    pub fn reported(&self, figure: f64) -> f64 {
        if matches!(self, Goal::Separation { .. }) { -figure } else { figure }
    }

    /// The figure of variances in display units: of the worst one with a share of the mean, or of their mean.
    pub(super) fn of_variances(&self, variances: impl Iterator<Item = f64>) -> f64 {
        let (mut sum, mut worst, mut count) = (0.0, 0.0_f64, 0.0_f64);
        for variance in variances {
            sum += variance;
            worst = worst.max(variance);
            count += 1.0;
        }
        let mean = sum / count.max(1.0);
        if matches!(self, Goal::WorstUncertainty) { (worst + TIE * mean).sqrt() } else { mean.sqrt() }
    }

    /// The figure of the logarithm of the determinant of the covariance of some targets, in display units.
    pub(super) fn of_log_determinant(&self, log: f64, targets: usize) -> f64 {
        (0.5 * log / targets.max(1) as f64).exp()
    }
}

/// The distance, in standard deviations, of the target parameters at these coefficients from the best approximation by
/// all others. Without coefficients it is that of one display unit at the worst phase.
pub fn separation(shared: &SharedParameters, root: &Root, coefficients: &[f64]) -> f64 {
    let block = shared.criterion_block(root);
    let first = shared.ids.len() - shared.targets;
    if coefficients.len() == shared.targets {
        return (0..shared.targets)
            .map(|i| (i..shared.targets).map(|j| block[(i, j)] * coefficients[j]).sum::<f64>().powi(2))
            .sum::<f64>()
            .sqrt();
    }
    let one = 1.0 / shared.display_per_internal[first];
    let square = Mat::from_fn(shared.targets, shared.targets, |i, j| block[(i, j)] * one);
    Svd::of(square.as_ref()).map_or(0.0, |found| found.singular_values.last().copied().unwrap_or(f64::INFINITY))
}
