//! Estimates the noise model of a trace from repeats: standard deviation and autocorrelation.

use abbe_identify::noise::{Noise, NoiseSource, along_runs};
use abbe_identify::problem::Problem;

use super::constants::{FAR_FROM_STATED, MIN_AGAINST_STATED, SCATTER};

/// Sets the noise standard deviation and autocorrelation from repeats, if there are enough. The standard deviation of
/// white noise replaces a stated one if many of them determine it or it is far from the stated one, that of autocorrelated
/// noise only if they contradict it: little of the slow part is left in their deviations. Returns whether this changed the
/// noise by more than its sampling scatter.
pub(crate) fn estimate_noise_model(problem: &mut Problem, residuals: &[Vec<f64>]) -> bool {
    let Some((pure, estimated)) = along_runs(problem, residuals) else {
        return false;
    };
    let stated_mm = problem.session.stated_noise_mm();
    let resolution_mm = problem.session.resolution_noise_mm();
    let is_far = |stated_mm: f64, of_repeats: Option<f64>| {
        of_repeats.is_some_and(|sigma_mm| {
            let ratio = sigma_mm.max(resolution_mm) / stated_mm;
            !(FAR_FROM_STATED.recip()..=FAR_FROM_STATED).contains(&ratio)
        })
    };
    let white = estimated.process.coefficients.is_empty();
    let (sigma_mm, source) = match (stated_mm, pure.sigma_mm()) {
        (Some(stated_mm), of_repeats)
            if white && pure.freedom < MIN_AGAINST_STATED && !is_far(stated_mm, of_repeats) =>
        {
            (stated_mm, NoiseSource::Stated)
        }
        (_, Some(sigma_mm)) if white => (sigma_mm, NoiseSource::Repeats),
        _ if white => (problem.noise.sigma_mm, problem.noise.source),
        _ if estimated.is_as_stated => (estimated.process.sigma_mm, NoiseSource::Stated),
        _ => (estimated.process.sigma_mm, NoiseSource::Repeats),
    };
    let noise = Noise {
        sigma_mm,
        source,
        ar_sum_u: if white { 0.0 } else { estimated.sum_u },
        ar_coefficients: estimated.process.coefficients,
        inflation: problem.noise.inflation,
    };
    let present = &problem.noise;
    let same_coefficients = noise.ar_coefficients.len() == present.ar_coefficients.len()
        && noise.ar_coefficients.iter().zip(&present.ar_coefficients).all(|(a, b)| (a - b).abs() < SCATTER);
    if same_coefficients && (noise.sigma_mm / present.sigma_mm - 1.0).abs() < SCATTER {
        return false;
    }
    problem.noise = noise;
    true
}
