//! The figures of deviations that are read at positions, approached in both directions (ISO 230-2:2014, 3 and 7), and how
//! an error of every reading moves them.
//!
//! At a position `i`, over the runs in one direction, `x̄ᵢ↑` and `sᵢ↑` are mean and standard deviation of the deviation
//! from the commanded position.
//!
//! ```text
//! Bᵢ = x̄ᵢ↑ − x̄ᵢ↓     Rᵢ↑ = 4sᵢ↑     Rᵢ = max(2sᵢ↑ + 2sᵢ↓ + |Bᵢ|; Rᵢ↑; Rᵢ↓)     M = max x̄ᵢ − min x̄ᵢ,  x̄ᵢ = (x̄ᵢ↑ + x̄ᵢ↓)/2
//! E = max(x̄ᵢ↑; x̄ᵢ↓) − min(x̄ᵢ↑; x̄ᵢ↓)     A = max(x̄ᵢ↑ + 2sᵢ↑; x̄ᵢ↓ + 2sᵢ↓) − min(x̄ᵢ↑ − 2sᵢ↑; x̄ᵢ↓ − 2sᵢ↓)
//! ```

use schemars::JsonSchema;
use serde::Serialize;

use super::uncertainty::OfReadings;
use crate::figure::{Definition, Figure, POSITIONING};

/// The deviations at one position.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Position {
    /// The commanded position, in `position_unit`.
    pub at: f64,
    /// In positive direction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forward: Option<Approach>,
    /// In negative direction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backward: Option<Approach>,
}

/// Deviations of repeated approaches in one direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Approach {
    /// Number of approaches.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation; absent with fewer than two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deviation: Option<f64>,
}

impl Approach {
    pub(super) fn of(values: &[f64]) -> Option<Approach> {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        let deviation = (values.len() > 1).then(|| (squares / (count - 1.0)).sqrt());
        (!values.is_empty()).then_some(Approach { count: values.len(), mean, deviation })
    }

    /// The mean plus so many standard deviations; `None` if those are needed and missing.
    fn with(self, deviations: f64) -> Option<Value> {
        let count = self.count as f64;
        let share = 1.0 / count;
        if deviations == 0.0 {
            return Some(Value::of(self.mean, share));
        }
        let value = self.mean + deviations * self.deviation?;
        Some(Value::of(value, share + deviations.powi(2) / (count - 1.0)))
    }

    /// So many standard deviations.
    fn spread(self, deviations: f64) -> Option<Value> {
        let share = deviations.powi(2) / (self.count as f64 - 1.0);
        Some(Value::of(deviations * self.deviation?, share))
    }
}

/// A figure, and its variance per variance of an independent error of every reading.
///
/// To first order such an error moves a mean of `n` readings with the variance `1/n`, and their standard deviation, which is
/// that of the machine, with `1/(n − 1)`; the two are not correlated.
#[derive(Clone, Copy, Debug)]
struct Value {
    value: f64,
    share: f64,
    /// Whether it is the difference of values of two positions.
    compares_positions: bool,
}

impl Value {
    /// Of one position.
    fn of(value: f64, share: f64) -> Value {
        Value { value, share, compares_positions: false }
    }

    fn plus(self, other: Value) -> Value {
        Value { value: self.value + other.value, share: self.share + other.share, ..self }
    }

    fn minus(self, other: Value) -> Value {
        self.plus(other.times(-1.0))
    }

    fn times(self, factor: f64) -> Value {
        Value { value: factor * self.value, share: factor * factor * self.share, ..self }
    }

    fn largest(self, other: Value) -> Value {
        if other.value > self.value { other } else { self }
    }

    fn smallest(self, other: Value) -> Value {
        if other.value < self.value { other } else { self }
    }
}

impl Position {
    fn reversal(&self) -> Option<Value> {
        Some(self.forward?.with(0.0)?.minus(self.backward?.with(0.0)?))
    }

    fn mean(&self) -> Option<Value> {
        Some(self.forward?.with(0.0)?.plus(self.backward?.with(0.0)?).times(0.5))
    }

    fn repeatability(&self) -> Option<Value> {
        let (forward, backward) = (self.forward?, self.backward?);
        let reversal = self.reversal()?;
        let reversal = reversal.times(if reversal.value < 0.0 { -1.0 } else { 1.0 });
        let both = forward.spread(2.0)?.plus(backward.spread(2.0)?).plus(reversal);
        Some(both.largest(forward.spread(4.0)?).largest(backward.spread(4.0)?))
    }
}

/// The figures of deviations at positions, with their standard uncertainties if the test states contributors.
pub(super) fn figures(positions: &[Position], unit: &str, u: Option<OfReadings>) -> Vec<Figure> {
    type Of<'f> = &'f dyn Fn(&Position) -> Option<Value>;
    // A figure of an axis exists if every position has the values that it combines.
    let all = |of: Of<'_>| positions.iter().map(of).collect::<Option<Vec<Value>>>().filter(|all| !all.is_empty());
    let greatest = |of: Of<'_>| all(of)?.into_iter().reduce(Value::largest);
    let least = |of: Of<'_>| all(of)?.into_iter().reduce(Value::smallest);
    let range =
        |high: Of<'_>, low: Of<'_>| Some(Value { compares_positions: true, ..greatest(high)?.minus(least(low)?) });
    let forward = |deviations: f64| move |p: &Position| p.forward?.with(deviations);
    let backward = |deviations: f64| move |p: &Position| p.backward?.with(deviations);
    let larger =
        |deviations: f64| move |p: &Position| Some(p.forward?.with(deviations)?.largest(p.backward?.with(deviations)?));
    let smaller = |deviations: f64| {
        move |p: &Position| Some(p.forward?.with(deviations)?.smallest(p.backward?.with(deviations)?))
    };
    let size = |p: &Position| p.reversal().map(|reversal| reversal.times(reversal.value.signum()));
    let mean_reversal = all(&Position::reversal).and_then(|all| {
        let share = 1.0 / all.len() as f64;
        Some(all.into_iter().reduce(|sum, one| sum.plus(one))?.times(share))
    });
    // In the order of the table.
    let found: [Option<Value>; POSITIONING.len()] = [
        range(&larger(2.0), &smaller(-2.0)),
        range(&forward(2.0), &forward(-2.0)),
        range(&backward(2.0), &backward(-2.0)),
        greatest(&Position::repeatability),
        greatest(&|p| p.forward?.spread(4.0)),
        greatest(&|p| p.backward?.spread(4.0)),
        range(&larger(0.0), &smaller(0.0)),
        range(&forward(0.0), &forward(0.0)),
        range(&backward(0.0), &backward(0.0)),
        range(&Position::mean, &Position::mean),
        greatest(&size),
        mean_reversal,
    ];
    let figure = |(definition, found): (&'static Definition, Option<Value>)| {
        let Value { value, share, compares_positions } = found?;
        let u = u.map(|of| of.u(share, compares_positions));
        Some(Figure { u, ..definition.with_value(value, unit) })
    };
    POSITIONING.iter().zip(found).filter_map(figure).collect()
}
