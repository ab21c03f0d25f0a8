//! Comparison of repeated sessions of one plan: Type A against Type B uncertainty (JCGM 100, 4.2 and 4.3).
//!
//! For `n` sessions, each fitted separately, with values `x_k` and standard uncertainties `u_k`:
//!
//! ```text
//! mean x̄,   s² = Σ (x_k − x̄)²/(n − 1),   Type A of the mean s/√n,   Type B of one session u = √(Σ u_k²/n)
//! (n − 1)·s²/u² ~ χ²(n − 1)    if the sessions scatter by as much as their fits state
//! ```
//!
//! Set-up quantities are not compared, because every session has its own. Type A and Type B need not agree: a set-up
//! that was not remounted, or a calibration that all sessions share, contributes to every `u_k` but not to the scatter.

use std::collections::BTreeSet;

use abbe_model::Diagnostic;
use abbe_model::parameter_id::ParameterId;
use schemars::JsonSchema;
use serde::Serialize;

use crate::error;
use crate::fit::{Fit, parameters};
use crate::numerics::tails::{chi_square_tails, normal_tail};
use crate::problem::Problem;
use crate::results::Estimate;

/// Significance level over all comparisons together.
const SIGNIFICANCE: f64 = 0.01;

/// One fitted session.
#[derive(Clone, Debug)]
pub struct Session {
    /// Its file.
    pub name: String,
    /// Machine, instrument and tests in words. Sessions with different plans are not repeats.
    plan: String,
    /// Errors and coefficients of effects.
    parameters: Vec<Estimate>,
}

impl Session {
    /// A fitted session with the name of its file.
    pub fn new(name: &str, problem: &Problem, fit: &Fit) -> Session {
        let tests: Vec<&str> = problem.tests.iter().map(|test| test.name.as_str()).collect();
        Session {
            name: name.to_string(),
            plan: format!(
                "a {} on {} with the tests {}",
                problem.session.instrument.word(),
                problem.session.machine.code(),
                tests.join(", ")
            ),
            parameters: parameters(problem, fit).into_iter().filter(|own| !own.is(ParameterId::is_setup)).collect(),
        }
    }
}

/// Comparison of the fits of repeated sessions.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Repeated {
    /// The session files, in the order of `values`.
    pub sessions: Vec<String>,
    /// The parameters.
    pub parameters: Vec<RepeatedParameter>,
    /// Sessions that deviate from the others beyond the uncertainties of the fits, the most significant first.
    pub deviating: Vec<DeviatingSession>,
}

/// One parameter over the sessions, in `unit`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RepeatedParameter {
    /// Identifier: `EY0A`, `EZC~C:h2.amplitude`.
    pub id: String,
    /// `um`, `arcsec`, …
    pub unit: String,
    /// Mean over the sessions.
    pub mean: f64,
    /// Standard deviation over the sessions: Type A of one session.
    pub s: f64,
    /// Standard uncertainty of the mean, Type A.
    pub u_type_a: f64,
    /// Standard uncertainty of one session by its fit, Type B: root mean square over the sessions.
    pub u_type_b: f64,
    /// `s` over `u_type_b`; `null` where the latter is zero.
    pub ratio: Option<f64>,
    /// χ² of the scatter, `(n − 1)·ratio²`.
    pub chi_square: Option<f64>,
    /// Two-sided p-value of `chi_square`.
    pub p_value: Option<f64>,
    /// Verdict at a significance level of 1 % over all parameters.
    pub scatter: Scatter,
    /// Estimate of each session, in `unit`.
    pub values: Vec<f64>,
}

/// Scatter of the sessions against the uncertainties of their fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Scatter {
    /// Consistent with the fits.
    AsStated,
    /// Significantly more: an effect differs between the sessions that no fit models.
    More,
    /// Significantly less: the fits include an uncertainty that is constant over the sessions.
    Less,
}

/// A parameter of a session that deviates from the mean of the other sessions.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DeviatingSession {
    /// The session's file.
    pub session: String,
    /// The parameter.
    pub id: String,
    /// Value of the session less the mean of the other sessions, in `unit`.
    pub deviation: f64,
    /// Standard uncertainty of this deviation from the fits, in `unit`.
    pub u: f64,
    /// Unit of `deviation` and `u`.
    pub unit: String,
    /// Two-sided p-value of the deviation.
    pub p_value: f64,
}

/// Compares sessions of one plan.
///
/// # Errors
/// If there are fewer than two sessions, or their plans differ.
pub fn compare(sessions: &[Session]) -> Result<Repeated, Diagnostic> {
    let [first, others @ ..] = sessions else {
        return Err(one_session());
    };
    if others.is_empty() {
        return Err(one_session());
    }
    for other in others {
        same_plan(first, other)?;
    }
    let count = first.parameters.len() as f64;
    let mut result = Repeated {
        sessions: sessions.iter().map(|session| session.name.clone()).collect(),
        parameters: Vec::new(),
        deviating: Vec::new(),
    };
    for (place, parameter) in first.parameters.iter().enumerate() {
        let turn = (parameter.unit == "deg").then_some(360.0);
        let of = |session: &Session| {
            let own = &session.parameters[place];
            // A phase is periodic in a turn.
            let turns = turn.map_or(0.0, |turn| ((own.value - parameter.value) / turn).round() * turn);
            (own.value - turns, own.u)
        };
        let values: Vec<(f64, f64)> = sessions.iter().map(of).collect();
        result.parameters.push(over_sessions(parameter, &values, SIGNIFICANCE / count));
        if sessions.len() > 2 {
            let significance = SIGNIFICANCE / (count * sessions.len() as f64);
            for (k, by, u, p_value) in deviating_from_others(&values, significance) {
                result.deviating.push(DeviatingSession {
                    session: sessions[k].name.clone(),
                    id: parameter.id.clone(),
                    deviation: by,
                    u,
                    unit: parameter.unit.clone(),
                    p_value,
                });
            }
        }
    }
    let sigma = |deviating: &DeviatingSession| (deviating.deviation / deviating.u).abs();
    result.deviating.sort_by(|a, b| sigma(b).total_cmp(&sigma(a)));
    Ok(result)
}

fn one_session() -> Diagnostic {
    error::too_few("the scatter of a parameter", "sessions", 2, 1)
}

/// Checks that two sessions are repeats of one plan.
fn same_plan(first: &Session, other: &Session) -> Result<(), Diagnostic> {
    let fault = |what: String| {
        error::unlike(
            &other.name,
            "a repeat of",
            &first.name,
            format!("{what}; repeated sessions have the same machine, tests and parameters"),
        )
    };
    if first.plan != other.plan {
        return Err(fault(format!("it is {}, not {}", other.plan, first.plan)));
    }
    let ids = |session: &Session| -> BTreeSet<String> {
        session.parameters.iter().map(|parameter| parameter.id.clone()).collect()
    };
    let (own, known) = (ids(other), ids(first));
    if own == known {
        return Ok(());
    }
    let list = |a: &BTreeSet<String>, b: &BTreeSet<String>| {
        let only: Vec<&str> = a.difference(b).map(String::as_str).collect();
        if only.is_empty() { "nothing".to_string() } else { only.join(", ") }
    };
    Err(fault(format!("its readings identify {} in addition, but not {}", list(&own, &known), list(&known, &own))))
}

fn over_sessions(parameter: &Estimate, values: &[(f64, f64)], significance: f64) -> RepeatedParameter {
    let count = values.len() as f64;
    let mean = values.iter().map(|(x, _)| x).sum::<f64>() / count;
    let free = count - 1.0;
    let s = (values.iter().map(|(x, _)| (x - mean).powi(2)).sum::<f64>() / free).sqrt();
    let u_type_b = (values.iter().map(|(_, u)| u * u).sum::<f64>() / count).sqrt();
    let ratio = (u_type_b > 0.0).then(|| s / u_type_b);
    let chi_square = ratio.map(|ratio| free * ratio * ratio);
    let tails = chi_square.and_then(|found| chi_square_tails(found, free));
    let p_value = tails.map(|[below, above]| (2.0 * below.min(above)).min(1.0));
    let scatter = match (p_value, tails) {
        (Some(p), Some([below, above])) if p < significance => {
            if above < below {
                Scatter::More
            } else {
                Scatter::Less
            }
        }
        _ => Scatter::AsStated,
    };
    RepeatedParameter {
        id: parameter.id.clone(),
        unit: parameter.unit.clone(),
        mean,
        s,
        u_type_a: s / count.sqrt(),
        u_type_b,
        ratio,
        chi_square,
        p_value,
        scatter,
        values: values.iter().map(|(x, _)| *x).collect(),
    }
}

/// The values that deviate from the mean of the others, the most significant removed first: index, deviation, its
/// standard uncertainty, its probability.
fn deviating_from_others(values: &[(f64, f64)], significance: f64) -> Vec<(usize, f64, f64, f64)> {
    let mut remaining: Vec<usize> = (0..values.len()).collect();
    let mut found = Vec::new();
    while remaining.len() > 2 {
        let others = remaining.len() as f64 - 1.0;
        let sum: f64 = remaining.iter().map(|k| values[*k].0).sum();
        let square: f64 = remaining.iter().map(|k| values[*k].1.powi(2)).sum();
        let off = |k: &usize| {
            let (x, u) = values[*k];
            let by = x - (sum - x) / others;
            (*k, by, (u * u + (square - u * u) / others.powi(2)).sqrt())
        };
        let most_significant = remaining.iter().map(off).max_by(|a, b| (a.1 / a.2).abs().total_cmp(&(b.1 / b.2).abs()));
        let Some((k, by, u)) = most_significant else { break };
        let p_value = 2.0 * normal_tail((by / u).abs());
        // Zero uncertainties give no probability.
        if p_value.is_nan() || p_value >= significance {
            break;
        }
        found.push((k, by, u, p_value));
        remaining.retain(|other| *other != k);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIGNIFICANCE: f64 = 0.01;

    /// Two values of ten deviate. After the larger one is removed, the other one is compared with the eight that agree.
    #[test]
    fn deviating_values_are_found_one_after_another() {
        let values = [0.5, 40.0, -0.5, 0.5, -30.0, -0.5, 0.5, -0.5, 0.5, -0.5].map(|x| (x, 1.0));
        let found = deviating_from_others(&values, SIGNIFICANCE);
        assert_eq!(found.iter().map(|(k, ..)| *k).collect::<Vec<_>>(), [1, 4], "{found:?}");
        // The mean of the others is −30/9, then 0; its uncertainty 1/√9, then 1/√8.
        let expected = [(40.0 + 30.0 / 9.0, (1.0 + 1.0 / 9.0_f64).sqrt()), (-30.0, (1.0 + 1.0 / 8.0_f64).sqrt())];
        for ((_, by, u, p_value), (by_wanted, u_wanted)) in found.iter().zip(expected) {
            assert!((by - by_wanted).abs() < 1e-12 && (u - u_wanted).abs() < 1e-12, "{found:?}");
            assert!(*p_value < 1e-50, "{found:?}");
        }
    }

    /// One value of three beyond 2.576 of its standard uncertainty is significant at 1 %, one below is not. Of two values
    /// neither is the wrong one, and without uncertainties there is no probability.
    #[test]
    fn a_value_deviates_beyond_its_quantile_only() {
        let u = 1.5_f64.sqrt();
        for (factor, count) in [(2.57, 0), (2.59, 1), (-2.57, 0), (-2.59, 1)] {
            let found = deviating_from_others(&[(0.0, 1.0), (factor * u, 1.0), (0.0, 1.0)], SIGNIFICANCE);
            assert_eq!(found.len(), count, "{factor}: {found:?}");
        }
        assert!(deviating_from_others(&[(0.0, 1.0), (100.0, 1.0)], SIGNIFICANCE).is_empty());
        assert!(deviating_from_others(&[(0.0, 0.0), (0.0, 0.0), (0.0, 0.0)], SIGNIFICANCE).is_empty());
    }
}
