//! The three statements with which every output opens: is the result good, what to correct, what to measure next.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;

use super::outcome::{Goodness, TraceVerdict};
use super::parameter::{DeterminedBy, Estimate};
use crate::tolerance::rule::Decision;

/// A component of an axis line or a direction, or the zero of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LineQuantity {
    /// A coordinate of a point on a rotary axis, mm.
    Point,
    /// A component of the unit vector of an axis.
    Direction,
    /// The position of the axis where its command is zero: degrees of a rotary axis, mm of a linear one.
    Zero,
}

impl fmt::Display for LineQuantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            LineQuantity::Point => "point",
            LineQuantity::Direction => "direction",
            LineQuantity::Zero => "zero",
        })
    }
}

/// A component of the line of an axis in R with all axes at zero, or its zero: nominal, identified, and the change.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct AxisCorrection {
    /// The axis.
    pub axis: String,
    /// Whether it is of a point on the axis, of its direction, or its zero.
    pub quantity: LineQuantity,
    /// The coordinate in R: `X`, `Y`, `Z`; of a zero the direction of R nearest to the axis.
    pub coordinate: char,
    /// Nominal value: mm of a point, 1 of a direction, degrees or mm of a zero.
    pub nominal: f64,
    /// Identified value, in the unit of `nominal`.
    pub identified: f64,
    /// Identified less nominal, in `unit`.
    pub change: f64,
    /// Standard uncertainty of the change, in `unit`.
    pub u: f64,
    /// `um` of a point and the zero of a linear axis, `um/m` of a direction, `arcsec` of the zero of a rotary axis.
    pub unit: String,
    /// What determines the change.
    pub determined_by: DeterminedBy,
    /// Whether the change may be quoted.
    pub quotable: bool,
}

impl AxisCorrection {
    /// Whether the change exceeds its expanded uncertainty `2 u`.
    pub fn exceeds_u(&self) -> bool {
        self.u > 0.0 && self.change.abs() > 2.0 * self.u
    }
}

/// What to do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NextStep {
    /// Correct the session: the readings contradict it.
    CorrectSession,
    /// Check the unit of the readings, which is in doubt.
    CheckUnit,
    /// Search for the effect that the model lacks.
    Trace,
    /// Measure the test that separates an effect from its aliases.
    SeparatingTest,
    /// Measure the test that makes confounded parameters identifiable.
    Identify,
    /// Measure the test that most lowers the largest uncertainty.
    Improve,
    /// State the noise, or repeat a run.
    StateNoise,
    /// Identify the machine anew: a model does not hold.
    Refit,
    /// Measure and identify where the readings leave the range of a model.
    WidenRange,
    /// Measure the session once more, to tell a change of the machine from one of the set-up.
    Repeat,
    /// Measure at the date of the next check.
    NextCheck,
    /// Nothing: all that the instrument can determine of the machine is determined.
    AllDetermined,
    /// Nothing: no candidate test is known for the instrument.
    Nothing,
    /// Nothing: no candidate test makes a confounded parameter identifiable.
    NoneHelps,
}

/// Whether the result is good.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct GoodStatement {
    /// The verdict of a trace; absent for a fit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verdict: Option<TraceVerdict>,
    /// The residual against the noise.
    pub goodness: Goodness,
    /// The decision by the limits of the session; absent without limits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decision: Option<Decision>,
    /// The limits that fail, by identifier.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failed: Vec<String>,
    /// The limits that are undecided, by identifier.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub undecided: Vec<String>,
}

/// What to measure next.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MeasureStatement {
    /// The step.
    pub step: NextStep,
    /// Name of the test in the session that the command writes; absent if no test is proposed yet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub test: Option<String>,
    /// The test in words; of `all-determined` the rank, of `check-unit` the likely unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// The effect that it separates from its aliases.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effect: Option<String>,
}

impl From<NextStep> for MeasureStatement {
    fn from(step: NextStep) -> MeasureStatement {
        MeasureStatement { step, test: None, description: None, effect: None }
    }
}

/// The three statements of a result: of a fit and a trace, unless other types are named.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "{G}s")]
pub struct Statements<G = GoodStatement, C = AxisCorrection> {
    /// Is the result good.
    pub good: G,
    /// What to correct; of a plan what limits its worst error. Empty for a comparison and a validation.
    pub correct: Vec<C>,
    /// What has changed, which is no error that remains; of a history steps that are explained.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub changed: Vec<C>,
    /// What else exceeds its expanded uncertainty: effects, and errors that move no axis line.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub further: Vec<Estimate>,
    /// What to measure next.
    pub measure: MeasureStatement,
}
