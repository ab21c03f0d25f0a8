//! What a history reports, as JSON has it. Days count from 1970-01-01 UTC.

use schemars::JsonSchema;
use serde::Serialize;

use abbe_identify::results::MeasuredValue;
use abbe_trace::validate::ValidationVerdict;

use super::DAYS_PER_YEAR;
use super::events::ChangeEvent;

/// Whether a next check is due, by the drift and its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Due {
    /// On a date within ten years.
    Date,
    /// More than ten years ahead.
    BeyondTenYears,
    /// There are too few sessions or dates to bound a drift.
    NotDetermined,
}

/// A machine over time.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MachineHistory {
    /// Identifier of the machine.
    pub machine_id: String,
    /// Its name.
    pub name: String,
    /// Its structural code.
    pub code: String,
    /// Number of sessions.
    pub sessions: usize,
    /// Day of the first session.
    pub first_days: f64,
    /// Day of the last session.
    pub last_days: f64,
    /// Changes between sessions, over all parameters.
    pub changes: Vec<ChangeEvent>,
    /// Whether a next check is due, by the parameters of the latest session.
    pub due: Due,
    /// Day on which the next check is due; `null` without a date.
    pub due_days: Option<f64>,
    /// The parameter that determines it.
    pub due_parameter: Option<String>,
    /// The parameters that are out of control in their latest session.
    pub out_of_control: Vec<String>,
    /// Number of parameters that are followed of the latest session.
    pub followed: usize,
    /// Number of directions of the parameters that it determines.
    pub determined: usize,
    /// The parameters that are held at nominal, so that the others have values.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub held_at_nominal: Vec<String>,
    /// The verdict of the validation of the latest session, if its model does not hold.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation: Option<ValidationVerdict>,
    /// The parameters.
    pub parameters: Vec<ParameterHistory>,
}

impl MachineHistory {
    /// The amount of a change of a parameter whose own series has the step: that of the series if no other step follows, else
    /// that of the change of all parameters.
    pub fn amount(&self, change: &ChangeEvent, id: &str) -> Option<MeasuredValue> {
        let of_series = self.changes.iter().rfind(|one| one.parameters.iter().any(|own| own == id)) == Some(change);
        let step = self.parameters.iter().find(|one| of_series && one.id == id).and_then(|one| one.steps.last());
        let of_all = change.changes.iter().find(|own| own.id == id);
        step.map(|step| step.change).or(of_all.map(|own| MeasuredValue { value: own.value, u: own.u }))
    }
}

/// A parameter of a machine over time.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ParameterHistory {
    /// Identifier.
    pub id: String,
    /// Unit of all values.
    pub unit: String,
    /// What the parameter is, in words.
    pub meaning: String,
    /// The sessions that identify it.
    pub points: Vec<PointResult>,
    /// Probability of a drift, a step or a pair of steps as significant as the most significant one if there is none.
    /// All positions are counted.
    pub p_value: f64,
    /// Scatter of the sessions about the model (level, drift and steps) over that which the uncertainties predict.
    pub scatter_ratio: f64,
    /// Factor by which `u` is enlarged, at least 1: `scatter_ratio`, pooled over the machine's other parameters and
    /// other machines.
    #[serde(rename = "u_enlargement")]
    pub enlargement: f64,
    /// Level: at the mean date of a series with drift, before the first step; `null` if the model is not separable.
    pub level: Option<MeasuredValue>,
    /// Drift per year; `null` without a significant one.
    pub drift_per_year: Option<MeasuredValue>,
    /// Significant steps.
    pub steps: Vec<ChangeResult>,
    /// Reference of the control charts: the weighted mean of the first sessions after the last step.
    pub reference: f64,
    /// Whether a next check is due by this parameter.
    pub due: Due,
    /// Day on which it is due; `null` without a date.
    pub due_days: Option<f64>,
}

impl ParameterHistory {
    /// Level, drift and steps at each session: days and value. In front of a session with a step stands the value without
    /// it.
    pub fn modelled(&self) -> Vec<(f64, f64)> {
        let middle = self.points.iter().map(|point| point.days).sum::<f64>() / self.points.len().max(1) as f64;
        let level = self.level.map_or(0.0, |level| level.value);
        let drift = self.drift_per_year.map_or(0.0, |drift| drift.value);
        let value = |days: f64| {
            let steps = self.steps.iter().filter(|step| step.before_days <= days).map(|step| step.change.value);
            level + drift * (days - middle) / DAYS_PER_YEAR + steps.sum::<f64>()
        };
        let at = |point: &PointResult| {
            let step = self.steps.iter().find(|step| step.before_days == point.days);
            let before = step.map(|step| (point.days, value(point.days) - step.change.value));
            before.into_iter().chain([(point.days, value(point.days))])
        };
        self.points.iter().flat_map(at).collect()
    }

    /// Whether the latest session is out of control.
    pub fn is_out_of_control(&self) -> bool {
        self.points.last().is_some_and(|last| last.out_of_control)
    }
}

/// A session of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PointResult {
    /// Day of the session.
    pub days: f64,
    /// Estimate.
    pub value: f64,
    /// Standard uncertainty, with `u_enlargement`.
    pub u: f64,
    /// Deviation from the reference, standard deviations.
    pub shewhart: f64,
    /// Exponentially weighted moving average, standard deviations. 0 in sessions of the reference.
    pub ewma: f64,
    /// Whether one of the two is beyond its limit.
    pub out_of_control: bool,
}

/// A step of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ChangeResult {
    /// Day of the last session before the step.
    pub after_days: f64,
    /// Day of the first session after it.
    pub before_days: f64,
    /// The change.
    #[serde(flatten)]
    pub change: MeasuredValue,
    /// Probability of such a change at this position if there is none.
    pub p_value: f64,
}
