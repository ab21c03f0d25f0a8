//! What a next test is for, as a figure of the information.

use faer::Mat;

use super::information::{Root, Shared};
use super::linear::is_wanted;
use crate::parameters::{Parameter, Role};
use crate::problem::Problem;

/// What a next test is for.
#[derive(Clone, Debug)]
pub enum Goal {
    /// The least worst standard uncertainty of the errors, 1 µm weighing as much as 1″.
    WorstUncertainty,
    /// The greatest distance in standard deviations between an effect of these coefficients (internal units; none: of one outside unit, at
    /// the worst phase) and the best that everything else, the other effect included, can make of it.
    Separation {
        /// The effect that is there.
        effect: String,
        /// Its coefficients.
        coefficients: Vec<f64>,
    },
}

/// The unknowns that a goal is about.
pub fn asked(problem: &Problem<'_>, goal: &Goal) -> Vec<usize> {
    let list = &problem.parameters.list;
    let is_asked = |parameter: &Parameter| match (goal, parameter.role) {
        (Goal::WorstUncertainty, _) => is_wanted(parameter),
        (Goal::Separation { effect, .. }, Role::Coefficient { effect: index, .. }) => {
            problem.parameters.effects[index].id() == *effect
        }
        _ => false,
    };
    (0..list.len()).filter(|j| is_asked(&list[*j])).collect()
}

/// The figure of a goal, the smaller the better.
pub fn figure(shared: &Shared, root: &Root, goal: &Goal) -> f64 {
    match goal {
        Goal::WorstUncertainty => shared.uncertainties(root).into_iter().fold(0.0, f64::max),
        Goal::Separation { coefficients, .. } => -separation(shared, root, coefficients),
    }
}

/// How many standard deviations what is asked about, with these coefficients, stands from the best that all others can make of it; without
/// coefficients that of one outside unit at the worst phase.
pub fn separation(shared: &Shared, root: &Root, coefficients: &[f64]) -> f64 {
    let block = shared.criterion_block(root);
    let first = shared.ids.len() - shared.asked;
    if coefficients.len() == shared.asked {
        return (0..shared.asked)
            .map(|i| {
                (i..shared.asked)
                    .map(|j| block[(i, j)] * coefficients[j])
                    .sum::<f64>()
                    .powi(2)
            })
            .sum::<f64>()
            .sqrt();
    }
    let one = 1.0 / shared.display_per_internal[first];
    let square = Mat::from_fn(shared.asked, shared.asked, |i, j| block[(i, j)] * one);
    match square.svd() {
        Ok(svd) => svd
            .S()
            .column_vector()
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min),
        Err(_) => 0.0,
    }
}

/// A figure as it is reported: the larger the better for separations.
pub fn reported(figure: f64, goal: &Goal) -> f64 {
    match goal {
        Goal::WorstUncertainty => figure,
        Goal::Separation { .. } => -figure,
    }
}
