//! The reported comparison, in the form of the JSON output.

use abbe_identify::results::{NextStep, Outlier, ParameterChange, Statements};
use schemars::JsonSchema;
use serde::Serialize;

use super::workspace::VolumetricSummary;

/// The result of `abbe compare`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Comparison {
    /// The models and sessions, the first one being that with which the others are compared.
    // The document of a command has its files under `inputs`.
    #[serde(rename = "models")]
    pub inputs: Vec<String>,
    /// Probability of any false claim of a difference between two of them.
    pub significance: f64,
    /// The differences, by pair, the most significant first.
    pub differences: Vec<Difference>,
    /// Summary of each pair.
    pub pairs: Vec<Pair>,
    /// The readings that the fits of the sessions excluded as outliers.
    pub outliers: Vec<ExcludedReading>,
    /// The inputs whose differences are not judged: their model lacks an effect, or their unit is in doubt.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_judged: Vec<InputNotJudged>,
    /// The volumetric error over the common range of axes, one entry per input; empty if it was not evaluated.
    pub workspace: Vec<VolumetricSummary>,
}

/// An input whose own estimates are not to be quoted, so that no difference from them is judged.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct InputNotJudged {
    /// The session or model.
    pub input: String,
    /// Whether it is a session, which can be traced.
    pub is_session: bool,
    /// √(χ²/ν) of its fit.
    pub birge_ratio: f64,
    /// Why nothing can be decided from its estimates.
    pub why: String,
}

/// A reading of a session that its fit excluded as an outlier.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ExcludedReading {
    /// The session.
    pub input: String,
    /// The reading.
    #[serde(flatten)]
    pub outlier: Outlier,
}

/// The difference of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Difference {
    /// The first input.
    pub from: String,
    /// The other input.
    pub to: String,
    /// The value in the other input less that in the first.
    #[serde(flatten)]
    pub change: ParameterChange,
    /// Probability of a larger difference by chance, for this parameter alone.
    pub p_value: f64,
    /// Whether the difference is significant at the level over all parameters of the pair (Holm). Not if the pair is not
    /// judged.
    pub significant: bool,
}

/// The comparison of two inputs.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Pair {
    /// The first input.
    pub from: String,
    /// The other input.
    pub to: String,
    /// Number of parameters that are compared.
    pub compared: usize,
    /// Whether the differences are judged: the estimates of both inputs may be quoted.
    pub judged: bool,
    /// Number of significant differences.
    pub significant: usize,
    /// Single changes that explain all differences, the most probable first; empty if none does, or nothing differs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub single_changes: Vec<SingleChange>,
    /// χ² of all differences together.
    pub chi_square: f64,
    /// Its degrees of freedom.
    pub degrees_of_freedom: usize,
    /// Probability of a larger χ² if nothing has changed.
    pub p_value: f64,
    /// Set-up quantities that are the same object in both sessions.
    pub shared_setup: Vec<String>,
    /// Set-up quantities of one name that the readings show to be several objects.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_shared: Vec<NotShared>,
    /// Parameters without a difference of their own: one of the sessions does not separate them from others.
    pub not_comparable: Vec<NotComparable>,
    /// Effects and errors that only one of the inputs has.
    pub only_in: Vec<OnlyIn>,
}

/// A change of one parameter alone that explains all differences of a pair.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SingleChange {
    /// The change of the parameter, which may be one that is held at nominal.
    #[serde(flatten)]
    pub change: ParameterChange,
    /// χ² of what it leaves of the differences.
    pub chi_square: f64,
    /// Probability of a larger remainder by chance.
    pub p_value: f64,
    /// Probability that it is this change, among all changes of one parameter.
    pub probability: f64,
}

/// A set-up quantity of one name that is not one object in both sessions.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct NotShared {
    /// Deviation in the other input less that in the first, by the readings alone.
    #[serde(flatten)]
    pub change: ParameterChange,
    /// Probability of a larger difference if it were one object.
    pub p_value: f64,
    /// Whether the readings show that it is not. Otherwise they show it of another object of its kind.
    pub refuted: bool,
}

/// A parameter without a difference of its own.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct NotComparable {
    /// Identifier.
    pub id: String,
}

/// An effect or an error of one input.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct OnlyIn {
    /// Identifier.
    pub id: String,
    /// The input that has it.
    pub model: String,
}

/// Whether inputs agree.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct ComparisonStatement {
    /// Number of significant differences.
    pub significant: usize,
    /// Number of differences.
    pub compared: usize,
    /// The inputs whose differences are not judged.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_judged: Vec<String>,
    /// The volumetric error of each input over the common range, rms in µm; empty if not evaluated.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub volumetric_rms_um: Vec<f64>,
}

impl Comparison {
    /// The three statements of the self.
    pub fn statements(&self) -> Statements<ComparisonStatement, Difference> {
        let significant = self.differences.iter().filter(|difference| difference.significant);
        let changed: Vec<Difference> = significant.cloned().collect();
        let step = match (self.not_judged.is_empty(), changed.is_empty()) {
            (false, _) => NextStep::Trace,
            (true, true) => NextStep::Nothing,
            (true, false) => NextStep::Repeat,
        };
        Statements {
            good: ComparisonStatement {
                significant: changed.len(),
                compared: self.differences.len(),
                not_judged: self.not_judged.iter().map(|own| own.input.clone()).collect(),
                volumetric_rms_um: self.workspace.iter().map(|volume| volume.rms_um).collect(),
            },
            correct: Vec::new(),
            changed,
            further: Vec::new(),
            measure: step.into(),
        }
    }
}
