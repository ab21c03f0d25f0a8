//! Figures of ISO 230-2:2014 of tests in which one axis moves and a laser or a sensor of angles reads it.
//!
//! At a position `i`, over the runs in one direction, `x̄ᵢ↑` and `sᵢ↑` are mean and standard deviation of the deviation
//! from the commanded position. The figures describe the readings: fitted errors are not subtracted.
//!
//! ```text
//! Bᵢ = x̄ᵢ↑ − x̄ᵢ↓     Rᵢ↑ = 4sᵢ↑     Rᵢ = max(2sᵢ↑ + 2sᵢ↓ + |Bᵢ|; Rᵢ↑; Rᵢ↓)     M = max x̄ᵢ − min x̄ᵢ,  x̄ᵢ = (x̄ᵢ↑ + x̄ᵢ↓)/2
//! E = max(x̄ᵢ↑; x̄ᵢ↓) − min(x̄ᵢ↑; x̄ᵢ↓)     A = max(x̄ᵢ↑ + 2sᵢ↑; x̄ᵢ↓ + 2sᵢ↓) − min(x̄ᵢ↑ − 2sᵢ↑; x̄ᵢ↓ − 2sᵢ↓)
//! ```

use abbe_model::chain::Machine;
use abbe_model::rotation_error::Body;
use abbe_model::session::{Session, Test};
use schemars::JsonSchema;
use serde::Serialize;

use crate::unit::Unit;

/// Positions that agree to this are one, mm or rad.
const SAME: f64 = 1e-4;

/// Figures of the positioning of an axis (ISO 230-2).
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PositioningTest {
    /// The test.
    pub test: String,
    /// The axis.
    pub axis: String,
    /// The unit of all figures: `um` or `arcsec`.
    pub unit: String,
    /// The unit of positions: `mm` or `deg`.
    pub position_unit: String,
    /// The positions, ascending.
    pub positions: Vec<Position>,
    /// Unidirectional accuracy A↑, from the runs in positive direction; absent with fewer than two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy_forward: Option<f64>,
    /// Unidirectional accuracy A↓.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy_backward: Option<f64>,
    /// Bidirectional accuracy A.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<f64>,
    /// Unidirectional repeatability R↑.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeatability_forward: Option<f64>,
    /// Unidirectional repeatability R↓.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeatability_backward: Option<f64>,
    /// Bidirectional repeatability R.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeatability: Option<f64>,
    /// Unidirectional systematic deviation E↑.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub systematic_forward: Option<f64>,
    /// Unidirectional systematic deviation E↓.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub systematic_backward: Option<f64>,
    /// Bidirectional systematic deviation E.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub systematic: Option<f64>,
    /// Range of the mean bidirectional deviation M.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_range: Option<f64>,
    /// Reversal value B: the largest |Bᵢ|.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reversal: Option<f64>,
    /// Mean reversal value B̄.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_reversal: Option<f64>,
}

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
    fn of(values: &[f64]) -> Option<Approach> {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        let deviation = (values.len() > 1).then(|| (squares / (count - 1.0)).sqrt());
        (!values.is_empty()).then_some(Approach { count: values.len(), mean, deviation })
    }

    /// The mean plus so many standard deviations; `None` without a standard deviation.
    fn with(self, deviations: f64) -> Option<f64> {
        Some(self.mean + deviations * self.deviation?)
    }
}

impl Position {
    fn reversal(&self) -> Option<f64> {
        Some(self.forward?.mean - self.backward?.mean)
    }

    fn repeatability(&self) -> Option<f64> {
        let (forward, backward) = (self.forward?.deviation?, self.backward?.deviation?);
        let both = 2.0 * forward + 2.0 * backward + self.reversal()?.abs();
        Some(both.max(4.0 * forward).max(4.0 * backward))
    }
}

/// The figures of every test with readings in which one axis moves and whose first channel is read along or about it.
pub fn of_session(session: &Session, left_out: &[Vec<bool>]) -> Vec<PositioningTest> {
    let measured = session.tests.iter().filter(|test| test.readings.is_some());
    measured.zip(left_out).filter_map(|(test, left_out)| of_test(session, test, left_out)).collect()
}

fn of_test(session: &Session, test: &Test, left_out: &[bool]) -> Option<PositioningTest> {
    let machine = &session.machine;
    let readings = test.readings.as_ref()?;
    let axis = moved_axis(machine, test)?;
    let (direction, body) = test.station.positioning()?;
    let station = test.station.with_datum(machine, readings).unwrap_or_else(|| test.station.clone());
    let of_table = axis < machine.workpiece_side;
    // What is read against the table falls where an axis that carries the table rises.
    let sign = match body {
        Body::Relative => {
            if of_table {
                -1.0
            } else {
                1.0
            }
        }
        Body::Tool if !of_table => 1.0,
        Body::Table if of_table => 1.0,
        Body::Tool | Body::Table => return None,
    };
    // Along the axis, or about it.
    let cosine: f64 = direction.iter().zip(machine.axes[axis].direction).map(|(a, b)| a * b).sum();
    let channel = test.station.channels().first()?;
    let is_rotary = machine.axes[axis].kind == abbe_model::axis::AxisKind::Rotary;
    if cosine.abs() < 1.0 - 1e-6 || channel.is_angle() != is_rotary {
        return None;
    }
    let unit = Unit::of(channel.unit);
    let kind = machine.axes[axis].kind;
    let factor = sign * cosine.signum() * unit.display_per_internal;
    let deviation =
        |row: usize, values: &[f64]| (values[0] - readings.nominal(machine, &station, row).channels()[0]) * factor;
    let positions = approaches(machine, test, left_out, (axis, 0), deviation)?;
    // A sweep whose positions do not return is no test of positioning.
    let repeated = |approach: Option<Approach>| approach.is_some_and(|one| one.count > 1);
    if !positions.iter().any(|position| repeated(position.forward) || repeated(position.backward)) {
        return None;
    }
    Some(figures(test.name.clone(), machine.axes[axis].name.clone(), [unit.name, kind.unit().to_string()], positions))
}

/// The only axis that moves in a test.
pub(crate) fn moved_axis(machine: &Machine, test: &Test) -> Option<usize> {
    let readings = test.readings.as_ref()?;
    let moves = |axis: &usize| {
        let column = &readings.positions[*axis];
        column.iter().any(|position| (position - column[0]).abs() > SAME)
    };
    let mut moved = (0..machine.axes.len()).filter(moves);
    let axis = moved.next()?;
    moved.next().is_none().then_some(axis)
}

/// The values that a channel reads at each position of an axis, ascending, by the direction of the approach. `value` is
/// that of a row, from the observed values.
pub(crate) fn approaches(
    machine: &Machine,
    test: &Test,
    left_out: &[bool],
    (axis, channel): (usize, usize),
    value: impl Fn(usize, &[f64]) -> f64,
) -> Option<Vec<Position>> {
    let readings = test.readings.as_ref()?;
    let kind = machine.axes[axis].kind;
    let mut found: Vec<(f64, bool, f64)> = Vec::new();
    let samples = readings.axis_samples(axis, kind);
    for row in (0..readings.rows()).filter(|row| !left_out[*row] && readings.was_read(*row, channel)) {
        let observed = &readings.observed[row * readings.channels..(row + 1) * readings.channels];
        // At rest where the axis has turned, the next movement tells the direction of the approach to come.
        let at = readings.positions[axis][row];
        let stands = row > 0 && (at - readings.positions[axis][row - 1]).abs() <= SAME;
        let next = samples.get(row + 1).filter(|_| stands);
        found.push((at, next.unwrap_or(&samples[row]).direction < 0.0, value(row, observed)));
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let position = |here: &[(f64, bool, f64)]| {
        let towards = |backward: bool| {
            let own = here.iter().filter(|one| one.1 == backward);
            Approach::of(&own.map(|one| one.2).collect::<Vec<_>>())
        };
        Position { at: kind.to_display(here[0].0), forward: towards(false), backward: towards(true) }
    };
    Some(found.chunk_by(|a, b| b.0 - a.0 <= SAME).map(position).collect())
}

/// The figures of deviations at positions.
fn figures(
    test: String,
    axis: String,
    [unit, position_unit]: [String; 2],
    positions: Vec<Position>,
) -> PositioningTest {
    type Of<'f> = &'f dyn Fn(&Position) -> Option<f64>;
    // A figure of an axis exists if every position has the values that it combines.
    let all = |of: Of<'_>| positions.iter().map(of).collect::<Option<Vec<f64>>>().filter(|all| !all.is_empty());
    let greatest = |of: Of<'_>| Some(all(of)?.into_iter().fold(f64::NEG_INFINITY, f64::max));
    let least = |of: Of<'_>| Some(all(of)?.into_iter().fold(f64::INFINITY, f64::min));
    let range = |high: Of<'_>, low: Of<'_>| Some(greatest(high)? - least(low)?);
    let mean_forward: Of<'_> = &|position| Some(position.forward?.mean);
    let mean_backward: Of<'_> = &|position| Some(position.backward?.mean);
    let mean: Of<'_> = &|position| Some((position.forward?.mean + position.backward?.mean) / 2.0);
    let of_two = |one: f64, other: f64, pick: fn(f64, f64) -> f64| pick(one, other);
    PositioningTest {
        accuracy_forward: range(&|p| p.forward?.with(2.0), &|p| p.forward?.with(-2.0)),
        accuracy_backward: range(&|p| p.backward?.with(2.0), &|p| p.backward?.with(-2.0)),
        accuracy: range(&|p| Some(of_two(p.forward?.with(2.0)?, p.backward?.with(2.0)?, f64::max)), &|p| {
            Some(of_two(p.forward?.with(-2.0)?, p.backward?.with(-2.0)?, f64::min))
        }),
        repeatability_forward: greatest(&|p| Some(4.0 * p.forward?.deviation?)),
        repeatability_backward: greatest(&|p| Some(4.0 * p.backward?.deviation?)),
        repeatability: greatest(&Position::repeatability),
        systematic_forward: range(mean_forward, mean_forward),
        systematic_backward: range(mean_backward, mean_backward),
        systematic: range(&|p| Some(of_two(p.forward?.mean, p.backward?.mean, f64::max)), &|p| {
            Some(of_two(p.forward?.mean, p.backward?.mean, f64::min))
        }),
        mean_range: range(mean, mean),
        reversal: greatest(&|p| Some(p.reversal()?.abs())),
        mean_reversal: all(&Position::reversal).map(|all| all.iter().sum::<f64>() / all.len() as f64),
        test,
        axis,
        unit,
        position_unit,
        positions,
    }
}
