//! What a plan's analysis says, as it stands in JSON. Units stand in the names, or beside the value.

use schemars::JsonSchema;
use serde::Serialize;

use crate::results::Unobservable;

/// What `abbe plan` reports.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PlanAnalysis {
    /// Standard deviation of one scalar reading, µm.
    pub noise_um: f64,
    /// Number of readings.
    pub readings: usize,
    /// Independent combinations that are seen.
    pub rank: usize,
    /// Number of unknowns, set-up quantities included.
    pub unknowns: usize,
    /// Number of times a workpiece ball (tracker, socket) is mounted.
    pub setups: usize,
    /// Time that the axes move, min; absent where the states tell no time.
    pub moving_min: Option<f64>,
    /// The tests.
    pub tests: Vec<TestSummary>,
    /// The errors that the plan is made for.
    pub errors: Vec<ErrorAnalysis>,
    /// Combinations that no reading sees.
    pub blind: Vec<Unobservable>,
    /// Errors that readings alone cannot tell from set-up quantities.
    pub held_by_setup: Vec<HeldBySetup>,
    /// Errors that are nearly collinear.
    pub nearly_collinear: Vec<NearDependency>,
    /// Correlation of the errors.
    pub correlation: Correlation,
    /// Scalar figures of merit.
    pub indices: Indices,
    /// What every test contributes.
    pub without: Vec<WithoutTest>,
    /// What undeclared effects would do; absent where it was not asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effects: Option<EffectsAnalysis>,
    /// What a user should know.
    pub warnings: Vec<String>,
}

/// A test in short.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TestSummary {
    /// Its name.
    pub name: String,
    /// Number of readings.
    pub readings: usize,
    /// How long the axes move, min.
    pub moving_min: Option<f64>,
    /// Farthest that the nominal distance of the balls is from the bar's length, mm; absent for other instruments.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reach_mm: Option<f64>,
    /// Which mounted workpiece ball it uses.
    pub setup: String,
}

/// An error and what the plan says of it.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ErrorAnalysis {
    /// `EY0A`, `EZC~C:h2.cos`.
    pub id: String,
    /// Unit of its uncertainties: `um`, `arcsec`, …
    pub unit: String,
    /// Predicted standard uncertainty; absent where the error takes part in an unseen combination.
    pub u: Option<f64>,
    /// µm of reading a `unit` of the error, all other unknowns standing still.
    pub sensitivity: Sensitivity,
    /// Where the uncertainty comes from, the largest first; the squares of the parts add up to the square of `u`.
    pub budget: Vec<Contribution>,
    /// What `u` would be if all other errors were known.
    pub u_others_known: Option<f64>,
    /// Other errors, and the share of the variance that would go if each were known: the squared correlation.
    pub shared_with: Vec<CorrelatedWith>,
    /// Sensitivity along the first run of each test.
    pub curves: Vec<Curve>,
}

/// µm of reading per unit of an error.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Sensitivity {
    /// The largest over all readings, its sign kept.
    pub largest: f64,
    /// The test where it is largest.
    pub largest_in: String,
    /// Root mean square over all readings.
    pub rms: f64,
}

/// A part of a standard uncertainty.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Contribution {
    /// `noise`, or a set-up quantity: `spindle_ball.z[A150]`.
    pub from: String,
    /// Its part, in the unit of the error.
    pub u: f64,
    /// Its share of the variance, 0 to 1.
    pub share: f64,
}

/// Another error that shares the variance of an error.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CorrelatedWith {
    /// The other error.
    pub id: String,
    /// The correlation, −1 to 1; its square is the share of the variance that would go if the other error were known.
    pub correlation: f64,
}

/// Sensitivity along one traversal.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Curve {
    /// The test.
    pub test: String,
    /// Length of reading (for three coordinates: length of the vector) per unit of the error, evenly thinned.
    pub values: Vec<f64>,
}

/// An error that readings alone cannot tell from set-up quantities.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct HeldBySetup {
    /// The error.
    pub error: String,
    /// Moving these together changes no reading: the error, then what it hides behind, in outside units.
    pub combination: Vec<(String, f64)>,
    /// In words.
    pub why: String,
}

/// Unknowns that are nearly one combination.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct NearDependency {
    /// Condition index: the largest over this singular value of the Jacobian with columns of unit length.
    pub condition_index: f64,
    /// How much of each, in outside units.
    pub combination: Vec<(String, f64)>,
    /// In words.
    pub why: String,
}

/// Correlations of the errors.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Correlation {
    /// The errors.
    pub ids: Vec<String>,
    /// Row by row; `null` where one of the two is not seen.
    pub matrix: Vec<Vec<Option<f64>>>,
}

/// Figures of merit of the information on the errors, set-up quantities being unknown within their priors.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct Indices {
    /// Errors that are seen by themselves.
    pub seen: usize,
    /// Errors in all. Where fewer are seen, the figures are of those that are.
    pub errors: usize,
    /// Largest over smallest singular value of the scaled Jacobian.
    pub condition_number: f64,
    /// `(σ1 ⋯ σm)^(1/m) / √n` (Borm & Menq, Int. J. Robotics Res. 10 (1991) 51).
    pub o1: f64,
    /// `σm / σ1` (Driels & Pathre, J. Robotic Syst. 7 (1990) 197).
    pub o2: f64,
    /// `σm` (Nahvi, Hollerbach & Hayward, Proc. IEEE ICRA (1994) 407).
    pub o3: f64,
    /// `σm² / σ1`, the noise amplification index (Nahvi & Hollerbach, Proc. IEEE ICRA (1996) 647).
    pub o4: f64,
    /// `1 / (1/σ1 + ⋯ + 1/σm)` (Sun & Hollerbach, Proc. IEEE ICRA (2008) 831).
    pub o5: f64,
    /// D-efficiency: 1 for errors that do not disturb one another.
    pub d_efficiency: f64,
    /// A-efficiency.
    pub a_efficiency: f64,
    /// E-efficiency.
    pub e_efficiency: f64,
    /// G-efficiency: mean over greatest leverage of a reading.
    pub g_efficiency: f64,
}

/// What becomes of the uncertainties without a test.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct WithoutTest {
    /// The test that is left out.
    pub test: String,
    /// Each error and by how much its variance grows; absent where it is no longer seen.
    pub variance_inflation: Vec<(String, Option<f64>)>,
    /// In words.
    pub why: String,
}

/// What undeclared effects would do.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct EffectsAnalysis {
    /// Significance of one look.
    pub significance: f64,
    /// Power at which an effect counts as detectable.
    pub power: f64,
    /// Number of effects looked at.
    pub effects_searched: usize,
    /// Significance of one look when all effects are looked at and one false alarm in all has the probability `significance` (Šidák).
    pub significance_corrected: f64,
    /// The effects.
    pub effects: Vec<EffectDetectability>,
}

/// One undeclared effect.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct EffectDetectability {
    /// `EZC~C:h2`.
    pub id: String,
    /// In words: the family of the library.
    pub family: String,
    /// Unit of its amplitude.
    pub unit: String,
    /// Smallest amplitude that one look finds, of a power at 100 mm or 180°; absent where no amplitude of physical size on the travel would be found.
    pub detectable: Option<f64>,
    /// The same when all effects are looked at.
    pub detectable_searched: Option<f64>,
    /// Share of its signal (sum of squares) that remains after the fit of the parameters, 0 to 1.
    pub surviving_share: f64,
    /// `seen`, `hidden` (under a hundredth survives), `none` (these tests do not change with it).
    pub verdict: String,
    /// The errors it biases, the strongest first, in their unit per unit of the effect.
    pub biases: Vec<Bias>,
}

/// By how much an effect biases an error.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Bias {
    /// The error.
    pub id: String,
    /// Units of the error per unit of the effect; of cosine and sine at the worst phase, without a sign.
    pub per_unit: f64,
    /// The unit: `um/um`, `arcsec/um`, …
    pub unit: String,
}
