//! The 95 % intervals of the positions of found steps.
//!
//! χ² is constant in the position `p` of a step until the step passes a reading, so it has no curvature and the position no
//! standard uncertainty. The interval is that of the profile likelihood. With the other columns of the model projected out of
//! the readings `y` and of the column `s(p)` of the step,
//!
//! ```text
//! χ²(p) = |y|² − (s(p)·y)² / |s(p)|²
//! ```
//!
//! is the minimum over the height and all other parameters. On either side the interval ends where `χ²` has risen by the
//! 95 % quantile of one degree of freedom, enlarged as uncertainties are.

use abbe_identify::error::IdentifyError;
use abbe_identify::fit::{Fit, QUANTILE_95};
use abbe_identify::numerics::reduction::orthonormal_basis;
use abbe_identify::parameters::Role;
use abbe_identify::problem::Problem;
use abbe_model::effect::Effect;
use faer::{Mat, MatRef};

use crate::candidates::columns::Columns;

/// Share of a column that remains after the projection below which the model contains it.
const CONTAINED: f64 = 1e-6;
/// Smallest change of a position that is tried, as a share of the position plus one unit of it.
const FIRST: f64 = 1e-6;
/// Doublings of this change until χ² has risen.
const DOUBLINGS: usize = 50;
/// Bisections between the last two of them.
const BISECTIONS: usize = 12;
/// Relative pivot below which a column depends on those before it.
const DEPENDENT: f64 = 1e-9;

/// The intervals of the positions of the `number`-th effect, internal units of its driver; empty for a shape without
/// positions, `None` for a position where χ² does not rise on one side.
///
/// # Errors
/// If the model cannot be evaluated.
pub(super) fn intervals(problem: &Problem, fit: &Fit, number: usize) -> Result<Vec<Option<[f64; 2]>>, IdentifyError> {
    let effect = &problem.parameters.effects[number];
    let positions = effect.shape.positions();
    if positions.is_empty() {
        return Ok(Vec::new());
    }
    let columns = Columns::new(problem, &fit.beta);
    let rows = columns.model_rows(&fit.beta)?;
    let (of_prior, prior_residual, _) = problem.prior_triangle(&fit.beta).parts();
    let (readings, parameters) = (rows.nrows(), fit.beta.len());
    let model = Mat::from_fn(readings + of_prior.nrows(), parameters, |i, j| match i.checked_sub(readings) {
        Some(prior) => of_prior[(prior, j)],
        None => rows[(i, j)],
    });
    let residual = |i: usize| match i.checked_sub(readings) {
        Some(prior) => prior_residual[prior],
        None => rows[(i, parameters)],
    };
    let heights = (0..parameters)
        .filter(|j| matches!(problem.parameters.list[*j].role, Role::Coefficient { effect, .. } if effect == number));
    let mut found = Vec::with_capacity(positions.len());
    for (at, height) in positions.iter().zip(heights) {
        let others = basis_without(model.as_ref(), height);
        let readings = Mat::from_fn(model.nrows(), 1, |i, _| residual(i) + model[(i, height)] * fit.beta[height]);
        let without = beside(&others, &readings);
        let profile = Profile { columns: &columns, effect, others, without };
        let allowed = profile.chi_square(*at) + QUANTILE_95 * fit.u_enlargement.powi(2);
        let ends = [-1.0, 1.0].map(|side| profile.end(*at, side, allowed));
        found.push(if let [Some(low), Some(high)] = ends { Some([low, high]) } else { None });
    }
    Ok(found)
}

/// Orthonormal columns of the space of all columns but one.
fn basis_without(model: MatRef<'_, f64>, left_out: usize) -> Mat<f64> {
    let lengths = (0..model.ncols()).filter(|j| *j != left_out).map(|j| (j, model.col(j).norm_l2()));
    let kept: Vec<(usize, f64)> = lengths.filter(|(_, length)| *length > 0.0).collect();
    let scaled = Mat::from_fn(model.nrows(), kept.len(), |i, k| model[(i, kept[k].0)] / kept[k].1);
    orthonormal_basis(&scaled, DEPENDENT)
}

/// A column without its projection on an orthonormal basis.
fn beside(basis: &Mat<f64>, column: &Mat<f64>) -> Mat<f64> {
    column - basis * (basis.transpose() * column)
}

/// χ² as a function of the position of one step.
struct Profile<'p> {
    columns: &'p Columns<'p>,
    effect: &'p Effect,
    /// Orthonormal columns of the rest of the model.
    others: Mat<f64>,
    /// The readings without their projection on them.
    without: Mat<f64>,
}

impl Profile<'_> {
    fn chi_square(&self, at: f64) -> f64 {
        let whole = self.without.squared_norm_l2();
        let step = Effect { shape: self.effect.shape.with_positions(vec![at]), ..self.effect.clone() };
        let Some(set) = self.columns.effect_columns(&step) else { return whole };
        let mut column = Mat::zeros(self.without.nrows(), 1);
        self.columns.fill(&[&set], column.as_mut().subrows_mut(0, self.columns.rows()));
        let rest = beside(&self.others, &column);
        let square = rest.squared_norm_l2();
        if square <= CONTAINED * column.squared_norm_l2() {
            return whole;
        }
        whole - (rest.transpose() * &self.without)[(0, 0)].powi(2) / square
    }

    /// The position at which χ² exceeds what is allowed, on one side.
    fn end(&self, at: f64, side: f64, allowed: f64) -> Option<f64> {
        let exceeds = |change: f64| self.chi_square(at + side * change) > allowed;
        let (mut inside, mut outside) = (0.0, FIRST * (1.0 + at.abs()));
        let mut doublings = 0;
        while !exceeds(outside) {
            doublings += 1;
            if doublings > DOUBLINGS {
                return None;
            }
            (inside, outside) = (outside, 2.0 * outside);
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (inside + outside);
            if exceeds(middle) { outside = middle } else { inside = middle }
        }
        Some(at + side * outside)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use abbe_files::ReadOptions;
    use abbe_identify::fit::{fit, prepare};
    use abbe_model::driver::Driver;
    use abbe_model::effect::shape::Steps;
    use abbe_model::effect::{Component, Shape};

    use super::*;

    /// True positions, rad, and heights, mm, of steps that are added to measured readings.
    const AT: [f64; 2] = [1.3, 3.6];
    const HEIGHTS_MM: [f64; 2] = [4e-4, -7e-4];

    fn steps(at: [f64; 2]) -> Effect {
        let shape = Shape::Steps(Steps { at: at.to_vec() });
        Effect::new(Component::parse("EZC").unwrap(), Driver::parse("C"), shape)
    }

    fn with_steps(problem: &Problem, at: [f64; 2]) -> Problem {
        let mut problem = problem.clone();
        problem.add_effect(&steps(at)).unwrap();
        problem
    }

    /// Full fits with a step inside and outside of an end of its interval: χ² has risen by less and by more than the
    /// quantile. The intervals contain the true positions.
    #[test]
    fn an_interval_ends_where_full_fits_have_risen_by_the_quantile() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let (mut problem, _) = prepare(&abbe_files::session(&file, &ReadOptions::default()).unwrap(), 1).unwrap();
        let truth = with_steps(&problem, AT);
        let mut beta = vec![0.0; truth.parameters.list.len()];
        let before = truth.residuals(&beta);
        let count = beta.len();
        beta[count - 2..].copy_from_slice(&HEIGHTS_MM);
        let after = truth.residuals(&beta);
        for ((test, before), after) in problem.tests.iter_mut().zip(before).zip(after) {
            let readings = Arc::make_mut(test.readings.as_mut().unwrap());
            let changes = before.iter().zip(&after).map(|(before, after)| before - after);
            readings.observed.iter_mut().zip(changes).for_each(|(observed, change)| *observed += change);
        }
        let declared = with_steps(&problem, AT);
        let found = fit(&declared, None).unwrap();
        let ends = intervals(&declared, &found, declared.parameters.effects.len() - 1).unwrap();
        assert_eq!(ends.len(), 2);
        let allowed = QUANTILE_95 * found.u_enlargement.powi(2);
        let rise = |at: [f64; 2]| {
            let moved = with_steps(&problem, at);
            let fitted = fit(&moved, None).unwrap();
            moved.sum_of_squares(&fitted.beta) - declared.sum_of_squares(&found.beta)
        };
        for (k, ends) in ends.into_iter().enumerate() {
            let [low, high] = ends.unwrap();
            assert!(low < AT[k] && AT[k] < high && high - low < 1.0, "{low} {high}");
            for end in [low, high] {
                let at = |share: f64| {
                    let mut at = AT;
                    at[k] += share * (end - AT[k]);
                    at
                };
                let [inside, outside] = [rise(at(0.998)), rise(at(1.002))];
                assert!(inside < allowed && outside > allowed, "{inside} {allowed} {outside} at {end}");
            }
        }
    }
}
