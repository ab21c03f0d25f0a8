//! Preparation of a fit: the noise and the outliers that the readings show, in turn with the fit.

use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::effect::Effect;
use abbe_model::session::Session;
use abbe_model::session::limits::MIN_UM;
use faer::Mat;

use super::families::{FoldEquations, Scales, families};
use super::numbers::{fit_with_numbers, intervals};
use super::{Fit, further_steps, positions};
use crate::heldout::{rms_by_unit_mm, rms_mm};
use crate::noise::{self, Noise, NoiseSource, PureError, Repeatability, ShownNoise, outliers};
use crate::numerics::solve::Svd;
use crate::numerics::triangle::Triangle;
use crate::plausibility;
use crate::problem::Problem;

/// Start value of the noise standard deviation if neither session nor repeats give one: 1 µm.
const START_NOISE_MM: f64 = 1e-3;
/// Least estimate of the noise standard deviation. Computed readings repeat exactly, but are still rounded.
const MIN_NOISE_MM: f64 = MIN_UM * 1e-3;
/// Maximum number of rounds that re-estimate noise and outliers.
const MAX_ROUNDS: usize = 6;
/// Relative change of the noise standard deviation at which the rounds stop.
const NOISE_TOLERANCE: f64 = 1e-4;
/// Change of a coefficient of its autocorrelation at which the rounds stop.
const COEFFICIENT_TOLERANCE: f64 = 1e-3;

/// Prepares and fits a session. The noise is the stated one, that of repeats or of several targets at each pose, or that of
/// the residual, with the autocorrelation that repeats along runs show. Outliers are excluded.
///
/// # Errors
/// See [`Problem::new`]; also if the iterations do not converge.
pub fn prepare(session: &Session, seed: u64) -> Result<(Problem, Fit), Diagnostic> {
    prepare_with(session, &[], seed)
}

/// As [`prepare`], for the session with further declared effects. Noise, outliers and rank are exactly those of a
/// session that declares them.
///
/// # Errors
/// See [`prepare`].
pub fn prepare_with(session: &Session, effects: &[Effect], seed: u64) -> Result<(Problem, Fit), Diagnostic> {
    let (problem, mut fit) = prepare_at_noise(session, effects, seed)?;
    fit.intervals = intervals(&problem, &fit)?;
    fit.positions = positions::at_solution(&problem, &fit)?;
    fit.further_steps = further_steps::at_solution(&problem, &fit)?;
    Ok((problem, fit))
}

/// Fits a problem anew from a solution, after a change of its noise.
///
/// # Errors
/// If the iterations do not converge.
pub fn refit(problem: &mut Problem, present: &Fit) -> Result<Fit, Diagnostic> {
    let mut fit = fit_with_numbers(problem, Some(present))?;
    fit.intervals = intervals(problem, &fit)?;
    fit.positions = positions::at_solution(problem, &fit)?;
    fit.further_steps = further_steps::at_solution(problem, &fit)?;
    Ok(fit)
}

fn prepare_at_noise(session: &Session, effects: &[Effect], seed: u64) -> Result<(Problem, Fit), Diagnostic> {
    if session.is_lever_known() {
        return prepare_at_lever(session, effects, seed);
    }
    let mut session = session.clone();
    let mut found = prepare_at_lever(&session, effects, seed)?;
    for _ in 0..MAX_LEVERS {
        let Some(factor) = lengths_over_angles(&found.0, &found.1) else { break };
        let factor = factor.clamp(1.0 / MAX_FACTOR, MAX_FACTOR);
        session.lever_mm *= factor;
        found = prepare_at_lever(&session, effects, seed)?;
        if (factor - 1.0).abs() < LEVER_TOLERANCE {
            break;
        }
    }
    Ok(found)
}

/// Maximum number of estimates of the lever of a session that does not state the noise of both lengths and angles.
const MAX_LEVERS: usize = 6;
/// Largest factor by which one estimate changes the lever.
const MAX_FACTOR: f64 = 100.0;
/// Relative change of the lever at which its estimates stop.
const LEVER_TOLERANCE: f64 = 0.01;

/// The session with the lever between its lengths and angles: the one that its stated noise requires, or that of its
/// readings.
///
/// # Errors
/// See [`prepare`].
pub fn with_lever(session: &Session, seed: u64) -> Result<Session, Diagnostic> {
    if session.is_lever_known() {
        return Ok(session.clone());
    }
    let lever_mm = prepare(session, seed)?.0.session.lever_mm;
    Ok(Session { lever_mm, ..session.clone() })
}

/// The noise of the lengths over that of the angles at the lever of a problem: the stated one, else of repeats if both
/// have them, else of the residual.
fn lengths_over_angles(problem: &Problem, fit: &Fit) -> Option<f64> {
    let session = &problem.session;
    let stated = |is_angle: bool| {
        let noise = if is_angle { session.noise_rad.map(|rad| rad * session.lever_mm) } else { session.noise_mm };
        noise.filter(|sigma| *sigma > 0.0)
    };
    let of_unit = |is_angle: bool| {
        let mut part = fit.residuals.clone();
        let mut tests = problem.tests.clone();
        for (number, test) in tests.iter_mut().enumerate() {
            let channels = problem.models[number].channels();
            let Some(readings) = &mut test.readings else { continue };
            let readings = Arc::make_mut(readings);
            let others = |i: &usize| channels[i % channels.len()].is_angle() != is_angle;
            (0..readings.observed.len()).filter(others).for_each(|i| readings.observed[i] = f64::NAN);
            (0..part[number].len()).filter(others).for_each(|i| part[number][i] = 0.0);
        }
        PureError::of(&tests, &part, |test, row| !problem.rejected[test][row]).sigma_mm()
    };
    let repeats = [false, true].map(of_unit);
    let found = match repeats {
        [Some(_), Some(_)] => repeats,
        _ => rms_by_unit_mm(problem, &fit.residuals),
    };
    let lengths = stated(false).or(found[0])?;
    let angles = stated(true).or(found[1])?;
    (lengths > 0.0 && angles > 0.0).then(|| lengths / angles)
}

fn prepare_at_lever(session: &Session, effects: &[Effect], seed: u64) -> Result<(Problem, Fit), Diagnostic> {
    let stated = session.stated_noise_mm();
    let floor = session.resolution_noise_mm();
    let first = match stated {
        Some(sigma) => Noise::white(sigma, NoiseSource::Stated),
        None => Noise::white(START_NOISE_MM.max(floor), NoiseSource::Residual),
    };
    let mut problem = Problem::new(session, first, seed)?;
    for effect in effects {
        problem.add_effect(effect)?;
    }
    if families(&problem.parameters).is_empty() {
        return settled(problem, floor);
    }
    let (without, kept) = problem.without_families();
    let (without, fit) = settled(without, floor)?;
    let mut start = vec![0.0; problem.parameters.list.len()];
    kept.iter().zip(&fit.beta).for_each(|(j, value)| start[*j] = *value);
    (problem.noise, problem.rejected) = (without.noise, without.rejected);
    for (effect, settled) in problem.parameters.effects.iter_mut().zip(&without.parameters.effects) {
        effect.shape.clone_from(&settled.shape);
    }
    problem.linearise_numbers(&mut start)?;
    with_families(problem, start)
}

/// Fits a problem, in turn with its noise and its outliers.
fn settled(mut problem: Problem, floor: f64) -> Result<(Problem, Fit), Diagnostic> {
    if problem.session.stated_noise_mm().is_none() {
        let nominal = problem.residuals(&vec![0.0; problem.parameters.list.len()]);
        let (sigma_mm, source) = match ShownNoise::of(&problem.tests, &nominal, |_, _| true) {
            Some(shown) => (shown.sigma_mm, shown.source),
            None => (nominal_residual_mm(&problem)?, NoiseSource::Residual),
        };
        problem.noise = Noise::white(sigma_mm.max(floor).max(MIN_NOISE_MM), source);
    }
    let found = fit_with_numbers(&mut problem, None);
    let mut fit = plausibility::checked(&problem, found)?;
    // Noise and outliers depend on the residuals, and the residuals on the fit. The returned fit always uses the
    // returned noise.
    for _ in 0..MAX_ROUNDS {
        let rejected = outliers::reject(&problem, &fit.residuals);
        let unchanged = rejected == problem.rejected;
        problem.rejected = rejected;
        let noise = noise(&problem, &mut fit, floor);
        if unchanged && is_settled(&noise, &problem.noise) {
            break;
        }
        problem.noise = noise;
        let found = fit_with_numbers(&mut problem, Some(&fit));
        fit = plausibility::checked(&problem, found)?;
    }
    Ok((problem, fit))
}

/// Estimates the scales of the families of a problem with the noise that they require, and fits it, in turn with the
/// outliers. `start` is the fit without the families, with coefficients of zero.
///
/// # Errors
/// See [`prepare`].
fn with_families(problem: Problem, start: Vec<f64>) -> Result<(Problem, Fit), Diagnostic> {
    // With hundreds of parameters the iterations of a fit take most of the time. The outliers settle without them.
    let (problem, near) = with_families_linearised(problem, start, None)?;
    // From nothing, so that the scales do not depend on what a search has tried.
    let estimate = |equations: &FoldEquations, _: &Problem, _: Option<f64>| equations.estimate();
    in_turn_with_families(problem, near.beta, None, estimate, |problem, beta, _| {
        let fit = super::fit(problem, Some(&beta))?;
        Ok((fit.beta.clone(), fit.residuals.clone(), fit))
    })
}

/// A model of families near its minimum.
#[derive(Clone, Debug)]
pub struct NearMinimum {
    /// Estimates of all parameters, in internal units.
    pub beta: Vec<f64>,
    /// Residuals by test, mm.
    pub residuals: Vec<Vec<f64>>,
    /// Root mean square of the held-out residuals, mm.
    pub held_out_rms_mm: f64,
    /// The inflation of the likelihood that the families require; `None` without families.
    pub inflation: Option<f64>,
}

/// The same without iterations of the fit: a search compares many models, between which the parameters change by so little
/// that the readings are linear in them. `start` is near the minimum, `inflation` that of the model before.
///
/// # Errors
/// See [`prepare`].
pub fn with_families_linearised(
    problem: Problem,
    start: Vec<f64>,
    inflation: Option<f64>,
) -> Result<(Problem, NearMinimum), Diagnostic> {
    let has_families = !families(&problem.parameters).is_empty();
    let estimate = FoldEquations::estimate_near;
    in_turn_with_families(problem, start, inflation, estimate, |problem, beta, (held_out_rms_mm, inflation)| {
        let beta = super::identifiable(problem, &beta)?;
        let residuals = problem.residuals(&beta);
        let inflation = has_families.then_some(inflation);
        Ok((beta.clone(), residuals.clone(), NearMinimum { beta, residuals, held_out_rms_mm, inflation }))
    })
}

/// Parameters, residuals, and what else a fit finds.
type Fitted<F> = (Vec<f64>, Vec<Vec<f64>>, F);

/// Estimates scales and noise by `estimate`, and fits by `fit` from the estimates, in turn with the outliers. `estimate`
/// receives the inflation that was estimated before, `fit` the held-out rms in mm and the inflation; it returns parameters,
/// residuals and what else it finds.
fn in_turn_with_families<F>(
    mut problem: Problem,
    mut start: Vec<f64>,
    mut inflation: Option<f64>,
    estimate: impl Fn(&FoldEquations, &Problem, Option<f64>) -> Result<Scales, Diagnostic>,
    fit: impl Fn(&Problem, Vec<f64>, (f64, f64)) -> Result<Fitted<F>, Diagnostic>,
) -> Result<(Problem, F), Diagnostic> {
    let mut round = 0;
    loop {
        let equations = FoldEquations::of(&problem, &start)?;
        let scales = estimate(&equations, &problem, inflation)?;
        inflation = Some(scales.inflation);
        let held_out_rms_mm = (scales.held_out_sum() / equations.readings()).sqrt() * problem.noise.likelihood_mm();
        equations.apply(&scales, &mut problem);
        let (beta, residuals, found) = fit(&problem, equations.beta(&scales), (held_out_rms_mm, scales.inflation))?;
        let rejected = outliers::reject(&problem, &residuals);
        round += 1;
        if rejected == problem.rejected || round == MAX_ROUNDS {
            return Ok((problem, found));
        }
        (start, problem.rejected) = (beta, rejected);
    }
}

/// Root mean square of the residual of the nominal machine, mm, after a linearised fit of the set-up quantities. It
/// serves as the noise in the first decision on the rank. Machine errors are excluded: in a socket session, shrinking
/// the machine to a point would explain every reading.
fn nominal_residual_mm(problem: &Problem) -> Result<f64, Diagnostic> {
    let list = &problem.parameters.list;
    let nominal = vec![0.0; list.len()];
    let (r, c, rest) = Triangle::new(list.len()).merged(&problem.triangles(&nominal)?).parts();
    let setups: Vec<usize> = (0..list.len()).filter(|j| list[*j].id.is_setup()).collect();
    let mut left = c;
    if !setups.is_empty() {
        // Without their priors set-up quantities may be collinear: the solution of least norm.
        let of_setups = Mat::from_fn(list.len(), setups.len(), |i, j| r[(i, setups[j])]);
        let found = Svd::of(of_setups.as_ref())?.solve(&left, 0.0);
        for (i, left) in left.iter_mut().enumerate() {
            *left -= found.iter().enumerate().map(|(j, x)| of_setups[(i, j)] * x).sum::<f64>();
        }
    }
    let count = problem.scalars() as f64;
    let sum_of_squares = left.iter().map(|left| left * left).sum::<f64>() + rest;
    Ok((sum_of_squares / count.max(1.0)).sqrt() * problem.noise.sigma_mm)
}

/// Whether two noises of one source differ by less than the rounds can change.
fn is_settled(noise: &Noise, before: &Noise) -> bool {
    let (own, of_before) = (&noise.ar_coefficients, &before.ar_coefficients);
    noise.source == before.source
        && (noise.sigma_mm / before.sigma_mm - 1.0).abs() < NOISE_TOLERANCE
        && own.len() == of_before.len()
        && own.iter().zip(of_before).all(|(own, of_before)| (own - of_before).abs() < COEFFICIENT_TOLERANCE)
}

/// The noise that the session states or the readings show. The autocorrelation is that of repeats along runs. If these
/// contradict the stated standard deviation, they may hold an effect that acts in one run, which is no noise: what is stated
/// then counts as white noise.
fn noise(problem: &Problem, fit: &mut Fit, floor: f64) -> Noise {
    let stated_mm = problem.session.stated_noise_mm();
    let pure = PureError::of(&problem.tests, &fit.residuals, |test, row| !problem.rejected[test][row]);
    let repeats = pure.repeatability();
    fit.repeats = Some(repeats);
    let white = match stated_mm {
        Some(sigma_mm) => Noise::white(sigma_mm, NoiseSource::Stated),
        None => estimated_noise(problem, fit, repeats, floor),
    };
    let Some((_, shown)) = noise::autocorrelated(problem, pure) else { return white };
    let sigma_mm = shown.process.sigma_mm;
    let is_rounding = sigma_mm < floor.max(MIN_NOISE_MM);
    if shown.process.coefficients.is_empty() || shown.is_as_stated != stated_mm.is_some() || is_rounding {
        return white;
    }
    Noise { sigma_mm, ar_coefficients: shown.process.coefficients, ar_sum_u: shown.sum_u, ..white }
}

fn estimated_noise(problem: &Problem, fit: &Fit, repeats: Repeatability, floor: f64) -> Noise {
    let kept = |test: usize, row: usize| !problem.rejected[test][row];
    if let Some(shown) = ShownNoise::beside(repeats, &problem.tests, kept) {
        return Noise::white(shown.sigma_mm.max(floor).max(MIN_NOISE_MM), shown.source);
    }
    let count = problem.scalars() as f64;
    let freedom = (count - fit.rank.identifiable_basis.ncols() as f64).max(1.0);
    let sigma = rms_mm(problem, &fit.residuals) * (count / freedom).sqrt();
    Noise::white(sigma.max(floor).max(MIN_NOISE_MM), NoiseSource::Residual)
}
