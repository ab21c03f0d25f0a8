//! Estimates the noise model of a trace from repeats: standard deviation and autocorrelation.

use abbe_identify::noise::{NoiseSource, PureError};
use abbe_identify::problem::Problem;

use super::constants::{MIN_AGAINST_STATED, SCATTER};
use super::policy::Policy;

/// Sets the noise standard deviation and autocorrelation from repeats, if there are enough. A stated standard deviation
/// needs more of them. Returns whether this changed them by more than their sampling scatter.
pub(crate) fn estimate_noise_model(problem: &mut Problem, residuals: &[Vec<f64>]) -> bool {
    if !Policy::of(problem).noise_of_repeats {
        return false;
    }
    let kept = |test: usize, row: usize| !problem.rejected[test][row];
    let pure = PureError::of(&problem.tests, residuals, kept).without_waves(&problem.tests, kept);
    let Some(estimated) = pure.autocorrelation(&problem.tests, kept) else {
        return false;
    };
    let white = estimated.coefficients.is_empty();
    if white && problem.noise.source == NoiseSource::Stated && pure.freedom < MIN_AGAINST_STATED {
        return false;
    }
    let mut noise = problem.noise.clone();
    noise.ar_coefficients = estimated.coefficients;
    noise.ar_sum_u = if white { 0.0 } else { estimated.sum_u };
    if let Some(sigma) = pure.sigma_mm() {
        noise.sigma_mm = sigma * estimated.inflation;
        noise.source = NoiseSource::Repeats;
    }
    let present = &problem.noise;
    let same_coefficients = noise.ar_coefficients.len() == present.ar_coefficients.len()
        && noise.ar_coefficients.iter().zip(&present.ar_coefficients).all(|(a, b)| (a - b).abs() < SCATTER);
    if same_coefficients && (noise.sigma_mm / present.sigma_mm - 1.0).abs() < SCATTER {
        return false;
    }
    problem.noise = noise;
    true
}
