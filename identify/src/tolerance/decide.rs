//! Decisions about parameters and figures.

use abbe_model::session::Session;
use abbe_model::session::tolerance::{Limit, Tolerance, Toleranced};

use super::figures::{self, Measured};
use super::results::{Conformity, ConformityItem};
use super::rule::{Decision, Rule};
use crate::circular::CircularTest;
use crate::quantity::Given;
use crate::results::{Estimate, ModelResult, NotJudged};

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
                    figures::measured(session, circular, test, *figure, model.noise.value, *instrument_u_um)
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
