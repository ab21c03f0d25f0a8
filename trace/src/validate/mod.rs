//! A saved model against readings that it never saw, with only the session's own set-up estimated, and the errors of the
//! machine that the caller counts to it.
//!
//! The errors of the machine are those of the model. The set-up (balls, bar, pose of the tracker) is estimated from the
//! session with its priors. With the whitened Jacobians `J_m` of the model's parameters and `J_s` of the set-up, and
//! `J̃ = (I − P)·J_m` after projection on the set-up, the residual has the covariance
//!
//! ```text
//! V = I + J̃·C·J̃ᵀ,   C = Cov(model) + Σ n·nᵀ over its null directions n, each one physical size long
//! ```
//!
//! - `machine`: whether the session is of the model's machine; `known`: the fit of the set-up with known errors;
//! - `prediction`: predicted variance of each reading, coverage, χ²; `moved`: parameters that have changed;
//! - `verdict`: the rule; `results`: the result as it is reported.

mod known;
pub mod machine;
mod moved;
mod prediction;
mod results;
mod verdict;

use abbe_identify::model_file::{IdentifiedModel, range};
use abbe_identify::noise::ReadingNoise;
use abbe_model::Diagnostic;
use abbe_model::component::ErrorName;
use abbe_model::session::Session;
use known::KnownErrors;
use prediction::Prediction;
pub use results::{
    JudgedResidual, ModelNotJudged, MovedParameter, RmsResult, ValidatedModel, ValidationResult, ValidationStatement,
    ValidationVerdict, WithoutResult,
};
use verdict::{Evidence, verdict};

/// A validated model: what plots and tables need beside the result.
pub struct Validation {
    /// The result as it is reported.
    pub result: ValidationResult,
    /// The tests with readings, by name.
    pub tests: Vec<String>,
    /// Residuals of the nominal machine, by test, mm; outliers included.
    pub residuals_nominal: Vec<Vec<f64>>,
    /// Residuals of the model.
    pub residuals: Vec<Vec<f64>>,
    /// Standard deviation of each residual as the model predicts it, by test, mm.
    pub predicted_mm: Vec<Vec<f64>>,
    /// Whether each reading is inside the model's range, by test.
    pub inside: Vec<Vec<bool>>,
    /// Excluded outliers, by test.
    pub rejected: Vec<Vec<bool>>,
    /// Number of channels of a reading, by test.
    pub channels: Vec<usize>,
}

/// Validates a model on a session.
///
/// # Errors
/// If the session is of another machine or has no readings, no reading depends on the model, or the set-up cannot be
/// estimated.
pub fn validate(model: &IdentifiedModel, session: &Session) -> Result<Validation, Diagnostic> {
    validate_anew(model, session, &[])
}

/// Validates a model on a session in which some errors of the machine belong to the set-up: those that a new mounting
/// changes, such as the orientation of a robot's base or the index errors and the tilt of a telescope's mount. They are
/// estimated from the session without a prior, and the rest of the model is judged.
///
/// # Errors
/// As [`validate`], and if an error of `anew` is no parameter of the model.
pub fn validate_anew(model: &IdentifiedModel, session: &Session, anew: &[ErrorName]) -> Result<Validation, Diagnostic> {
    let mut warnings = session.warnings.clone();
    warnings.extend(machine::check(model, session)?);
    // Where its own fit fails, the natural lever stays.
    let session = &abbe_identify::fit::with_lever(session, 1).unwrap_or_else(|_| session.clone());
    let mut known = KnownErrors::new(model, session, anew)?;
    warnings.extend(known.not_carried.iter().map(|why| format!("not part of the machine, and left out: {why}")));
    let values = known.model_values();
    let beta = known.settle(&values)?;
    let (inside, left) = range::inside(&known.set_up, &model.ranges);
    let (rms, residuals) = known.rms(&values, &beta);
    let all = Judged::of(&known, &values, &beta)?;

    // Inside the range, with the set-up that these readings give.
    let kept = |rejected: &[Vec<bool>]| -> usize {
        let rows = inside.iter().zip(rejected).flat_map(|(inside, rejected)| inside.iter().zip(rejected));
        rows.filter(|(inside, rejected)| **inside && !**rejected).count()
    };
    let rejected = known.set_up.rejected.clone();
    let readings = known.set_up.readings();
    let readings_in_range = kept(&rejected);
    let partly = readings_in_range > 0 && readings_in_range < readings;
    let in_range = match partly {
        true => {
            let within = known.restricted_to(&inside);
            let beta = within.fit(&values)?;
            let judged = Judged::of(&within, &values, &beta)?;
            Some((within.rms(&values, &beta).0, judged, within))
        }
        false => None,
    };
    if readings_in_range == 0 {
        warnings.push(format!(
            "no reading lies inside the range of the model's data ({}): the model is tested as an extrapolation only",
            left.join(", ")
        ));
    }
    if all.undetermined > 0 {
        warnings.push(format!(
            "the readings depend on {} of parameters that the model's own readings did not determine; they stay at \
             nominal and enlarge the predicted uncertainty",
            abbe_model::words::counted(all.undetermined, "combination")
        ));
    }
    let nominal = known.rms_with(&vec![0.0; values.len()])?;
    let locations = known.rms_with(&known.location_values())?;
    let mut without = Vec::new();
    for effect in model.carried_effects() {
        let rms = known.rms_with(&known.values_without(effect))?;
        without.push(WithoutResult { effect: known.effect_id(effect), rms: RmsResult::from(&rms) });
    }
    // A residual as predicted everywhere is no extrapolation that fails: all readings then tell what has moved.
    let judged = match &in_range {
        Some((_, judged, _)) if !all.prediction.is_as_predicted() => judged,
        _ => &all,
    };
    let reference = if model.carried_effects().next().is_some() { &locations } else { &nominal };
    let compared = match &in_range {
        None => (&rms, *reference),
        Some((rms, _, within)) => {
            let values = if model.carried_effects().next().is_some() {
                within.location_values()
            } else {
                vec![0.0; values.len()]
            };
            (rms, within.rms_with(&values)?)
        }
    };
    let evidence = Evidence {
        all: all.is_consistent(),
        as_predicted: all.prediction.is_as_predicted(),
        in_range: in_range.as_ref().map(|(_, judged, _)| judged.is_consistent()),
        better_than_reference: compared.0.noise_ratio < compared.1.noise_ratio,
    };
    warnings.extend(known.noise_warning());
    // What the model lacks is in every difference.
    let not_judged = model.forbids_decisions().map(|why| ModelNotJudged {
        session: model.provenance.session.clone(),
        is_traced: model.provenance.command == "trace",
        birge_ratio: model.fit.u_enlargement,
        why: why.to_string(),
    });
    let prediction = &all.prediction;
    let result = ValidationResult {
        verdict: verdict(&evidence),
        readings,
        readings_in_range,
        outside: left,
        outliers: rejected.iter().flatten().filter(|rejected| **rejected).count(),
        noise: ReadingNoise { source: known.noise_source, ..known.set_up.reading_noise() },
        nominal: RmsResult::from(&nominal),
        locations: RmsResult::from(&locations),
        model: ValidatedModel {
            residual: prediction.judged(&rms),
            in_range: in_range.as_ref().map(|(rms, judged, _)| judged.prediction.judged(rms)),
        },
        without,
        moved: if not_judged.is_none() { judged.moved.clone() } else { Vec::new() },
        not_judged,
        volumetric_rms_um: Vec::new(),
        set_up: known.set_up_estimates(&values)?,
        warnings,
    };
    Ok(Validation {
        result,
        tests: known.set_up.tests.iter().map(|test| test.name.clone()).collect(),
        residuals_nominal: known.residuals_with(&vec![0.0; values.len()])?,
        residuals,
        predicted_mm: all.prediction.predicted_mm,
        inside,
        rejected,
        channels: (0..known.set_up.tests.len()).map(|test| known.set_up.channels(test)).collect(),
    })
}

/// Prediction and moved parameters of some readings.
struct Judged {
    prediction: Prediction,
    moved: Vec<MovedParameter>,
    undetermined: usize,
}

impl Judged {
    fn of(known: &KnownErrors<'_>, values: &[f64], beta: &[f64]) -> Result<Judged, Diagnostic> {
        let linearised = known.linearised(values, beta)?;
        Ok(Judged {
            prediction: Prediction::of(known, &linearised)?,
            moved: moved::moved(known, &linearised)?,
            undetermined: prediction::undetermined(&linearised)?,
        })
    }

    fn is_consistent(&self) -> bool {
        self.moved.is_empty() && self.prediction.is_as_predicted()
    }
}

#[cfg(test)]
mod tests;
