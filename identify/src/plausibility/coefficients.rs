//! Coefficients of effects that no machine has.
//!
//! The numbers of a declared effect, such as a period far below the distance of the readings, may make its columns nearly
//! zero in all of them. The fit then explains micrometres by a coefficient of kilometres. Such an estimate is named.

use crate::fit::Fit;
use crate::parameters::physical_size;
use crate::problem::Problem;
use crate::results::COVERAGE_FACTOR;

/// Largest coefficient, in physical sizes of its component: 100 mm, 1 rad.
const MAX_SIZES: f64 = 100.0;

/// One warning for each effect with a coefficient that exceeds 100 mm or 1 rad of its component by more than its expanded
/// uncertainty.
pub fn warnings(problem: &Problem, fit: &Fit) -> Vec<String> {
    let mut named: Vec<usize> = Vec::new();
    let mut warnings = Vec::new();
    for (j, parameter) in problem.parameters.list.iter().enumerate() {
        let Some(effect) = parameter.coefficient_of() else { continue };
        let component = &problem.parameters.effects[effect].component;
        let Some(unit) = component.unit(&problem.session.instrument_parameters()) else { continue };
        let u = fit.covariance[(j, j)].max(0.0).sqrt() * fit.u_enlargement;
        let beyond = fit.beta[j].abs() - COVERAGE_FACTOR * u > MAX_SIZES * physical_size(unit);
        if !beyond || named.contains(&effect) {
            continue;
        }
        named.push(effect);
        warnings.push(format!(
            "{} has a coefficient of {:.3e} {}, which no machine has: the effect changes the readings hardly at all; check its numbers, such as \
             its period, centre or width, or remove it",
            problem.parameters.effects[effect].id(),
            fit.beta[j].abs() * parameter.unit.display_per_internal,
            parameter.unit.symbol(),
        ));
    }
    warnings
}
