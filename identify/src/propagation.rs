//! Monte Carlo of the fit (JCGM 101): readings and set-up priors are simulated about their observed and stated values,
//! and every simulated session is fitted again, nonlinearly.
//!
//! ```text
//! Y = argmin Σ ((x_i − L_i(β))/σ)² + Σ ((s_k − β_k)/u_k)²,    x_i ~ N(observed, σ²),  s_k ~ N(stated, u_k²)
//! ```
//!
//! For a linear model `Y` is Gaussian with the covariance of the law of propagation. JCGM 101 (8.1) gives the
//! validation of that law. With `u = c·10^l`, `c` of one significant digit, the ends of the two coverage intervals may
//! differ by `δ = ½·10^l`.

mod refit;

use statrs::distribution::{Continuous, Normal};

use abbe_model::Diagnostic;
use abbe_model::parameter_id::ParameterId;
use abbe_model::words::counted;
use schemars::JsonSchema;
use serde::Serialize;

use crate::error;
use crate::fit;
use crate::fit::{Fit, FitResult};
use crate::monte_carlo::{self, Distribution, Draws, MonteCarlo};
use crate::numerics::tails::normal_quantile;
use crate::problem::Problem;
use crate::results::{Estimate, Interval, phases_follow_amplitudes};
use crate::tolerance::conformity;
use refit::Refit;

/// A fit by Monte Carlo (JCGM 101).
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FitMonteCarlo {
    /// Runs, seed and coverage probability.
    #[serde(flatten)]
    pub draws: MonteCarlo,
    /// Number of runs whose fit did not converge. No figure includes them.
    pub unconverged_runs: u64,
    /// In the order of the fit's parameters.
    pub parameters: Vec<DrawnParameter>,
}

/// A parameter by both propagations, in `unit`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DrawnParameter {
    /// Identifier, as in the fit.
    pub id: String,
    /// Unit of every figure of this object: `um`, `arcsec`, …
    pub unit: String,
    /// Estimate of the fit.
    pub value: f64,
    /// Standard uncertainty of the estimate by the law of propagation of uncertainty (JCGM 100).
    pub gum_u: f64,
    /// Coverage interval that follows from `gum_u` with a Gaussian coverage factor.
    pub gum_interval: Interval,
    /// Mean over the runs.
    pub mean: f64,
    /// Standard deviation over the runs.
    pub u: f64,
    /// Probabilistically symmetric coverage interval over the runs.
    pub symmetric_interval: Interval,
    /// Shortest coverage interval over the runs.
    pub shortest_interval: Interval,
    /// Absolute differences of the endpoints of the symmetric interval and of `gum_interval`.
    pub endpoint_differences: Interval,
    /// Numerical tolerance of these differences (JCGM 101, 8.1), for one significant digit of `gum_u`.
    pub tolerance: f64,
    /// Standard uncertainty of such an endpoint, from the number of runs.
    pub endpoint_u: f64,
    /// `agree`, `differ`, or `undecided` where the runs are too few to decide.
    pub verdict: Verdict,
}

/// Whether GUM and Monte Carlo agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The differences lie within the tolerance. The figures of the GUM are quoted.
    Agree,
    /// A difference exceeds the tolerance. The figures of the Monte Carlo are quoted.
    Differ,
    /// The runs are too few to decide. The figures of the Monte Carlo are quoted.
    Undecided,
}

/// Runs the Monte Carlo and adds it to the result. Parameters for which the two methods disagree report the `u` of the
/// Monte Carlo.
///
/// # Errors
/// If nothing is identifiable, or too few simulated sessions can be fitted for a distribution.
pub fn add_monte_carlo(
    problem: &Problem,
    fit: &Fit,
    draws: &MonteCarlo,
    result: &mut FitResult,
) -> Result<(), Diagnostic> {
    if fit.rank.identifiable_basis.ncols() == 0 {
        return Err(error::nothing_identifiable("nothing to propagate"));
    }
    let refit = Refit::new(problem, fit)?;
    let mean = vec![0.0; refit.u.len()];
    let distributions = monte_carlo::propagate(
        &refit,
        &Draws { mean: &mean, u: &refit.u, runs: draws.runs, seed: draws.seed, coverage: draws.coverage },
    );
    let unconverged = distributions.iter().map(|d| d.outside[2]).max().unwrap_or(0);
    if unconverged * 2 > draws.runs {
        return Err(error::not_applicable(
            "Monte Carlo",
            format!("{unconverged} of {} cannot be fitted", counted(draws.runs, "draw")),
            "the model cannot be evaluated over the range of the set-up uncertainties: state smaller ones, or fit without \
             Monte Carlo",
        ));
    }
    // The draws are those of the noise, with a linear model. What uncertainties cover beside it, aliases, positions of steps and
    // numbers of shapes, is added.
    let of_noise = fit::parameters_of_noise(problem, fit);
    let is_drawn = |parameter: &Estimate| !parameter.is(ParameterId::is_position);
    let parameters: Vec<DrawnParameter> = of_noise
        .iter()
        .filter(|parameter| is_drawn(parameter))
        .zip(&distributions)
        .map(|(parameter, drawn)| compared(&parameter.id, parameter.value, parameter.u, &parameter.unit, drawn, draws))
        .collect();
    let reported = result.model.parameters.iter_mut().zip(&of_noise).filter(|(parameter, _)| is_drawn(parameter));
    for ((parameter, of_noise), drawn) in reported.zip(&parameters) {
        if drawn.verdict != Verdict::Agree {
            let beside = (parameter.u * parameter.u - of_noise.u * of_noise.u).max(0.0).sqrt();
            parameter.set_u(drawn.u.hypot(beside));
        }
    }
    phases_follow_amplitudes(&mut result.model.parameters);
    result.conformity = conformity(&problem.session, &result.model, &result.circular);
    result.model.covariance = fit::covariance_of_parameters(problem, fit, &result.model.parameters);
    if unconverged > 0 {
        result
            .warnings
            .push(format!("{unconverged} of {} could not be fitted and are excluded", counted(draws.runs, "draw")));
    }
    result.monte_carlo = Some(FitMonteCarlo { draws: *draws, unconverged_runs: unconverged, parameters });
    Ok(())
}

/// Law of propagation and Monte Carlo for one parameter.
fn compared(id: &str, value: f64, gum_u: f64, unit: &str, drawn: &Distribution, draws: &MonteCarlo) -> DrawnParameter {
    let tail = (1.0 - draws.coverage) / 2.0;
    let factor = normal_quantile(tail);
    let gum_interval = [value - factor * gum_u, value + factor * gum_u];
    let endpoint_differences = [0, 1].map(|end| (drawn.symmetric[end] - gum_interval[end]).abs());
    let tolerance = tolerance(gum_u);
    // Standard deviation of a quantile: √(q(1 − q)/M) over the density there, with a Gaussian density.
    let share = (tail * (1.0 - tail) / draws.runs as f64).sqrt();
    let endpoint_u = drawn.u * share / Normal::standard().pdf(factor);
    let worst = endpoint_differences[0].max(endpoint_differences[1]);
    let verdict = if worst - 2.0 * endpoint_u > tolerance {
        Verdict::Differ
    } else if worst <= tolerance && 2.0 * endpoint_u <= tolerance {
        Verdict::Agree
    } else {
        Verdict::Undecided
    };
    DrawnParameter {
        id: id.to_string(),
        unit: unit.to_string(),
        value,
        gum_u,
        gum_interval: gum_interval.into(),
        mean: drawn.mean,
        u: drawn.u,
        symmetric_interval: drawn.symmetric.into(),
        shortest_interval: drawn.shortest.into(),
        endpoint_differences: endpoint_differences.into(),
        tolerance,
        endpoint_u,
        verdict,
    }
}

/// `½·10^l` for a standard uncertainty `c·10^l` of one digit (JCGM 101, 7.9.2).
///
/// ```
/// use abbe_identify::propagation::tolerance;
///
/// assert_eq!(tolerance(0.00035), 0.00005);
/// assert_eq!(tolerance(2.0), 0.5);
/// // 9.7 with one significant digit is 1·10¹.
/// assert_eq!(tolerance(9.7), 5.0);
/// ```
pub fn tolerance(u: f64) -> f64 {
    if u.is_nan() || u <= 0.0 || u.is_infinite() {
        return 0.0;
    }
    let power = u.log10().floor() as i32;
    let power = if (u / 10.0_f64.powi(power)).round() >= 10.0 { power + 1 } else { power };
    // Dividing by a whole power of ten keeps decimals exact.
    if power < 0 { 0.5 / 10.0_f64.powi(-power) } else { 0.5 * 10.0_f64.powi(power) }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use abbe_model::driver::Driver;
    use abbe_model::effect::shape::Harmonic;
    use abbe_model::effect::{Component, Effect, Shape};

    use super::*;
    use crate::fit::{AliasChange, EffectAliases};

    const FACTOR: f64 = 1.959_964;

    /// The verdict on a parameter of 10 ± 2 whose drawn interval is wider by `off` at each end, after `runs` draws.
    fn verdict(off: f64, runs: u64) -> DrawnParameter {
        let reach = FACTOR * 2.0 + off;
        let drawn = Distribution {
            mean: 10.0,
            u: 2.0,
            shortest: [10.0 - reach, 10.0 + reach],
            symmetric: [10.0 - reach, 10.0 + reach],
            from: 0.0,
            to: 20.0,
            counts: Vec::new(),
            outside: [0; 3],
        };
        compared("EX0C", 10.0, 2.0, "um", &drawn, &MonteCarlo { runs, seed: 1, coverage: 0.95 })
    }

    /// The tolerance of u = 2 is 0.5. After a million draws the ends of an interval are known to 0.005, after a hundred to
    /// 0.5: two such uncertainties decide.
    #[test]
    fn the_verdict_allows_for_the_uncertainty_of_the_draws() {
        let known = verdict(0.0, 1_000_000);
        assert!((known.gum_interval.low - (10.0 - FACTOR * 2.0)).abs() < 1e-5, "{known:?}");
        assert!((known.gum_interval.high - (10.0 + FACTOR * 2.0)).abs() < 1e-5, "{known:?}");
        assert_eq!((known.id.as_str(), known.unit.as_str(), known.value), ("EX0C", "um", 10.0));
        for (off, runs, wanted) in [
            (0.0, 1_000_000, Verdict::Agree),
            (0.499, 1_000_000, Verdict::Agree),
            (0.503, 1_000_000, Verdict::Undecided),
            (0.52, 1_000_000, Verdict::Differ),
            (-0.52, 1_000_000, Verdict::Differ),
            (0.0, 100, Verdict::Undecided),
            (1.2, 100, Verdict::Undecided),
            (2.0, 100, Verdict::Differ),
        ] {
            let found = verdict(off, runs);
            assert_eq!(found.verdict, wanted, "{off} after {runs}: {found:?}");
        }
    }

    /// Draws from the noise know nothing of an alias. What a parameter has to cover for it stays in its uncertainty.
    #[test]
    fn a_monte_carlo_covers_what_the_law_of_propagation_covers() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let (problem, _) = fit::prepare(&abbe_files::session(&file, &ReadOptions::default()).unwrap(), 1).unwrap();
        let mut problem = problem;
        let shape = Shape::Harmonic(Harmonic { order: 2.0 });
        problem.add_effect(&Effect::new(Component::parse("EZC").unwrap(), Driver::parse("C"), shape)).unwrap();
        let mut fit = fit::fit(&problem, None).unwrap();
        // An alias that changes every location error by twice its uncertainty from the noise.
        let is_location = |j: usize| problem.parameters.list[j].id.is_error();
        let of_noise = |j: usize| fit.covariance[(j, j)].sqrt() * fit.u_enlargement;
        let change = |j: usize| if is_location(j) { 2.0 * of_noise(j) } else { 0.0 };
        let alias = AliasChange { alias: 0, changes: (0..fit.beta.len()).map(change).collect(), delta_chi2: 0.0 };
        fit.aliases = vec![EffectAliases { effect: problem.parameters.effects.len() - 1, aliases: vec![alias] }];
        let before = fit::report(&problem, &fit).unwrap();
        let mut after = before.clone();
        let draws = MonteCarlo { runs: 2000, seed: 1, coverage: 0.95 };
        add_monte_carlo(&problem, &fit, &draws, &mut after).unwrap();
        let drawn = &after.monte_carlo.as_ref().unwrap().parameters;
        let mut covering = 0;
        for ((before, after), drawn) in before.model.parameters.iter().zip(&after.model.parameters).zip(drawn) {
            assert_eq!((&before.id, &after.id), (&drawn.id, &drawn.id));
            // 2000 draws know a standard deviation to 1.6 %.
            assert!((after.u / before.u - 1.0).abs() < 0.08, "{}: {} and {}", before.id, before.u, after.u);
            let Some(without) = before.u_without_aliases else { continue };
            covering += 1;
            assert!((before.u / without - 5_f64.sqrt()).abs() < 1e-9, "{}", before.id);
            assert!((drawn.gum_u / without - 1.0).abs() < 1e-12, "{}: {} and {without}", before.id, drawn.gum_u);
        }
        assert_eq!(covering, problem.parameters.list.iter().filter(|parameter| parameter.id.is_error()).count());
    }
}
