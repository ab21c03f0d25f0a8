//! What is reported, as it stands in JSON. Units stand in the names, or beside the value.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use crate::circular::CircularTest;
use crate::plausibility::Plausibility;

/// A value with its standard uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ParameterResult {
    /// `EY0A`, `bar[A100]`, `EZC~C:h2.amplitude`.
    pub id: String,
    /// The value, in `unit`.
    pub value: f64,
    /// One standard uncertainty, in `unit`.
    pub u: f64,
    /// `um`, `arcsec`, …
    pub unit: String,
}

/// A combination of unknowns that no reading can see.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Unobservable {
    /// How much of each unknown, in its outside unit: moving all of them by these amounts changes no reading.
    pub combination: BTreeMap<String, f64>,
    /// In words.
    pub why: String,
}

/// A reading that was left out.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Rejected {
    /// The test.
    pub test: String,
    /// The data file.
    pub file: String,
    /// The line in it.
    pub line: usize,
    /// The length of its residual, µm.
    pub residual_um: f64,
}

/// What `abbe fit` reports.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FitResult {
    /// Standard deviation of one scalar reading, µm.
    pub noise_um: f64,
    /// Where that figure comes from: `stated` by the session, `repeats` (repeated readings), or `residual` where there is neither: the residual of the
    /// declared model, which holds what the model lacks beside noise.
    pub noise_source: String,
    /// Number of readings that count.
    pub readings: usize,
    /// Residual over scalar readings, µm.
    pub rms_um: f64,
    /// The same on readings that the fit did not see.
    pub heldout_rms_um: f64,
    /// Length of the residual vector, µm, for instruments with three coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_3d_um: Option<f64>,
    /// The same on readings that the fit did not see.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heldout_rms_3d_um: Option<f64>,
    /// What is left out at a time for the held-out figures.
    pub heldout_by: String,
    /// How many independent combinations of the unknowns the readings see, of how many unknowns.
    pub rank: usize,
    /// Number of unknowns.
    pub unknowns: usize,
    /// The Birge ratio `√(χ²/ν)`, priors counted as observations: the residual over the noise. Below 1 where readings scatter less than `noise_um` says.
    pub birge_ratio: f64,
    /// By how much the uncertainties are enlarged: the Birge ratio where it is significantly above 1 (p < 0.001), else 1.
    pub u_enlargement: f64,
    /// What was identified.
    pub parameters: Vec<ParameterResult>,
    /// What cannot be.
    pub unobservable: Vec<Unobservable>,
    /// Readings left out.
    pub rejected: Vec<Rejected>,
    /// Ball-bar figures of the tests whose path is a circle.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub circular: Vec<CircularTest>,
    /// Statements of the session that the readings contradict, and what may be wrong.
    #[serde(flatten)]
    pub plausibility: Plausibility,
    /// What a user should know.
    pub warnings: Vec<String>,
    /// Notes of the session file's `[about]`: `serial_number`, `operator`, `date`, `comment` and others.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub about: BTreeMap<String, String>,
    /// The same by Monte Carlo, where it was asked for. `u` in `parameters` is then what is quoted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub monte_carlo: Option<FitMonteCarlo>,
}

/// A fit by Monte Carlo (JCGM 101).
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FitMonteCarlo {
    /// Number of runs.
    pub runs: u64,
    /// Seed.
    pub seed: u64,
    /// Coverage probability of the intervals.
    pub coverage: f64,
    /// Runs whose fit has no end; they are in no figure.
    pub unconverged: u64,
    /// In the order of the fit's parameters.
    pub parameters: Vec<DrawnParameter>,
}

/// A parameter by both propagations, in `unit`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DrawnParameter {
    /// As in the fit.
    pub id: String,
    /// `um`, `arcsec`, …
    pub unit: String,
    /// What the fit found.
    pub value: f64,
    /// Its standard uncertainty by the law of propagation (GUM).
    pub gum_u: f64,
    /// The interval that follows from it, with a Gaussian coverage factor.
    pub gum_interval: [f64; 2],
    /// Mean over the runs.
    pub mean: f64,
    /// Standard deviation over the runs.
    pub u: f64,
    /// The probabilistically symmetric coverage interval over the runs.
    pub symmetric: [f64; 2],
    /// The shortest one.
    pub shortest: [f64; 2],
    /// By how much the ends of the symmetric interval are off those of the GUM's.
    pub end_differences: [f64; 2],
    /// By how much they may be (JCGM 101, 8.1), one digit of `gum_u` counting.
    pub tolerance: f64,
    /// Standard uncertainty of such an end, from the number of runs.
    pub end_u: f64,
    /// `agree`, `differ`, or `undecided` where the runs are too few to tell.
    pub verdict: Verdict,
}

/// Whether GUM and Monte Carlo agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Within the tolerance: the GUM's figures are quoted.
    Agree,
    /// Not within it: the Monte Carlo's are.
    Differ,
    /// The runs are too few to tell: the Monte Carlo's are.
    Undecided,
}

/// A residual and parameters, before or after the found effects.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ModelResult {
    /// Residual over scalar readings, µm.
    pub rms_um: f64,
    /// The same on readings that neither fit nor search saw.
    pub heldout_rms_um: f64,
    /// Length of the residual vector, µm, for instruments with three coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_3d_um: Option<f64>,
    /// The same on readings that neither fit nor search saw.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heldout_rms_3d_um: Option<f64>,
    /// Standard deviation of one scalar reading that the uncertainties follow from, µm. Where the source is `residual`, that of this model.
    pub noise_um: f64,
    /// What was identified.
    pub parameters: Vec<ParameterResult>,
}

/// An effect by its name in the vocabulary of session files.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct EffectName {
    /// What moves.
    pub component: String,
    /// What it follows.
    pub driver: String,
    /// How.
    pub shape: String,
    /// Order of a harmonic, degree of a polynomial.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<f64>,
    /// The tests it is confined to, if it is.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tests: Vec<String>,
    /// What it does, in words: `C table: axial motion twice per turn`.
    pub meaning: String,
}

/// A point of a free curve. What location errors can absorb of a curve is not in it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CurvePoint {
    /// Where on the driver.
    pub at: f64,
    /// The component's value there.
    pub value: f64,
    /// Its standard uncertainty.
    pub u: f64,
}

/// A number in an effect's shape that was chosen, not fitted with the coefficients: it has no uncertainty of its own.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ShapeNumber {
    /// `period`, `time constant`, `width`, `centre`, or `at` for the places of steps.
    pub name: String,
    /// One value, or one for each place.
    pub values: Vec<f64>,
    /// Unit of what the effect follows: mm, deg, s.
    pub unit: String,
}

/// An effect that trace has found.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct EffectResult {
    /// Component, driver, shape, order.
    #[serde(flatten)]
    pub name: EffectName,
    /// Its family in the library, in words.
    pub family: String,
    /// The numbers and places of its shape.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub numbers: Vec<ShapeNumber>,
    /// Its coefficients; of a free curve those that the readings tell singly, which may be none.
    pub parameters: Vec<ParameterResult>,
    /// For a free curve: its points with their band.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub curve: Vec<CurvePoint>,
    /// Unit of the places of a curve.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub curve_at_unit: String,
    /// Unit of the values of a curve.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub curve_unit: String,
    /// Probability that the whole search finds as good in readings without structure.
    pub p_value: f64,
    /// By how much it lowers the residual, µm: the rms of what it explains beside everything else.
    pub rms_gain_um: f64,
    /// Held-out rms once it was added, µm.
    pub heldout_rms_um: f64,
    /// Whether the readings single it out: no other effect of the library explains them as well in its place.
    pub unique: bool,
    /// Number of explanations that the readings do not separate, this effect included; 1 where it is unique.
    pub indistinguishable: usize,
    /// All of them in words, by part of the machine: `C table: axial motion twice per turn, or tilt about X once per turn`.
    pub explanations: String,
    /// The other ones, nearest first.
    pub aliases: Vec<EffectName>,
    /// The first of `separating_tests`.
    pub separated_by: Option<String>,
    /// How well that test separates the effect from the nearest alias that it separates at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separation: Option<SeparationResult>,
    /// Further tests that separate the effect from its aliases: the first separates most of them, each other one most of those that are left.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub separating_tests: Vec<SeparatingTestResult>,
}

/// How well a further test separates a found effect from one of its aliases.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SeparationResult {
    /// From what.
    pub from: EffectName,
    /// By the readings that there are, standard deviations.
    pub before_sigma: f64,
    /// With the test, standard deviations.
    pub after_sigma: f64,
    /// What the test takes, min.
    pub minutes: f64,
}

/// A further test, and which aliases it separates from a found effect.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SeparatingTestResult {
    /// In words: `C150 with the workpiece ball at radius 50 mm`.
    pub test: String,
    /// What it takes, min.
    pub minutes: f64,
    /// How many of `alternatives` it separates.
    pub separates: usize,
    /// Number of `alternatives`.
    pub of: usize,
    /// The aliases that no test before it separates, nearest first.
    pub alternatives: Vec<AlternativeResult>,
}

/// How well a test separates a found effect from one alternative.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct AlternativeResult {
    /// Component, driver, shape, order.
    #[serde(flatten)]
    pub name: EffectName,
    /// Separation by the readings that there are and the tests before this one, standard deviations.
    pub before_sigma: f64,
    /// Separation with the test as well, standard deviations.
    pub after_sigma: f64,
    /// Whether that is enough: 3 standard deviations.
    pub separated: bool,
}

/// A candidate that is not claimed although it scores better than the null distribution of the search.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RejectedCandidate {
    /// Component, driver, shape, order.
    #[serde(flatten)]
    pub name: EffectName,
    /// Probability that the whole search finds as good in readings without structure.
    pub p_value: f64,
    /// By how much it lowered the held-out rms, µm; negative if the held-out rms rose.
    pub heldout_fall_um: f64,
    /// Standard error of that fall, µm, from paired differences over runs, blocks or poses.
    pub u_heldout_fall_um: f64,
}

/// What is left.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Remainder {
    /// Whether it has structure beyond noise.
    pub structured: bool,
    /// Probability of as much in readings without structure.
    pub p_value: f64,
    /// Where and what, if it has.
    #[serde(rename = "where")]
    pub place: Option<String>,
}

/// A parameter that moved by more than its uncertainty between before and after.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ChangedParameter {
    /// The parameter.
    pub id: String,
    /// After less before.
    pub by: f64,
    /// Its standard uncertainty after.
    pub u: f64,
    /// Unit of both.
    pub unit: String,
}

/// What `abbe trace` reports.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TraceResult {
    /// `clean`, `explained`, `partly-explained`, `unexplained`; `incomplete` for an interrupted trace.
    pub verdict: String,
    /// Whether the trace was interrupted: effects may be missing.
    pub interrupted: bool,
    /// Standard deviation of one scalar reading with the effects that were found, µm: that of `after`.
    pub noise_um: f64,
    /// Where that figure comes from: `stated` by the session, `repeats` (repeated readings), or `residual` where there is neither: the residual of the
    /// model with its effects, which holds what that model lacks beside noise.
    pub noise_source: String,
    /// Autoregressive coefficients of the noise along a run; empty for white noise.
    pub noise_ar_coefficients: Vec<f64>,
    /// Number of readings that count.
    pub readings: usize,
    /// What is left out at a time for the held-out figures.
    pub heldout_by: String,
    /// The declared model.
    pub before: ModelResult,
    /// With the effects that were found.
    pub after: ModelResult,
    /// The effects, in the order in which they were found.
    pub effects: Vec<EffectResult>,
    /// What is left.
    pub remainder: Remainder,
    /// What the residual of the declared model looks like, in words.
    pub residual_before: String,
    /// Candidates that score better than the null distribution of the search and are not claimed, because the held-out error does not fall by more than the
    /// standard error of the fall.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rejected_candidates: Vec<RejectedCandidate>,
    /// Parameters that moved by more than their uncertainty: that was the bias.
    pub moved: Vec<ChangedParameter>,
    /// How many candidates were looked for, and how many of them these readings can see.
    pub candidates: usize,
    /// See `candidates`.
    pub candidates_seen: usize,
    /// What no reading can see.
    pub unobservable: Vec<Unobservable>,
    /// Readings left out.
    pub rejected: Vec<Rejected>,
    /// Statements of the session that the readings contradict, and what may be wrong.
    #[serde(flatten)]
    pub plausibility: Plausibility,
    /// What a user should know.
    pub warnings: Vec<String>,
    /// Notes of the session file's `[about]`: `serial_number`, `operator`, `date`, `comment` and others.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub about: BTreeMap<String, String>,
}
