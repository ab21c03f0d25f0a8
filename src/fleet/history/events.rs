//! Steps of several parameters of a machine at one time, and what they are by their direction.

use faer::Mat;
use schemars::JsonSchema;
use serde::Serialize;

use super::sessions::Machine;
use crate::fleet::compensations::Compensation;
use abbe_identify::numerics::symmetric::Symmetric;
use abbe_identify::numerics::tails::chi_square_tail;
use abbe_identify::results::ParameterChange;

/// A remainder of a change that is less probable than this is a change of its own.
const SIGNIFICANCE: f64 = 0.001;
/// Least cosine between a change and its explanation.
const DIRECTION: f64 = 0.9;
/// Smallest eigenvalue of a correlation matrix that counts. Below it, parameters are fully correlated.
const LEAST_EIGENVALUE: f64 = 1e-9;

/// What a change is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// It is that of the known compensation of this time.
    Compensation,
    /// It is that of the known compensation, and a further change beside it.
    CompensationAndShift,
    /// No compensation of this time is known. The change takes the errors to zero: a compensation or an adjustment.
    Correction,
    /// Any other change: a collision, a repair, a new foundation.
    Shift,
}

/// A change of a machine between two sessions.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ChangeEvent {
    /// Day of the last session before the change, since 1970-01-01.
    pub after_days: f64,
    /// Day of the first session after it.
    pub before_days: f64,
    /// What it is.
    pub kind: Kind,
    /// Cosine between the change and the known compensation, or the way to zero, in the metric of the inverse
    /// covariance.
    pub direction_cosine: f64,
    /// χ² of the change of all parameters.
    pub chi_square: f64,
    /// χ² of what the known compensation does not explain; `null` without one.
    pub remainder_chi_square: Option<f64>,
    /// Number of parameters.
    pub degrees_of_freedom: usize,
    /// The parameters whose own series have the step.
    pub parameters: Vec<String>,
    /// The change of every parameter.
    pub changes: Vec<ParameterChange>,
}

/// The change of all parameters of a machine.
pub(super) struct Change {
    pub after_days: f64,
    pub before_days: f64,
    /// First and last time at which it can have happened: steps of its parameters may be a session apart.
    pub possible_days: [f64; 2],
    /// The parameters by their positions in the machine.
    pub parameters: Vec<usize>,
    pub values: Vec<f64>,
    pub covariance: Mat<f64>,
    /// The values just before the change.
    pub before: Vec<f64>,
    /// The parameters whose own series have a step.
    pub found: Vec<usize>,
}

/// A root of the inverse of a covariance, by its correlation and its standard uncertainties.
pub(super) fn inverse_root(correlation: &Mat<f64>, u: &[f64]) -> Option<Mat<f64>> {
    let eigen = Symmetric::of(correlation.as_ref()).ok()?;
    let largest = eigen.values.iter().copied().fold(0.0, f64::max);
    let root = |k: usize| eigen.values[k].max(LEAST_EIGENVALUE * largest).sqrt();
    Some(Mat::from_fn(u.len(), u.len(), |k, j| eigen.vectors[(j, k)] / (root(k) * u[j])))
}

/// The metric of the inverse covariance.
struct Metric {
    /// A root of the inverse covariance.
    root: Mat<f64>,
}

impl Metric {
    fn of(covariance: &Mat<f64>) -> Option<Metric> {
        let count = covariance.nrows();
        let u: Vec<f64> = (0..count).map(|k| covariance[(k, k)].sqrt()).collect();
        if u.iter().any(|u| u.is_nan() || *u <= 0.0) {
            return None;
        }
        let correlation = Mat::from_fn(count, count, |i, j| covariance[(i, j)] / (u[i] * u[j]));
        Some(Metric { root: inverse_root(&correlation, &u)? })
    }

    fn product(&self, a: &[f64], b: &[f64]) -> f64 {
        let along = |v: &[f64], k: usize| (0..v.len()).map(|j| self.root[(k, j)] * v[j]).sum::<f64>();
        (0..a.len()).map(|k| along(a, k) * along(b, k)).sum()
    }

    fn cosine(&self, a: &[f64], b: &[f64]) -> f64 {
        let norms = self.product(a, a) * self.product(b, b);
        if norms > 0.0 { self.product(a, b) / norms.sqrt() } else { 0.0 }
    }
}

impl Change {
    /// The change with what it is.
    pub fn event(&self, machine: &Machine, compensations: &[Compensation]) -> ChangeEvent {
        let count = self.values.len();
        let metric = Metric::of(&self.covariance)
            .unwrap_or_else(|| Metric { root: Mat::from_fn(count, count, |i, j| f64::from(u8::from(i == j))) });
        let [names, units]: [Vec<&str>; 2] =
            [0, 1].map(|k| self.parameters.iter().map(|parameter| machine.named(*parameter)[k]).collect());
        let known: Vec<&Compensation> = compensations
            .iter()
            .filter(|known| known.machine_id == machine.id() && names.contains(&known.id.as_str()))
            .filter(|known| known.days[0] <= self.possible_days[1] && known.days[1] >= self.possible_days[0])
            .collect();
        let chi_square = metric.product(&self.values, &self.values);
        let significant = |chi_square: f64| chi_square_tail(chi_square, count as f64) < SIGNIFICANCE;
        let (kind, direction_cosine, remainder) = if known.is_empty() {
            let to_zero: Vec<f64> = self.before.iter().map(|value| -value).collect();
            let cosine = metric.cosine(&self.values, &to_zero);
            (if cosine >= DIRECTION { Kind::Correction } else { Kind::Shift }, cosine, None)
        } else {
            let change = |id: &str| known.iter().filter(|known| known.id == id).map(|known| known.value).sum();
            let expected: Vec<f64> = names.iter().map(|id| change(id)).collect();
            let rest: Vec<f64> = self.values.iter().zip(&expected).map(|(found, known)| found - known).collect();
            let remainder = metric.product(&rest, &rest);
            let cosine = metric.cosine(&self.values, &expected);
            let kind = match (significant(remainder), remainder < chi_square) {
                (false, true) if cosine >= DIRECTION => Kind::Compensation,
                (true, true) if cosine > 0.0 => Kind::CompensationAndShift,
                _ => Kind::Shift,
            };
            (kind, cosine, Some(remainder))
        };
        ChangeEvent {
            after_days: self.after_days,
            before_days: self.before_days,
            kind,
            direction_cosine,
            chi_square,
            remainder_chi_square: remainder,
            degrees_of_freedom: count,
            parameters: self.found.iter().map(|parameter| machine.named(*parameter)[0].to_string()).collect(),
            changes: (0..count)
                .map(|k| ParameterChange {
                    id: names[k].to_string(),
                    value: self.values[k],
                    u: self.covariance[(k, k)].max(0.0).sqrt(),
                    unit: units[k].to_string(),
                })
                .collect(),
        }
    }
}
