//! What `trace` reports, as JSON has it.

use std::collections::BTreeMap;

use abbe_identify::plausibility::Plausibility;
use abbe_identify::results::{Estimate, ModelResult, ParameterChange, TraceVerdict};
use abbe_identify::tolerance::Conformity;
use abbe_model::document::measurement::Test;
use abbe_model::document::print::Block;
use abbe_model::unit::{Unit, reading};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

/// An effect by its keys of session files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectName {
    /// What moves.
    pub component: String,
    /// The quantity that the effect follows.
    pub driver: String,
    /// Shape of the dependence.
    pub shape: String,
    /// Order of a harmonic (periods per turn), degree of a polynomial. An integer unless the session states a fraction.
    #[serde(default, skip_serializing_if = "Option::is_none", serialize_with = "whole_as_integer")]
    pub order: Option<f64>,
    /// The tests to which the effect is confined, if any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tests: Vec<String>,
    /// What the effect is, in words: `C table: axial motion twice per turn`.
    pub meaning: String,
}

/// Writes 2 for an order of 2.0, and 2.5 for one of 2.5.
fn whole_as_integer<S: Serializer>(order: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    match order {
        Some(order) if order.fract() == 0.0 && order.abs() < 1e9 => serializer.serialize_i64(*order as i64),
        Some(order) => serializer.serialize_f64(*order),
        None => serializer.serialize_none(),
    }
}

/// A point of a nonparametric curve. The curve excludes what location errors can absorb.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CurvePoint {
    /// Value of the driver, in `curve_at_unit`.
    pub at: f64,
    /// Value of the component there, in `curve_unit`.
    pub value: f64,
    /// Standard uncertainty of `value`, in `curve_unit`.
    pub u: f64,
    /// Whether no reading lies near this value of the driver, so that the prior determines the curve.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub extrapolated: bool,
}

/// The Gaussian prior of the coefficients of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PriorResult {
    /// Standard deviation of a coefficient: the component where a basis function is 1.
    pub scale: f64,
    /// Its unit.
    pub unit: String,
    /// The family of effects for which it was estimated from the readings; absent if the session states it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub family: Option<String>,
    /// Effective number of parameters of the effect: those that the readings determine and not the prior.
    pub effective_parameters: f64,
    /// Number of its coefficients.
    pub coefficients: usize,
    /// The order of a spectrum with the largest amplitude. Absent for other shapes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest_order: Option<LargestOrder>,
}

/// The order of a spectrum with the largest amplitude: a gear ratio, a number of poles.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LargestOrder {
    /// The order.
    pub order: usize,
    /// Its amplitude, in the unit of the prior's scale.
    pub amplitude: f64,
    /// Probability that the largest of all orders is as large if none stands out.
    pub p_value: f64,
}

/// A number in an effect's shape as the search tunes it. Those that a fit estimates are among the parameters too, with their
/// uncertainties.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ShapeParameter {
    /// `period`, `time constant`, `width`, `centre`, or `at` for the positions of steps.
    pub name: String,
    /// One value, or one for each position.
    pub values: Vec<f64>,
    /// For the positions of the steps of a found effect their 95 % intervals by the profile likelihood, in `unit`; `null`
    /// where the readings do not bound the position.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub intervals_95: Vec<Option<[f64; 2]>>,
    /// Unit of the driver: mm, deg, s, K, m.
    pub unit: String,
}

/// An effect that explains the readings as well as a found effect in its place.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct AliasResult {
    /// Component, driver, shape, order.
    #[serde(flatten)]
    pub name: EffectName,
    /// The numbers of its shape, tuned for the alias.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shape_parameters: Vec<ShapeParameter>,
    /// Increase of χ² if the alias replaces the found effect; negative where χ² decreases.
    pub delta_chi2: f64,
    /// Likelihood with the alias over likelihood with the found effect: exp(−`delta_chi2`/2).
    pub likelihood_ratio: f64,
    /// Prior cost of the alias less that of the found effect, −ln of a probability, and 2 for each further number of
    /// its shape.
    pub prior_cost: f64,
    /// Probability of the alias over that of the found effect: `likelihood_ratio` · exp(−`prior_cost`).
    pub probability_ratio: f64,
    /// Other shapes of the same component over the same driver with the same fitted readings.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub variants: Vec<EffectName>,
}

/// An effect that the search has found.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct EffectResult {
    /// The unit of the figures of readings.
    #[serde(skip)]
    pub unit: Unit,
    /// Component, driver, shape, order.
    #[serde(flatten)]
    pub name: EffectName,
    /// Family of the effect in the library, in words.
    pub family: String,
    /// The numbers of its shape.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shape_parameters: Vec<ShapeParameter>,
    /// Its identifiable coefficients. A nonparametric curve may have none. A spectrum has the rms over a period.
    pub parameters: Vec<Estimate>,
    /// The prior of its coefficients; absent without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior: Option<PriorResult>,
    /// The points of a nonparametric curve or of a spectrum.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub curve: Vec<CurvePoint>,
    /// Unit of the driver of a curve.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub curve_at_unit: String,
    /// Unit of the values of a curve.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub curve_unit: String,
    /// Probability that the whole search finds as much in readings without structure.
    pub p_value: f64,
    /// Rms of what the effect explains in addition to the rest of the model, µm.
    pub rms_gain_um: f64,
    /// Held-out rms with this effect and those found before it, µm.
    pub heldout_rms_um: f64,
    /// Whether no other effect of the library explains the readings equally well in its place.
    pub unique: bool,
    /// Other shapes of the same component over the same driver with the same fitted readings.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub variants: Vec<EffectName>,
    /// Number of explanations that the readings do not separate, this one and no variants included.
    pub explanation_count: usize,
    /// All of these explanations in words, by part of the machine:
    /// `C table: axial motion twice per turn, or tilt about X once per turn`.
    pub explanations: String,
    /// The competing explanations, the most probable first, by likelihood and mechanical plausibility. Those that predict
    /// left-out tests clearly worse come last.
    pub aliases: Vec<AliasResult>,
    /// Rms of the left-out tests that this effect predicts, µm, for an effect with aliases.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left_out_test_rms_um: Option<f64>,
    /// The same with each of `aliases` in its place, µm; `null` if the other tests do not identify the alias for all of
    /// these tests.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub aliases_left_out_test_rms_um: Vec<Option<f64>>,
    /// The first of `separating_tests`.
    pub separated_by: Option<String>,
    /// Separation of the effect from the nearest alias that this test separates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separation: Option<SeparationResult>,
    /// Further tests that separate the effect from its aliases, the best first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub separating_tests: Vec<SeparatingTestResult>,
}

/// Separation of a found effect from one of its aliases by a further test.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SeparationResult {
    /// The alias.
    pub from: EffectName,
    /// Separation by the present readings, standard deviations.
    pub before_sigma: f64,
    /// Separation with the test added, standard deviations.
    pub after_sigma: f64,
    /// Duration of the test, min.
    pub duration_min: f64,
}

/// A further test, and the aliases that it separates from a found effect.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SeparatingTestResult {
    /// The test in words: `C150 with the workpiece ball at radius 50 mm`.
    pub test: String,
    /// Duration of the test, min.
    pub duration_min: f64,
    /// Number of `alternatives` that the test separates.
    pub separated_count: usize,
    /// Number of `alternatives`.
    pub alternative_count: usize,
    /// The aliases that no test before this one separates, nearest first.
    pub alternatives: Vec<AlternativeResult>,
    /// Name of the test in `session_toml`.
    pub name: String,
    /// The test as a `[[test]]` block of a session file.
    #[serde(rename = "session_toml")]
    pub proposal: Block<Test>,
}

/// Separation of a found effect from one alternative by a test.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct AlternativeResult {
    /// Component, driver, shape, order.
    #[serde(flatten)]
    pub name: EffectName,
    /// Separation by the present readings and the tests before this one, standard deviations.
    pub before_sigma: f64,
    /// Separation with this test added, standard deviations.
    pub after_sigma: f64,
    /// Whether the separation is at least 3 standard deviations.
    pub separated: bool,
}

/// A candidate that scores better than the null distribution of the search and is rejected by cross-validation.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RejectedCandidate {
    /// Component, driver, shape, order.
    #[serde(flatten)]
    pub name: EffectName,
    /// Probability that the whole search finds as much in readings without structure.
    pub p_value: f64,
    /// Decrease of the held-out rms, µm; negative where it increases.
    pub heldout_decrease_um: f64,
    /// Standard error of this decrease, µm, from paired differences over runs, blocks or poses.
    pub u_heldout_decrease_um: f64,
}

/// The residual of the model with the found effects.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Remainder {
    /// Whether it has structure beyond noise.
    pub structured: bool,
    /// Probability of as much structure in readings without structure.
    pub p_value: f64,
    /// Where the structure is, and what it looks like; `null` without structure.
    #[serde(rename = "where")]
    pub place: Option<String>,
}

/// Effects that the declared model lacks, and the model before and after they are added.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TraceResult {
    /// `arcsec` if all readings are angles, in which the keys of figures then end; absent for µm.
    #[serde(skip_serializing_if = "Unit::is_micrometre")]
    #[schemars(schema_with = "reading::schema")]
    pub reading_unit: Unit,
    /// `clean`, `explained`, `partly-explained`, `unexplained`; `not-judged` without a known noise; `incomplete` for an
    /// interrupted trace.
    pub verdict: TraceVerdict,
    /// Whether the trace was interrupted. Effects may then be missing.
    pub interrupted: bool,
    /// The time limit that interrupted it, s; absent if none did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_limit_s: Option<f64>,
    /// Whether every found effect is unique; `true` where there is none.
    pub unique: bool,
    /// Standard deviation of one scalar reading with the found effects, µm: that of `after`.
    pub noise_um: f64,
    /// The declared model.
    pub before: ModelResult,
    /// The model with the found effects.
    pub after: ModelResult,
    /// The effects, in the order in which they were found.
    pub effects: Vec<EffectResult>,
    /// The residual of the model with the found effects.
    pub remainder: Remainder,
    /// Structure of the residual of the declared model, in words.
    pub residual_before: String,
    /// Candidates beyond the null distribution of the search that are rejected, because the held-out error does not
    /// decrease by more than its standard error.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rejected_candidates: Vec<RejectedCandidate>,
    /// Parameters whose estimates in `before` and `after` differ by more than the standard uncertainty in `after`: the bias
    /// by the unmodelled effects.
    pub changed_parameters: Vec<ParameterChange>,
    /// Number of candidates that were screened.
    pub candidates: usize,
    /// Number of candidates that these readings can detect.
    pub candidates_detectable: usize,
    /// The families of effects of these candidates: what is unique is unique among them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub families: Vec<String>,
    /// What location errors of rotary axes rest on: motions of their axes that the readings do not separate from them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub presumed: Vec<String>,
    /// Decisions of conformity about the model with the found effects, if the session states limits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conformity: Option<Conformity>,
    /// Statements of the session that the readings contradict, and what may be wrong.
    #[serde(flatten)]
    pub plausibility: Plausibility,
    /// Warnings in words.
    pub warnings: Vec<String>,
    /// Notes of the session file's `[about]`: `serial_number`, `operator`, `date`, `comment` and others.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub about: BTreeMap<String, String>,
}

impl TraceResult {
    /// Marks a result as that of an interrupted trace: a field, the verdict, and a warning.
    pub fn mark_interrupted(&mut self) {
        self.interrupted = true;
        self.verdict = TraceVerdict::Incomplete;
        self.warnings.push(self.incompleteness());
    }

    /// States that a time limit of the caller interrupted the trace. A trace that was not interrupted is not changed.
    pub fn mark_time_limit(&mut self, seconds: f64) {
        if self.interrupted {
            let before = self.incompleteness();
            self.time_limit_s = Some(seconds);
            let now = self.incompleteness();
            self.warnings.iter_mut().filter(|warning| **warning == before).for_each(|w| w.clone_from(&now));
        }
    }

    fn incompleteness(&self) -> String {
        format!(
            "the trace was {}: effects may be missing from the model, and the residual was not examined for structure",
            self.interruption()
        )
    }

    /// The state at the interruption, for example `interrupted after 2 effects`.
    pub fn interruption(&self) -> String {
        let effects = match self.effects.len() {
            1 => "1 effect".to_string(),
            count => format!("{count} effects"),
        };
        match self.time_limit_s {
            Some(seconds) => format!("interrupted by the time limit of {seconds} s after {effects}"),
            None => format!("interrupted after {effects}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::EffectName;

    #[test]
    fn an_order_is_written_as_it_is_stated() {
        let written = |order| {
            let name = EffectName {
                component: "EZC".into(),
                driver: "C".into(),
                shape: "harmonic".into(),
                order,
                tests: Vec::new(),
                meaning: String::new(),
            };
            serde_json::to_value(&name).unwrap()["order"].to_string()
        };
        assert_eq!([Some(2.0), Some(2.5), None].map(written), ["2", "2.5", "null"]);
    }
}
