//! Conflicts between readings and session, and the mistakes that explain them, as JSON holds them.

use schemars::JsonSchema;
use serde::Serialize;

/// The statements that the readings contradict, and the mistakes that explain it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Plausibility {
    /// Statements of the session that the readings contradict, the worst first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub conflicts: Vec<Conflict>,
    /// Mistakes that remove the conflicts, the most probable first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub suggestions: Vec<Suggestion>,
    /// For poses: share of the variance of the measured positions that the model explains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub explained_variance: Option<f64>,
}

/// In what respect readings contradict a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ConflictKind {
    /// The estimate of a set-up parameter lies too many standard deviations from the stated value.
    SetupParameter,
    /// All set-up parameters together lie too far from their stated values.
    Setups,
    /// The residual of every test is at least a hundred times the noise.
    Residual,
    /// The residual is less than a tenth of the stated noise: the readings are probably in another unit.
    Unit,
    /// The model explains too little of the variance of the measured positions.
    ExplainedVariance,
    /// The model leaves too much of the measured orientations.
    Orientations,
    /// An axis lies more than 5 % of its link beside its place, or is tilted by more than 0.05 rad, against the axis before it,
    /// beyond the expanded uncertainty.
    LocationError,
    /// The zero angle of a joint is more than 10°, beyond its expanded uncertainty.
    ZeroAngle,
    /// The session, or for poses its nominal machine, fits far better with one of the suggestions.
    Statement,
}

/// One statement that the readings contradict.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Conflict {
    /// In what respect.
    pub kind: ConflictKind,
    /// The set-up parameter, or `session`.
    pub subject: String,
    /// What was found: the estimate of the set-up parameter, χ² of all of them, the residual, the share of the variance, the
    /// residual of the orientations, or the location error; in `unit`.
    pub value: f64,
    /// What it is compared with, in `unit`: the stated standard uncertainty, the degrees of freedom, the noise, the least
    /// share, the limit, or the residual with the best suggestion.
    pub stated: f64,
    /// Unit of `value` and `stated`; `1` for none.
    pub unit: String,
    /// For a set-up parameter: the estimate over its standard deviation if the session is right.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pull: Option<f64>,
    /// Description in words.
    #[serde(rename = "description")]
    pub words: String,
}

/// What may be wrong with a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SuggestionKind {
    /// The direction of an axis is reversed.
    AxisReversed,
    /// Two axes are exchanged in the chain.
    AxesExchanged,
    /// A ball lies on the other side.
    BallMirrored,
    /// The deviations have the opposite sign.
    DeviationSign,
    /// The correction of a bar's calibration has the opposite sign.
    BarCalibrationSign,
    /// A ball, a bar or another thing of the set-up is not where, or not as long as, it is stated.
    WrongSetup,
    /// A ball or a bar was moved or mounted anew before a test, for all later tests of its mount.
    SetupMoved,
    /// The readings of a test were taken with another set-up or in another session.
    OtherSession,
    /// A column has another unit.
    ColumnUnit,
    /// A column has the opposite sign.
    ColumnSign,
    /// Columns are exchanged, or hold poses or rotations by another convention.
    ColumnsExchanged,
    /// The machine comes from a table of Denavit–Hartenberg parameters that was read in the other convention.
    DhConvention,
}

/// A change of the session that removes the conflicts.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Suggestion {
    /// What may be wrong.
    pub kind: SuggestionKind,
    /// The axes, the test, the column or the thing of the set-up.
    pub subject: String,
    /// Residual over scalar readings with the change, µm; of poses that of the nominal machine.
    pub rms_um: f64,
    /// Description in words.
    #[serde(rename = "description")]
    pub words: String,
}
