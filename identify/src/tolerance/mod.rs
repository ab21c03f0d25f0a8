//! Decisions of conformity: the results of a session against its `[tolerance]`.
//!
//! [`rule`] is the decision rule of ISO 14253-1. The uncertainty of a parameter is that of the fit. That of a figure of
//! a test follows from the noise `σ` of a reading, from the `n` runs that are averaged, and from what the session states
//! of the instrument and of the bar:
//!
//! ```text
//! u²(G) = 2σ²/n + u²(instrument) + u²(set-up)        u²(F) = u²(D) = σ²/n + u²(bar) + u²(instrument) + u²(set-up)
//! u²(H) = 2σ²/n + u²(instrument)
//! ```
//!
//! `u(set-up)` follows from the priors of both balls by the evaluation of the figure, which removes the centre
//! (`circular::set_up`).

pub mod rule;

use std::f64::consts::SQRT_2;

use abbe_model::instrument::ballbar::BAR;
use abbe_model::session::tolerance::{Limit, TestFigure, Tolerance, Toleranced};
use abbe_model::session::{Prior, Session};
use rule::{Decision, Rule};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::circular::CircularTest;
use crate::figure::{self, Figure};
use crate::quantity::Given;
use crate::results::{Estimate, Interval, ModelResult, NotJudged};

/// The decision about a session, by the rule of ISO 14253-1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Conformity {
    /// `fail` if an item fails; else `undecided` if an item is undecided; else `pass`.
    pub verdict: Decision,
    /// Least probability with which `pass` and `fail` of an item are true.
    pub probability: f64,
    /// The decisions, in the order of the limits in the session.
    pub items: Vec<ConformityItem>,
}

/// The decision about one quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ConformityItem {
    /// The parameter, `EX0C`, or the figure with its test, `circular_deviation[XY]`.
    pub id: String,
    /// The measured value, in `unit`; absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// Its standard uncertainty, in `unit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub u: Option<f64>,
    /// Unit of all numbers: `um`, `arcsec`.
    pub unit: String,
    /// The lower limit, in `unit`; absent for a figure that is never negative.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lower: Option<f64>,
    /// The upper limit, in `unit`.
    pub upper: f64,
    /// The measured values that pass, in `unit`. Absent if none does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceptance_zone: Option<Interval>,
    /// A measured value beyond a limit by this much fails, in `unit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub guard_band: Option<f64>,
    /// Probability that the true value is within the limits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conformance_probability: Option<f64>,
    /// The decision.
    pub decision: Decision,
    /// Why it is undecided, in words; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
}

/// Measured values of one quantity with their standard uncertainties. All have to be within its limits.
pub(super) struct Measured {
    pub values: Vec<(f64, f64)>,
    pub unit: String,
}

/// A figure of a test, or why there is none.
pub(super) fn measured(
    session: &Session,
    circular: &[CircularTest],
    test: &str,
    figure: TestFigure,
    noise_um: f64,
    instrument_u_um: f64,
) -> Result<Measured, String> {
    let Some(found) = circular.iter().find(|found| found.test == test) else {
        return Err(format!("test \"{test}\" has no circular figures: it has no readings, or its path is no circle"));
    };
    let runs = found.directions.iter().map(|direction| direction.runs).min().unwrap_or(1).max(1) as f64;
    let mean_um = noise_um / runs.sqrt();
    let u_um = match figure {
        // The range of single runs, not of their mean.
        TestFigure::AsynchronousErrorMotion => noise_um * SQRT_2,
        TestFigure::MeanBidirectionalRadialDeviation | TestFigure::RadialDeviation => {
            mean_um.hypot(bar_u_um(session, test)?)
        }
        _ => mean_um * SQRT_2,
    };
    let ends = ["max", "min"].map(|end| format!("{}_{end}", figure.word()));
    let ids = if figure == TestFigure::RadialDeviation { ends.to_vec() } else { vec![figure.word().to_string()] };
    let lists = || found.directions.iter().map(|direction| &direction.figures).chain([&found.figures]);
    let values: Vec<&Figure> = ids.iter().flat_map(|id| lists().filter_map(|list| figure::find(list, id))).collect();
    if values.is_empty() {
        const ERROR_MOTION: &str =
            "a full turn of a rotary axis, with the linear axes at rest and the bar radial to the axis";
        return Err(format!(
            "test \"{test}\" has no {}: it needs {}",
            figure.word().replace('_', " "),
            match figure {
                TestFigure::SynchronousErrorMotion => ERROR_MOTION.to_string(),
                TestFigure::AsynchronousErrorMotion => format!("{ERROR_MOTION}, and several runs in one direction"),
                _ => "both directions".to_string(),
            }
        ));
    }
    if values.iter().any(|found| found.set_up_u.is_infinite()) {
        return Err(format!(
            "{} of test \"{test}\" contains the position of a ball that is not known: state workpiece_ball_u_um and \
             spindle_ball_u_um",
            figure.word().replace('_', " ")
        ));
    }
    let with_u = |found: &Figure| (found.value, u_um.hypot(instrument_u_um).hypot(found.set_up_u));
    let values: Vec<(f64, f64)> = values.into_iter().map(with_u).collect();
    if values.iter().any(|(_, u)| *u <= 0.0) {
        return Err("the uncertainty is not quantified: state `instrument_u_um`".to_string());
    }
    Ok(Measured { values, unit: "um".to_string() })
}

/// Standard uncertainty of the length of the bar of a test, µm; the reason if nothing is known about the length.
fn bar_u_um(session: &Session, test: &str) -> Result<f64, String> {
    let found = session.tests.iter().find(|other| other.name == test);
    match found.and_then(|test| test.priors.get(BAR)) {
        Some(Prior::Gaussian(u)) => Ok(u * 1e3),
        Some(Prior::Free) => Err("the bar length is not calibrated: state bar_u_um".to_string()),
        _ => Ok(0.0),
    }
}

/// The decisions about the results of a session; `None` if it states no limits. None is made about a parameter while the
/// model lacks an effect, or cannot be judged.
pub fn conformity(session: &Session, model: &ModelResult, circular: &[CircularTest]) -> Option<Conformity> {
    let goodness = model.outcome.goodness;
    let Tolerance { probability, limits } = session.tolerance.as_ref()?;
    let items: Vec<ConformityItem> = limits
        .iter()
        .map(|limit| {
            let measured = match &limit.of {
                Toleranced::Parameter(id) => of_parameter(&model.parameters, id),
                Toleranced::Figure { test, figure, instrument_u_um } => {
                    measured(session, circular, test, *figure, model.noise.value, *instrument_u_um)
                }
            };
            let below_noise =
                "the residual is far below the noise: the unit of the readings is in doubt; check units and noise";
            let forbidden = match limit.of {
                Toleranced::Parameter(_) => goodness.forbids_decisions(),
                // A figure of a test follows from its readings without the model, but not without their unit, which is in
                // doubt where they scatter less than the instrument.
                Toleranced::Figure { .. } => match goodness.not_judged {
                    Some(NotJudged::WrongUnit) => goodness.forbids_decisions(),
                    Some(NotJudged::BelowNoise) => Some(below_noise),
                    _ => None,
                },
            };
            item(limit, *probability, measured, forbidden)
        })
        .collect();
    let any = |decision: Decision| items.iter().any(|item| item.decision == decision);
    let verdict = match (any(Decision::Fail), any(Decision::Undecided)) {
        (true, _) => Decision::Fail,
        (false, true) => Decision::Undecided,
        (false, false) => Decision::Pass,
    };
    Some(Conformity { verdict, probability: *probability, items })
}

fn of_parameter(parameters: &[Estimate], id: &str) -> Result<Measured, String> {
    let Some(found) = parameters.iter().find(|parameter| parameter.id == id) else {
        return Err(format!("{id} is not identifiable from these readings, or is no parameter of the model"));
    };
    if found.u <= 0.0 {
        return Err(format!("the uncertainty of {id} is not quantified"));
    }
    Ok(Measured { values: vec![(found.value, found.u)], unit: found.unit.clone() })
}

fn item(
    limit: &Limit,
    probability: f64,
    measured: Result<Measured, String>,
    forbidden: Option<&str>,
) -> ConformityItem {
    let in_unit = |value: f64, unit: &str| {
        Given { id: limit.of.to_string(), value, unit: limit.unit.to_string() }
            .in_unit(unit)
            .map_err(|error| error.to_string())
    };
    let decided = measured.and_then(|measured| {
        let lower = limit.lower.map(|lower| in_unit(lower, &measured.unit)).transpose()?;
        let upper = in_unit(limit.upper, &measured.unit)?;
        // The value that is least probably within the limits decides.
        let rules = measured.values.iter().map(|(value, u)| (Rule { lower, upper, u: *u, probability }, *value));
        let probable = |(rule, value): &(Rule, f64)| rule.conformance_probability(*value);
        let (rule, value) = rules.min_by(|a, b| probable(a).total_cmp(&probable(b))).ok_or("there is no value")?;
        Ok((rule, value, measured.unit))
    });
    let (rule, value, unit) = match decided {
        Ok(decided) => decided,
        Err(why) => {
            return ConformityItem {
                id: limit.of.to_string(),
                value: None,
                u: None,
                unit: limit.unit.to_string(),
                lower: limit.lower,
                upper: limit.upper,
                acceptance_zone: None,
                guard_band: None,
                conformance_probability: None,
                decision: Decision::Undecided,
                why: Some(why),
            };
        }
    };
    let zone = rule.acceptance_zone();
    let decision = if forbidden.is_some() { Decision::Undecided } else { rule.decide(value) };
    let why = (decision == Decision::Undecided).then(|| match (forbidden, zone) {
        (Some(why), _) => why.to_string(),
        (None, None) => "the uncertainty is too large for these limits: no measured value passes".to_string(),
        (None, Some(_)) => "the value is nearer to a limit than its uncertainty allows".to_string(),
    });
    ConformityItem {
        id: limit.of.to_string(),
        value: Some(value),
        u: Some(rule.u),
        unit,
        lower: rule.lower,
        upper: rule.upper,
        acceptance_zone: zone,
        guard_band: Some(rule.one_sided_guard_band()),
        conformance_probability: Some(rule.conformance_probability(value)),
        decision,
        why,
    }
}
