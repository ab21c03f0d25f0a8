//! Comparison of the stated noise with the noise of repeats and of several targets.

use super::{RIGID_MM, flange};
use crate::fit::Fit;
use crate::numerics::tails::chi_square_tails;
use crate::problem::Problem;

/// Ratio beyond which stated noise and noise of repeats disagree.
const DISAGREEMENT_RATIO: f64 = 2.0;
/// Significance level of this disagreement.
const DISAGREEMENT_P: f64 = 0.001;

/// A warning if repeated readings scatter by more than twice or less than half of the stated noise, significantly.
pub fn stated_against_repeats(problem: &Problem, fit: &Fit) -> Option<String> {
    let stated_mm = problem.session.stated_noise_mm()?;
    let repeats = fit.repeats.unwrap_or_else(|| problem.repeatability(&fit.residuals));
    let sigma_mm = repeats.sigma_mm?;
    let resolution_mm = problem.session.resolution_noise_mm();
    let ratio = sigma_mm.max(resolution_mm) / stated_mm;
    let freedom = repeats.freedom as f64;
    let [below, above] = chi_square_tails(freedom * ratio * ratio, freedom)?;
    let by_chance = below.min(above) > DISAGREEMENT_P / 2.0;
    let unit = problem.unit();
    let symbol = unit.symbol();
    (!by_chance && !(1.0 / DISAGREEMENT_RATIO..=DISAGREEMENT_RATIO).contains(&ratio)).then(|| {
        format!(
            "the session states a noise of {} {symbol}, and the repeatability is {} ({} degrees of freedom): the uncertainties of a fit follow from \
             the stated noise; correct `noise_{unit}`, or omit it",
            stated_mm * 1e3,
            unit.text(sigma_mm * 1e3, 3),
            repeats.freedom,
        )
    })
}

/// Share of the stated noise below which the residual of a channel is no noise.
const SILENT: f64 = 0.1;
/// Share of the stated noise above which another channel of the test shows that the test has noise.
const HEARD: f64 = 0.3;
/// Smallest number of readings of a channel for this decision.
const MIN_READINGS: usize = 20;

/// A warning for each channel of a test whose residual is far below the stated noise, while that of another channel is not: the
/// values of its column are too small, as those of an angle in rad in a column of arcsec are. `rank` parameters were fitted
/// to `residuals`, mm, test by test.
pub(crate) fn silent_channels(problem: &Problem, residuals: &[Vec<f64>], rank: usize) -> Vec<String> {
    let Some(stated_mm) = problem.session.stated_noise_mm() else { return Vec::new() };
    let mut warnings = Vec::new();
    for (test, residual) in residuals.iter().enumerate() {
        let channels = problem.models[test].channels();
        let shares: Vec<Option<f64>> = (0..channels.len())
            .map(|channel| {
                let own = (channel..residual.len()).step_by(channels.len()).filter(|i| problem.counts(test, *i));
                let squares: Vec<f64> = own.map(|i| residual[i] * residual[i]).collect();
                let enough = squares.len() >= MIN_READINGS.max(2 * rank);
                enough.then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt() / stated_mm)
            })
            .collect();
        if !shares.iter().flatten().any(|share| *share > HEARD) {
            continue;
        }
        for (channel, share) in channels.iter().zip(&shares) {
            if let Some(share) = share.filter(|share| *share < SILENT) {
                warnings.push(format!(
                    "test \"{}\": the residual of {} is {share:.1e} of the stated noise, that of another channel is not small; check \
                     the unit in the name of its column",
                    problem.tests[test].name, channel.name
                ));
            }
        }
    }
    warnings
}

/// What is said of targets that keep their distances exactly.
pub fn rigid_targets(problem: &Problem) -> Option<String> {
    let kept = |test: usize, row: usize| !problem.rejected[test][row];
    let (sigma_mm, _) = flange::noise_of_targets(&problem.tests, kept).filter(|(sigma_mm, _)| *sigma_mm <= RIGID_MM)?;
    let stated = problem.session.keys_of_noise();
    Some(format!(
        "the targets keep their distances to {:.3} µm: the instrument has solved them as one rigid body, so that they show no \
         noise; the noise is that of {stated}, or of the residual where none is stated",
        sigma_mm * 1e3
    ))
}
