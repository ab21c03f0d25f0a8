//! The goal of a next test, and its figure of merit.

use faer::Mat;

use super::information::{Root, SharedParameters};
use abbe_identify::linear::is_of_interest;
use abbe_identify::numerics::solve::Directions;
use abbe_identify::parameters::{Parameter, Role};
use abbe_identify::problem::Problem;

/// The goal of a next test.
#[derive(Clone, Debug)]
pub enum Goal {
    /// The smallest maximum standard uncertainty of the errors. 1 µm has the same weight as 1″.
    WorstUncertainty,
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

/// Indices of the target parameters of a goal.
pub fn targets(problem: &Problem, goal: &Goal) -> Vec<usize> {
    let list = &problem.parameters.list;
    let is_target = |parameter: &Parameter| match (goal, parameter.role) {
        (Goal::WorstUncertainty, _) => is_of_interest(parameter),
        (Goal::Separation { effect, .. }, Role::Coefficient { effect: index, .. }) => {
            problem.parameters.effects[index].id() == *effect
        }
        _ => false,
    };
    (0..list.len()).filter(|j| is_target(&list[*j])).collect()
}

/// The figure of merit of a goal. Smaller values are better.
pub fn figure(shared: &SharedParameters, root: &Root, goal: &Goal) -> f64 {
    match goal {
        Goal::WorstUncertainty => shared.uncertainties(root).into_iter().fold(0.0, f64::max),
        Goal::Separation { coefficients, .. } => -separation(shared, root, coefficients),
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
    Directions::of(square.as_ref()).map_or(0.0, |found| found.singular_values.last().copied().unwrap_or(f64::INFINITY))
}

/// A figure as it is reported. Larger separations are better.
pub fn reported(figure: f64, goal: &Goal) -> f64 {
    match goal {
        Goal::WorstUncertainty => figure,
        Goal::Separation { .. } => -figure,
    }
}
