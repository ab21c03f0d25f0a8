//! Comparison of the stated noise with the noise of repeats.

use super::PureError;
use crate::numerics::tails::chi_square_tails;
use crate::problem::Problem;

/// Ratio beyond which stated noise and noise of repeats disagree.
const DISAGREEMENT_RATIO: f64 = 2.0;
/// Significance level of this disagreement.
const DISAGREEMENT_P: f64 = 0.001;

/// A warning if repeated readings scatter by more than twice or less than half of the stated noise, significantly.
/// `residuals` are those of any model, mm, test by test.
pub(crate) fn stated_against_repeats(problem: &Problem, residuals: &[Vec<f64>]) -> Option<String> {
    let stated_mm = problem.session.stated_noise_mm()?;
    let pure = PureError::of(&problem.tests, residuals, |test, row| !problem.rejected[test][row]);
    let sigma_mm = pure.sigma_mm()?;
    let resolution_mm = problem.session.resolution_noise_mm();
    let ratio = sigma_mm.max(resolution_mm) / stated_mm;
    let freedom = pure.freedom as f64;
    let [below, above] = chi_square_tails(freedom * ratio * ratio, freedom)?;
    let by_chance = below.min(above) > DISAGREEMENT_P / 2.0;
    let unit = problem.unit();
    let symbol = unit.symbol();
    (!by_chance && !(1.0 / DISAGREEMENT_RATIO..=DISAGREEMENT_RATIO).contains(&ratio)).then(|| {
        format!(
            "the session states a noise of {} {symbol}, and the repeatability is {} ({} degrees of freedom): the uncertainties of a fit follow from \
             the stated noise; correct `{}`, or omit it",
            stated_mm * 1e3,
            unit.text(sigma_mm * 1e3, 3),
            pure.freedom,
            unit.noise_key()
        )
    })
}
