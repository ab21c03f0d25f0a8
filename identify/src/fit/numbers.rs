//! The numbers of shapes that a fit estimates: a period, a centre, a width, a time constant.
//!
//! A number `n` acts through the basis functions: `component = Σ_k c_k b_k(driver; n)`. It is a parameter of the problem as
//! its change `δ` from the number of the shape, linear in
//!
//! ```text
//! ∂component/∂n = Σ_k c_k ∂b_k/∂n
//! ```
//!
//! at the present coefficients (Gauss–Newton). After each fit the changes go into the shapes, by less if χ² would rise, and
//! the problem is linearised again. At the end all changes are zero, and the covariance of the fit contains the numbers:
//! what shares its constant part with a location error has its uncertainty there.
//!
//! The prior of a number is as wide as the interval in which a search tunes it, and always about the present value. It moves
//! no estimate, and leaves the rest determined where the readings do not determine the number.
//!
//! Where χ² is not parabolic in a number within two standard uncertainties, the interval of the profile likelihood is
//! stated: the values at which χ², minimised over all other parameters, rises by the 95 % quantile of one degree of freedom.
//! If it is longer than that of the covariance, uncertainties cover it. With the changes `δ` of a parameter to the ends of the
//! interval, and its half length `h`,
//!
//! ```text
//! u² = u₀² + w Σ_ends δ²,    w such that u = h/1.96 for the number itself
//! ```
//!
//! If several numbers have such an interval, each adds its part to the others, so that their `u` is at least `h/1.96`.

use abbe_model::Diagnostic;
use abbe_model::session::Prior;

use super::{Fit, finish, fit, minimum, minimum_beside, positions};
use crate::error::NO_CONVERGENCE;
use crate::numerics::tails::QUANTILE_95;
use crate::problem::Problem;

/// Maximum number of linearisations.
const MAX_ROUNDS: usize = 30;
/// Maximum number of moves of steps.
const MAX_MOVES: usize = 24;
/// Shares of a step that are tried until χ² does not rise.
const SHARES: [f64; 7] = [1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125, 0.015625];
/// Largest change of a number, as a share of its prior, at which the linearisations end.
const TOLERANCE: f64 = 1e-7;
/// Relative rise of χ² that is rounding.
const ROUNDING: f64 = 1e-12;
/// Rise of χ² at two standard uncertainties, if it is parabolic: 4. Between these limits it counts as that.
const PARABOLIC: [f64; 2] = [3.0, 5.3];
/// Steps of the search for an end of an interval.
const MAX_STEPS: usize = 24;
/// Relative accuracy of the rise of χ² at an end.
const END_TOLERANCE: f64 = 0.01;
/// Largest change of a number by the last fit, in standard uncertainties, at which it is at its best value.
const SETTLED: f64 = 0.1;
/// Standard deviation of the prior of a number that is held, as a share of its own.
const HELD: f64 = 1e-9;

/// A profile interval of a number.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberInterval {
    /// Index of the number among the parameters.
    pub parameter: usize,
    /// The ends of the 95 % interval, as changes of the number, internal units. An end at which the search for it ended may
    /// lie further out.
    pub ends: [f64; 2],
    /// The changes of all parameters to the ends, internal units, and the weight with which uncertainties cover their squares.
    pub covered: [(f64, Vec<f64>); 2],
}

/// As [`fit`], with the estimated numbers and positions of shapes moved to their best values in the problem. `before` is the
/// fit with other noise and outliers.
///
/// # Errors
/// As [`fit`].
pub(crate) fn fit_with_numbers(problem: &mut Problem, before: Option<&Fit>) -> Result<Fit, Diagnostic> {
    let mut found = at_positions(problem, before.map(|before| before.beta.as_slice()), before)?;
    for _ in 0..MAX_MOVES {
        let Some((mut moved, from)) = positions::moved(problem, &found.beta)? else { break };
        let next = at_positions(&mut moved, Some(&from), None)?;
        if moved.sum_of_squares(&next.beta) >= problem.sum_of_squares(&found.beta) {
            break;
        }
        (*problem, found) = (moved, next);
    }
    positions::centre(problem)?;
    Ok(found)
}

/// The fit with the positions that the shapes have.
fn at_positions(problem: &mut Problem, start: Option<&[f64]>, before: Option<&Fit>) -> Result<Fit, Diagnostic> {
    if !problem.parameters.has_numbers() {
        return finish(problem, minimum_beside(problem, start, before)?);
    }
    let start = match start {
        Some(beta) => beta.to_vec(),
        None => minimum(problem, None)?.beta,
    };
    let mut from = linearised(problem, start)?;
    settle(problem, &mut from)?;
    let is_settled = |found: &Fit| {
        numbers(problem).all(|j| found.beta[j].abs() <= SETTLED * found.covariance[(j, j)].max(0.0).sqrt())
    };
    match fit(problem, Some(&from)) {
        Ok(found) if is_settled(&found) => Ok(found),
        Err(error) if error.code != NO_CONVERGENCE => Err(error),
        _ => held(problem, &from),
    }
}

/// Takes the changes of the numbers in `start` over, if they lower χ², and linearises the problem there. Returns the
/// parameters without them.
fn linearised(problem: &mut Problem, mut start: Vec<f64>) -> Result<Vec<f64>, Diagnostic> {
    let mut unchanged = (problem.clone(), start.clone());
    numbers(problem).for_each(|j| unchanged.1[j] = 0.0);
    unchanged.0.linearise_numbers(&mut unchanged.1)?;
    problem.bound_numbers(&mut start);
    problem.linearise_numbers(&mut start)?;
    let [changed_sum, sum] = [problem.sum_of_squares(&start), unchanged.0.sum_of_squares(&unchanged.1)];
    if changed_sum <= sum {
        return Ok(start);
    }
    *problem = unchanged.0;
    Ok(unchanged.1)
}

/// The fit with all numbers held, with the covariance of the model in which they are free: no values were found that the
/// readings prefer.
fn held(problem: &Problem, from: &[f64]) -> Result<Fit, Diagnostic> {
    let mut held = problem.clone();
    let size = |parameter: usize| problem.parameters.list[parameter].size;
    for parameter in numbers(problem) {
        held.parameters.list[parameter].prior = Prior::Gaussian(HELD * size(parameter));
    }
    let mut found = fit(&held, Some(from))?;
    let whole = problem.prior_triangle(&found.beta).merged(&problem.triangles(&found.beta)?);
    found.covariance = whole.covariance(&found.rank.identifiable_basis)?;
    Ok(found)
}

/// Moves the numbers of a problem to their best values, and the parameters with them, from a linearisation at these
/// parameters.
fn settle(problem: &mut Problem, from: &mut Vec<f64>) -> Result<(), Diagnostic> {
    let numbers: Vec<usize> = numbers(problem).collect();
    for _ in 0..MAX_ROUNDS {
        let to = match minimum(problem, Some(from)) {
            Err(error) if error.code == NO_CONVERGENCE => break,
            found => found?.beta,
        };
        let width = |j: usize| problem.parameters.list[j].size;
        let moved = numbers.iter().map(|j| to[*j].abs() / width(*j)).fold(0.0, f64::max);
        let before = problem.sum_of_squares(from);
        let mut better = None;
        for share in SHARES {
            let mut at: Vec<f64> = from.iter().zip(&to).map(|(from, to)| from + share * (to - from)).collect();
            let mut next = problem.clone();
            next.bound_numbers(&mut at);
            next.linearise_numbers(&mut at)?;
            if next.sum_of_squares(&at) <= before * (1.0 + ROUNDING) {
                better = Some((next, at));
                break;
            }
        }
        let Some((next, at)) = better else { break };
        (*problem, *from) = (next, at);
        if moved < TOLERANCE {
            break;
        }
    }
    Ok(())
}

/// The estimated numbers, by index among the parameters.
fn numbers(problem: &Problem) -> impl Iterator<Item = usize> {
    let list = &problem.parameters.list;
    (0..list.len()).filter(|j| list[*j].id.is_number())
}

/// The profile intervals of the numbers in which χ² is not parabolic.
///
/// # Errors
/// As [`fit`].
pub(crate) fn intervals(problem: &Problem, fit: &Fit) -> Result<Vec<NumberInterval>, Diagnostic> {
    let mut found = Vec::new();
    for parameter in numbers(problem) {
        let u = fit.covariance[(parameter, parameter)].max(0.0).sqrt();
        if u <= 0.0 || !u.is_finite() {
            continue;
        }
        let profile = Profile { problem, fit, parameter, least: problem.sum_of_squares(&fit.beta) };
        let mut is_parabolic = true;
        for side in [-2.0, 2.0] {
            let rise = profile.rise(side * u)?;
            is_parabolic &= rise.is_some_and(|rise| (PARABOLIC[0]..=PARABOLIC[1]).contains(&rise));
        }
        if !is_parabolic {
            let [low, high] = [profile.end(-u)?, profile.end(u)?];
            let half = 0.5 * (high.change - low.change);
            let lacking = half * half / QUANTILE_95 - (u * fit.u_enlargement).powi(2);
            let weight = lacking.max(0.0) / (low.change.powi(2) + high.change.powi(2));
            let ends = [low.change, high.change];
            found.push(NumberInterval { parameter, ends, covered: [low, high].map(|end| (weight, end.of_all)) });
        }
    }
    Ok(found)
}

/// χ² minimised over all parameters but one number.
struct Profile<'p> {
    problem: &'p Problem,
    fit: &'p Fit,
    parameter: usize,
    /// χ² at the solution.
    least: f64,
}

/// A point of a profile.
struct Moved {
    /// The change of the number.
    change: f64,
    /// The rise of χ².
    rise: f64,
    /// The changes of all parameters.
    of_all: Vec<f64>,
}

impl Profile<'_> {
    /// The rise of χ² where the number has changed by this much; `None` if the shape cannot have this number.
    fn rise(&self, change: f64) -> Result<Option<f64>, Diagnostic> {
        Ok(self.moved(change)?.map(|moved| moved.rise))
    }

    /// The point where the number has changed by this much; `None` if the shape cannot have this number.
    fn moved(&self, change: f64) -> Result<Option<Moved>, Diagnostic> {
        let mut held = self.problem.clone();
        let parameter = &mut held.parameters.list[self.parameter];
        parameter.prior = Prior::Gaussian(HELD * parameter.size);
        let mut at = self.fit.beta.clone();
        at[self.parameter] += change;
        if !held.has_valid_numbers(&at) {
            return Ok(None);
        }
        held.linearise_numbers(&mut at)?;
        settle(&mut held, &mut at)?;
        let rise = (held.sum_of_squares(&at) - self.least).max(0.0);
        let of_all = |j| held.parameters.value(j, &at) - self.problem.parameters.value(j, &self.fit.beta);
        Ok(Some(Moved { change, rise, of_all: (0..at.len()).map(of_all).collect() }))
    }

    /// The point at which χ² has risen by the quantile, on the side of `step`. A residual beyond the noise widens the
    /// interval as it enlarges uncertainties.
    fn end(&self, step: f64) -> Result<Moved, Diagnostic> {
        let wanted = QUANTILE_95 * self.fit.u_enlargement.powi(2);
        let mut inside = Moved { change: 0.0, rise: 0.0, of_all: vec![0.0; self.fit.beta.len()] };
        let mut outside = None;
        let mut next = QUANTILE_95.sqrt() * step * self.fit.u_enlargement;
        for _ in 0..MAX_STEPS {
            match self.moved(next)? {
                Some(moved) if (moved.rise / wanted - 1.0).abs() < END_TOLERANCE => return Ok(moved),
                Some(moved) if moved.rise < wanted => inside = moved,
                _ => outside = Some(next),
            }
            next = match outside {
                Some(outside) => 0.5 * (inside.change + outside),
                None => 1.6 * inside.change,
            };
        }
        Ok(inside)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use abbe_files::ReadOptions;
    use abbe_model::driver::Driver;
    use abbe_model::effect::shape::Local;
    use abbe_model::effect::{Component, Effect, Shape};
    use nalgebra::DMatrix;

    use super::*;
    use crate::fit::{covariance_of_parameters, parameters, prepare};

    /// A bump of 5 µm of EZC at 120° with a half width of 30°, and the numbers from which its estimation starts.
    const TRUE_NUMBERS: [f64; 2] = [2.1, 0.5];
    const START_NUMBERS: [f64; 2] = [2.2, 0.4];
    const HEIGHT_MM: f64 = 5e-3;

    fn bump([centre, width]: [f64; 2]) -> Effect {
        let shape = Shape::Local(Local { centre, width, recurs: Some(std::f64::consts::TAU) });
        Effect::new(Component::parse("EZC").unwrap(), Driver::parse("C"), shape).with_estimated_numbers()
    }

    /// The problem of a measured session with readings that its model predicts exactly, with a bump at other numbers.
    fn problem() -> Problem {
        let [_, problem] = problems();
        problem
    }

    /// The same before the bump is among its effects, and with it.
    fn problems() -> [Problem; 2] {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let (mut problem, _) = prepare(&session, 1).unwrap();
        let mut true_problem = problem.clone();
        true_problem.add_effect(&bump(TRUE_NUMBERS)).unwrap();
        let mut beta = vec![0.0; true_problem.parameters.list.len()];
        let coefficient = beta.len() - 3;
        beta[coefficient] = HEIGHT_MM;
        let residuals = true_problem.residuals(&beta);
        for (test, residuals) in problem.tests.iter_mut().zip(residuals) {
            let readings = Arc::make_mut(test.readings.as_mut().unwrap());
            readings.observed.iter_mut().zip(residuals).for_each(|(observed, residual)| *observed -= residual);
        }
        let without_bump = problem.clone();
        problem.add_effect(&bump(START_NUMBERS)).unwrap();
        [without_bump, problem]
    }

    /// A bump has a positive width.
    #[test]
    fn a_number_changes_within_what_its_shape_permits() {
        let problem = problem();
        let mut beta = vec![0.0; problem.parameters.list.len()];
        let width = beta.len() - 1;
        for (change, is_valid) in [(0.0, true), (2.0, true), (-0.3, true), (-0.5, false)] {
            beta[width] = change;
            assert_eq!(problem.has_valid_numbers(&beta), is_valid, "{change}");
        }
    }

    /// The covariance is the inverse of `JᵀJ` with `J` by difference quotients of the readings, the numbers among the
    /// unknowns.
    #[test]
    fn numbers_are_estimated_with_their_covariance() {
        let mut problem = problem();
        let fit = fit_with_numbers(&mut problem, None).unwrap();
        let count = fit.beta.len();
        let values: Vec<f64> = (0..count).map(|j| problem.parameters.value(j, &fit.beta)).collect();
        let [height, centre, width] = [values[count - 3], values[count - 2], values[count - 1]];
        assert!((height - HEIGHT_MM).abs() < 1e-8, "{height}");
        assert!((centre - TRUE_NUMBERS[0]).abs() < 1e-6 && (width - TRUE_NUMBERS[1]).abs() < 1e-6, "{centre} {width}");

        let at = |change: &dyn Fn(usize) -> f64| {
            let mut own = problem.clone();
            let mut beta: Vec<f64> = (0..count).map(|j| fit.beta[j] + change(j)).collect();
            own.linearise_numbers(&mut beta).unwrap();
            own.residuals(&beta).into_iter().flatten().collect::<Vec<f64>>()
        };
        let rows = at(&|_| 0.0).len();
        let mut jacobian = DMatrix::<f64>::zeros(rows, count);
        let mut information = DMatrix::<f64>::zeros(count, count);
        for j in 0..count {
            let step = 1e-5 * problem.parameters.list[j].size;
            let [more, less] = [step, -step].map(|step| at(&|k| if k == j { step } else { 0.0 }));
            for (i, (more, less)) in more.iter().zip(&less).enumerate() {
                jacobian[(i, j)] = (less - more) / (2.0 * step) / problem.noise.sigma_mm;
            }
            if let Prior::Gaussian(u) = problem.parameters.list[j].prior {
                information[(j, j)] = u.powi(-2);
            }
        }
        let kept: Vec<usize> = (0..count).filter(|j| fit.rank.is_identifiable(*j)).collect();
        assert_eq!(kept.len(), count, "every parameter is identifiable with the priors");
        information += jacobian.transpose() * &jacobian;
        let scale: Vec<f64> = (0..count).map(|j| information[(j, j)].sqrt().recip()).collect();
        let scaled = DMatrix::from_fn(count, count, |i, j| information[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.try_inverse().unwrap();
        for j in 0..count {
            let u = inverse[(j, j)].sqrt() * scale[j];
            let own = fit.covariance[(j, j)].sqrt();
            assert!((own / u - 1.0).abs() < 1e-3, "{}: {own} and {u}", problem.parameters.list[j].id);
        }
    }

    /// At an end of the interval χ², minimised over the rest, is higher by the quantile.
    #[test]
    fn an_interval_ends_where_chi_square_has_risen_by_the_quantile() {
        let [mut without_bump, mut problem] = problems();
        [&mut without_bump, &mut problem].into_iter().for_each(|problem| problem.noise.sigma_mm *= 10.0);
        let fit = fit_with_numbers(&mut problem, None).unwrap();
        let parameter = fit.beta.len() - 1;
        let u = fit.covariance[(parameter, parameter)].sqrt();
        let profile = Profile { problem: &problem, fit: &fit, parameter, least: problem.sum_of_squares(&fit.beta) };
        for step in [-u, u] {
            let end = profile.end(step).unwrap().change;
            let rise = profile.rise(end).unwrap().unwrap();
            assert!((rise / QUANTILE_95 - 1.0).abs() < 2.0 * END_TOLERANCE, "{rise} at {end}");
        }
        // χ² is steeper towards narrow bumps. Fits of a width that is held, from other numbers, show on which side.
        let [narrower, wider] = [-2.0 * u, 2.0 * u].map(|change| {
            let mut held = without_bump.clone();
            let shape = problem.parameters.effects.last().unwrap().shape.clone();
            let width = shape.number(1) + change;
            let centre = Effect { estimated: vec![0], ..bump([START_NUMBERS[0], width]) };
            held.add_effect(&centre).unwrap();
            let refitted = fit_with_numbers(&mut held, None).unwrap();
            let rise = held.sum_of_squares(&refitted.beta) - profile.least;
            let of_profile = profile.rise(change).unwrap().unwrap();
            assert!((of_profile / rise - 1.0).abs() < 0.01, "{of_profile} and {rise} at {change}");
            rise
        });
        assert!((narrower / wider - 1.0).abs() > 0.05, "{narrower} {wider}");
        let near = profile.rise(0.05 * u).unwrap().unwrap();
        assert!((near / 0.0025 - 1.0).abs() < 0.1, "parabolic near the minimum: {near}");
    }

    /// The standard uncertainty of a number whose interval is longer than that of a parabola is the half length over 1.96. The
    /// covariance has its square, and an error that depends on the number has a larger uncertainty too.
    #[test]
    fn uncertainties_cover_a_profile_interval() {
        let [mut problem, _] = problems();
        problem.add_effect(&Effect { estimated: vec![1], ..bump(TRUE_NUMBERS) }).unwrap();
        problem.noise.sigma_mm *= 50.0;
        let mut fit = fit_with_numbers(&mut problem, None).unwrap();
        let before = parameters(&problem, &fit);
        fit.intervals = intervals(&problem, &fit).unwrap();
        let after = parameters(&problem, &fit);
        let covariance = covariance_of_parameters(&problem, &fit, &after);
        for (k, (after, before)) in after.iter().zip(&before).enumerate() {
            let u = covariance.matrix[k][k].sqrt();
            assert!((u / after.u - 1.0).abs() < 1e-9, "{}: {u} and {}", after.id, after.u);
            assert!(after.u >= before.u, "{}: {} and {}", after.id, after.u, before.u);
        }
        let width = after.iter().position(|parameter| parameter.interval_95.is_some()).expect("an interval");
        let [low, high] = after[width].interval_95.unwrap();
        let of_interval = 0.5 * (high - low) / 1.959_963_985;
        assert!(of_interval > 1.05 * before[width].u, "{of_interval} and {}", before[width].u);
        assert!((after[width].u / of_interval - 1.0).abs() < 1e-6, "{} and {of_interval}", after[width].u);
        let is_larger = |k: usize| k != width && after[k].u > 1.01 * before[k].u;
        assert!((0..after.len()).any(is_larger), "{after:?}");
    }
}
