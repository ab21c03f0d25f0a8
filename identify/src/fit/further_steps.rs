//! One step more than the model has: a search does not find a step that explains little, which may still change the errors
//! that share a part with it.
//!
//! A further step at `p` has the height `ĥ ± u` beside all other parameters, and these change by `δ` for each unit of it.
//! With heights like those of the found steps, `h ~ N(0, H²)`, its Bayes factor and the mean square of its height are
//!
//! ```text
//! B(p) = √(1 − s)·exp(s·ĥ²/(2u²)),    E[h²|p] = (s·ĥ)² + s·u²,    s = H²/(H² + u²)
//! ```
//!
//! At even odds for a further step somewhere on the travel, it exists with the probability `B̄/(1 + B̄)`, `B̄` the mean over the
//! positions. Uncertainties cover it by the law of total variance:
//!
//! ```text
//! u² = u₀² + Σ_p w(p)·δ(p)²·E[h²|p],    w(p) = B(p)/n / (1 + B̄)
//! ```

use abbe_model::Diagnostic;
use abbe_model::effect::Effect;

use super::positions::Projection;
use super::{Fit, Problem};
use crate::numerics::regression::dot;

/// Positions at which a further step is tried, at even distances on the travel.
const PLACES: usize = 64;

/// The changes of each parameter by a further step, root mean square, with the weight of its position.
///
/// # Errors
/// If the model cannot be evaluated.
pub(super) fn at_solution(problem: &Problem, fit: &Fit) -> Result<Vec<(f64, Vec<f64>)>, Diagnostic> {
    let parameters = &problem.parameters;
    let mut wide = problem.clone();
    let mut added = Vec::new();
    for (number, effect) in parameters.effects.iter().enumerate().filter(|(_, effect)| effect.positions_estimated) {
        let places = places(problem, fit, number)?;
        if !places.is_empty() {
            let first = wide.parameters.list.len();
            let alone = effect.alone();
            wide.add_effect(&Effect { shape: alone.shape.with_positions(places), ..alone })?;
            added.push((number, first..wide.parameters.list.len()));
        }
    }
    if added.is_empty() {
        return Ok(Vec::new());
    }
    let count = fit.beta.len();
    let mut at = fit.beta.clone();
    at.resize(wide.parameters.list.len(), 0.0);
    let (r, c, _) = wide.prior_triangle(&at).merged(&wide.triangles(&at)?).parts();
    let sizes = wide.parameters.sizes();
    let model = Projection::of(&r, &sizes, (0..count).collect())?;
    let (_, residual) = model.split(&c);
    let mut covered = Vec::new();
    for (number, columns) in added {
        let own = parameters.list.iter().zip(&fit.beta).filter(|(own, _)| own.coefficient_of() == Some(number));
        let squares: Vec<f64> = own.map(|(_, value)| value * value).collect();
        let mean_square = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
        // Logarithm of the Bayes factor, and changes for the root mean square of the height.
        let tried: Vec<(f64, Vec<f64>)> = columns
            .clone()
            .map(|j| {
                let column: Vec<f64> = (0..r.nrows()).map(|i| r[(i, j)] * sizes[j]).collect();
                let (along, rest) = model.split(&column);
                let prior = mean_square / (sizes[j] * sizes[j]);
                let (ln_factor, mean_square) = match Projection::information(&column, &rest) {
                    // The readings say nothing about its height.
                    None => (0.0, prior),
                    Some(information) => {
                        let height = dot(&rest, &residual) / information;
                        let variance = fit.u_enlargement.powi(2) / information;
                        let share = prior / (prior + variance);
                        let of_height = share * height * height / variance;
                        (0.5 * ((1.0 - share).ln() + of_height), (share * height).powi(2) + share * variance)
                    }
                };
                let mut changes = vec![0.0; count];
                let along: Vec<f64> = along.iter().map(|along| -along * mean_square.sqrt()).collect();
                model.add(&along, &sizes, &mut changes);
                (ln_factor, changes)
            })
            .collect();
        let most = tried.iter().map(|(ln_factor, _)| *ln_factor).fold(0.0, f64::max);
        let without = columns.len() as f64 * (-most).exp();
        let total: f64 = without + tried.iter().map(|(ln_factor, _)| (ln_factor - most).exp()).sum::<f64>();
        covered.extend(tried.into_iter().map(|(ln_factor, changes)| ((ln_factor - most).exp() / total, changes)));
    }
    Ok(covered)
}

/// Positions of a further step of an effect: away from the intervals in which its own steps lie.
fn places(problem: &Problem, fit: &Fit, effect: usize) -> Result<Vec<f64>, Diagnostic> {
    let own = &problem.parameters.effects[effect];
    let levels = problem.levels(own)?;
    let (Some(low), Some(high)) = (levels.first(), levels.last()) else { return Ok(Vec::new()) };
    let gap_of = |at: f64| levels.partition_point(|level| *level < at);
    let found: Vec<(f64, Option<[f64; 2]>)> = (fit.positions.iter())
        .filter(|position| position.effect == effect)
        .map(|position| (own.shape.positions()[position.step], position.interval_95))
        .collect();
    let is_found = |at: f64| {
        found.iter().any(|(own, interval)| {
            gap_of(*own).abs_diff(gap_of(at)) <= 1 || interval.is_some_and(|[low, high]| (low..=high).contains(&at))
        })
    };
    let spread = (1..PLACES).map(|k| low + (high - low) * k as f64 / PLACES as f64);
    Ok(spread.filter(|at| !is_found(*at)).collect())
}
