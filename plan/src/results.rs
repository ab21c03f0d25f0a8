//! What a plan's analysis reports, as JSON has it. Units stand in the names, or beside the value.

use schemars::JsonSchema;
use serde::Serialize;

use super::collision::TestClearance;
use abbe_identify::identifiability::NearDependency;
use abbe_identify::noise::ReadingNoise;
use abbe_identify::results::{DeterminedByPrior, Unobservable};

/// Identifiability and predicted uncertainties of planned tests.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PlanAnalysis {
    /// The noise of a reading.
    #[serde(flatten)]
    pub noise: ReadingNoise,
    /// Number of readings.
    pub readings: usize,
    /// Number of independent combinations of the parameters that are identifiable.
    pub rank: usize,
    /// Number of parameters, set-up parameters included.
    pub parameter_count: usize,
    /// Number of times a workpiece ball (tracker, socket) is mounted.
    pub setup_count: usize,
    /// Time for which the axes move, min; `null` where the states have no time.
    pub moving_min: Option<f64>,
    /// The tests.
    pub tests: Vec<TestSummary>,
    /// The errors that the plan identifies.
    pub errors: Vec<ErrorAnalysis>,
    /// Null-space directions: combinations of parameters that leave every reading unchanged.
    pub unidentifiable: Vec<Unobservable>,
    /// Errors that are confounded with set-up parameters and determined by the set-up priors only.
    pub determined_by_prior: Vec<DeterminedByPrior>,
    /// Combinations of errors whose columns are nearly collinear.
    pub nearly_collinear: Vec<NearDependency>,
    /// Correlation of the errors.
    pub correlation: Correlation,
    /// Observability indices and efficiencies.
    pub indices: Indices,
    /// The plan without each test.
    pub leave_one_out: Vec<LeaveOneOut>,
    /// Detectability of undeclared effects and the biases by them; absent where it was not requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effects: Option<EffectsAnalysis>,
    /// Least clearance of every test, if machine or session state what can collide.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub clearances: Vec<TestClearance>,
    /// Warnings in words.
    pub warnings: Vec<String>,
}

impl PlanAnalysis {
    /// The error with the largest predicted standard uncertainty; 1 µm counts as 1″.
    pub fn worst(&self) -> Option<&ErrorAnalysis> {
        let identifiable = self.errors.iter().filter_map(|error| Some((error, error.u?)));
        let worst = identifiable.max_by(|(a, u), (b, other)| u.total_cmp(other).then_with(|| b.id.cmp(&a.id)));
        worst.map(|(error, _)| error)
    }
}

/// A test in short.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TestSummary {
    /// Its name.
    pub name: String,
    /// Number of readings.
    pub readings: usize,
    /// Time for which the axes move, min.
    pub moving_min: Option<f64>,
    /// Largest difference of the nominal distance of the balls and the bar's length, mm; absent for other instruments.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reach_mm: Option<f64>,
    /// The mounted workpiece ball that it uses.
    pub setup: String,
}

/// An error, and how well the plan identifies it.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ErrorAnalysis {
    /// Identifier: `EY0A`, `EZC~C:h2.cos`.
    pub id: String,
    /// What the error is, in words.
    pub meaning: String,
    /// Unit of the uncertainties: `um`, `arcsec`, …
    pub unit: String,
    /// Predicted standard uncertainty, in `unit`; `null` where the error takes part in a null-space direction.
    pub u: Option<f64>,
    /// Sensitivity of the readings to the error, all other parameters constant.
    pub sensitivity: Sensitivity,
    /// Uncertainty budget, the largest contribution first. The squares of the contributions add up to the square of
    /// `u`.
    pub budget: Vec<Contribution>,
    /// Conditional standard uncertainty, in `unit`: `u` if all other errors were known.
    pub conditional_u: Option<f64>,
    /// The errors with which the error is correlated.
    pub correlated_with: Vec<CorrelatedWith>,
    /// Sensitivity along the first run of each test.
    pub curves: Vec<Curve>,
}

/// Change of a reading per unit of an error.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Sensitivity {
    /// The largest over all readings, with its sign, in `unit`.
    pub largest: f64,
    /// The test in which it is largest.
    pub largest_in_test: String,
    /// Root mean square over all readings, in `unit`.
    pub rms: f64,
    /// Unit: `um/um`, `um/arcsec`, …
    pub unit: String,
}

impl ErrorAnalysis {
    /// Share of the noise in the variance.
    pub fn noise_share(&self) -> f64 {
        self.budget.iter().filter(|part| part.is_noise()).map(|part| part.share).sum()
    }
}

/// A contribution to a standard uncertainty.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Contribution {
    /// `noise`, or a set-up parameter: `spindle_ball.z[A150]`.
    pub source: String,
    /// The contribution, in the unit of the error.
    pub u: f64,
    /// Its share of the variance, 0 to 1.
    pub share: f64,
}

impl Contribution {
    /// The `source` of the noise of the readings.
    pub(super) const NOISE: &str = "noise";

    /// Whether the noise of the readings contributes, not a set-up parameter.
    pub fn is_noise(&self) -> bool {
        self.source == Contribution::NOISE
    }
}

/// An error that is correlated with an error.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CorrelatedWith {
    /// The other error.
    pub id: String,
    /// Correlation coefficient, −1 to 1. Its square is the share of the variance that vanishes if the other error is
    /// known.
    pub correlation: f64,
}

/// Sensitivity along one traversal.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Curve {
    /// The test.
    pub test: String,
    /// Change of the reading, or of the length of its vector, per unit of the error, in the unit of the sensitivity,
    /// evenly thinned.
    pub values: Vec<f64>,
}

/// Correlation matrix of the errors.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Correlation {
    /// The errors, in the order of rows and columns.
    pub ids: Vec<String>,
    /// Row by row; `null` where one of the two errors is not identifiable.
    pub matrix: Vec<Vec<Option<f64>>>,
}

/// Observability indices and efficiencies of the information on the errors, with the set-up parameters estimated within
/// their priors.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct Indices {
    /// Number of identifiable errors. The figures are of these.
    pub identifiable_count: usize,
    /// Number of errors.
    pub error_count: usize,
    /// Largest over smallest singular value of the scaled Jacobian.
    pub condition_number: f64,
    /// Observability index O1, the volume of the information: `(σ1 ⋯ σm)^(1/m) / √n` (Borm & Menq, Int. J. Robotics
    /// Res. 10 (1991) 51).
    pub o1: f64,
    /// Observability index O2, the inverse condition number: `σm / σ1` (Driels & Pathre, J. Robotic Syst. 7 (1990)
    /// 197).
    pub o2: f64,
    /// Observability index O3, the least sensitive direction: `σm` (Nahvi, Hollerbach & Hayward, Proc. IEEE ICRA (1994)
    /// 407).
    pub o3: f64,
    /// Observability index O4, the noise amplification: `σm² / σ1` (Nahvi & Hollerbach, Proc. IEEE ICRA (1996) 647).
    pub o4: f64,
    /// Observability index O5, the harmonic mean of sensitivities: `1 / (1/σ1 + ⋯ + 1/σm)` (Sun & Hollerbach, Proc.
    /// IEEE ICRA (2008) 831).
    pub o5: f64,
    /// D-efficiency: 1 for uncorrelated errors.
    pub d_efficiency: f64,
    /// A-efficiency: 1 for uncorrelated errors.
    pub a_efficiency: f64,
    /// E-efficiency: 1 for uncorrelated errors.
    pub e_efficiency: f64,
    /// G-efficiency: mean over greatest leverage of a reading.
    pub g_efficiency: f64,
}

/// The uncertainties without one test.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LeaveOneOut {
    /// The test that is left out.
    pub test: String,
    /// Each identifiable error, and its variance inflation.
    pub variance_inflation: Vec<VarianceInflation>,
    /// Explanation in words.
    pub why: String,
}

/// Variance inflation of an error.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct VarianceInflation {
    /// The error.
    pub id: String,
    /// Variance without the test over variance with it; `null` where the error is no longer identifiable.
    pub factor: Option<f64>,
}

/// Detectability of undeclared effects, and the biases by them.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct EffectsAnalysis {
    /// Significance level of a test of a single effect.
    pub significance_level: f64,
    /// Power at which an effect counts as detectable.
    pub power: f64,
    /// Number of effects that are screened.
    pub effects_screened: usize,
    /// Significance level of a single effect when all effects are screened (Šidák).
    pub significance_level_corrected: f64,
    /// The effects.
    pub effects: Vec<EffectDetectability>,
}

/// One undeclared effect.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct EffectDetectability {
    /// Identifier: `EZC~C:h2`.
    pub id: String,
    /// Family of the effect in the library, in words.
    pub family: String,
    /// Unit of its amplitude.
    pub unit: String,
    /// Smallest amplitude that a test of this effect alone detects, in `unit`; of power 1 over a linear axis per metre,
    /// of other powers at 100 mm or 180°. `null` where none of physical size is.
    pub detectable_amplitude: Option<f64>,
    /// Smallest amplitude that is detected when all effects are screened, in `unit`.
    pub detectable_amplitude_screened: Option<f64>,
    /// Share of its signal (sum of squares) that remains in the residual after the fit of the parameters, 0 to 1.
    pub residual_share: f64,
    /// `detectable`; `confounded` with the parameters (less than a hundredth remains); `confounded at one phase`;
    /// `no signal` (these tests do not change with it).
    pub verdict: Detectability,
    /// The errors that it biases, the most biased first.
    pub biases: Vec<Bias>,
}

/// Whether planned tests detect an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub enum Detectability {
    /// They do.
    #[serde(rename = "detectable")]
    Detectable,
    /// Less than a hundredth of its signal remains beside the parameters.
    #[serde(rename = "confounded")]
    Confounded,
    /// The same at one phase only.
    #[serde(rename = "confounded at one phase")]
    ConfoundedAtOnePhase,
    /// These tests do not change with it.
    #[serde(rename = "no signal")]
    NoSignal,
}

impl Detectability {
    /// The words in results.
    pub fn word(self) -> &'static str {
        match self {
            Detectability::Detectable => "detectable",
            Detectability::Confounded => "confounded",
            Detectability::ConfoundedAtOnePhase => "confounded at one phase",
            Detectability::NoSignal => "no signal",
        }
    }

    /// Whether it is confounded with the parameters, be it at one phase.
    pub fn is_confounded(self) -> bool {
        matches!(self, Detectability::Confounded | Detectability::ConfoundedAtOnePhase)
    }
}

impl std::fmt::Display for Detectability {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.word())
    }
}

/// Bias of an error by an effect.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Bias {
    /// The error.
    pub id: String,
    /// Bias per unit of the effect, in `unit`; of cosine and sine at the worst phase, without a sign.
    pub per_unit: f64,
    /// Unit: `um/um`, `arcsec/um`, …
    pub unit: String,
}
