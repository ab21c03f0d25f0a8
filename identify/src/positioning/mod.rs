//! Figures of ISO 230-2:2014 of tests in which one axis moves and a laser or a sensor of angles reads it, and of ISO 230-6
//! of tests along diagonals ([`diagonal`]). They describe the readings: fitted errors are not subtracted.

pub mod diagonal;
mod figures;
mod uncertainty;

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::rotation_error::Body;
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use schemars::JsonSchema;
use serde::Serialize;

pub use self::figures::{Approach, Position};
pub use self::uncertainty::{COVERAGE, Contributions};
use crate::figure::Figure;
use crate::numerics::range;

/// Positions that agree to this are one, mm or rad.
const SAME: f64 = 1e-4;

/// Figures of the positioning of an axis (ISO 230-2).
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PositioningTest {
    /// The test.
    pub test: String,
    /// The axis.
    pub axis: String,
    /// The deviations.
    #[serde(flatten)]
    pub read: Deviations,
}

/// What has been read at positions along an axis or a diagonal.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Deviations {
    /// The unit of deviations: `um` or `arcsec`.
    pub unit: String,
    /// The unit of positions: `mm` or `deg`.
    pub position_unit: String,
    /// The positions, ascending; along a diagonal from its start.
    pub positions: Vec<Position>,
    /// The figures as ISO 230-2 defines them; ISO 230-6 applies them to diagonals. With standard uncertainties if the test
    /// states contributors.
    pub figures: Vec<Figure>,
    /// The contributors to these uncertainties.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<Contributions>,
}

impl Deviations {
    /// Of positions along a length in mm, or of an axis of rotation.
    fn of(
        test: &Test,
        unit: String,
        position_unit: &str,
        positions: Vec<Position>,
        length_mm: Option<f64>,
    ) -> Deviations {
        let (uncertainty, u) = test.contributors.map(|of| uncertainty::contributions(&of, length_mm)).unzip();
        let figures = figures::figures(&positions, &unit, u);
        Deviations { unit, position_unit: position_unit.to_string(), positions, figures, uncertainty }
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
    let is_rotary = machine.axes[axis].kind == AxisKind::Rotary;
    if cosine.abs() < 1.0 - 1e-6 || channel.is_angle() != is_rotary {
        return None;
    }
    let unit = channel.unit.displayed();
    let kind = machine.axes[axis].kind;
    let factor = sign * cosine.signum() * unit.per_internal();
    let mut nominal = readings.nominal(machine, &station);
    let nominal: Vec<f64> = (0..readings.rows()).map(|row| nominal(row).channels()[0]).collect();
    let deviation = |row: usize, values: &[f64]| (values[0] - nominal[row]) * factor;
    let places = along_axis(readings, axis, kind);
    let positions = approaches(readings, left_out, 0, &places, |at| kind.to_display(at), deviation);
    // A sweep whose positions do not return is no test of positioning.
    let repeated = |approach: Option<Approach>| approach.is_some_and(|one| one.count > 1);
    if !positions.iter().any(|position| repeated(position.forward) || repeated(position.backward)) {
        return None;
    }
    let length_mm = (!is_rotary).then(|| range(&readings.positions[axis]));
    Some(PositioningTest {
        test: test.name.clone(),
        axis: machine.axes[axis].name.clone(),
        read: Deviations::of(test, unit.name().to_string(), kind.unit().name(), positions, length_mm),
    })
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

/// Where a row is along the way of a test, and whether it was approached backwards.
pub(crate) type Place = (f64, bool);

/// The places of the rows along the way of one axis.
pub(crate) fn along_axis(readings: &Readings, axis: usize, kind: AxisKind) -> Vec<Place> {
    let directions: Vec<f64> = readings.axis_samples(axis, kind).iter().map(|sample| sample.direction).collect();
    places(&readings.positions[axis], &directions)
}

/// Positions with the direction of the approach. At rest where the way has turned, the next movement tells it.
fn places(positions: &[f64], directions: &[f64]) -> Vec<Place> {
    let place = |row: usize| {
        let stands = row > 0 && (positions[row] - positions[row - 1]).abs() <= SAME;
        let next = directions.get(row + 1).filter(|_| stands);
        (positions[row], *next.unwrap_or(&directions[row]) < 0.0)
    };
    (0..positions.len()).map(place).collect()
}

/// The values that a channel reads at each place, ascending, by the direction of the approach. `value` is that of a row,
/// from the observed values; `shown` converts a place to its display unit.
pub(crate) fn approaches(
    readings: &Readings,
    left_out: &[bool],
    channel: usize,
    places: &[Place],
    shown: impl Fn(f64) -> f64,
    value: impl Fn(usize, &[f64]) -> f64,
) -> Vec<Position> {
    let mut found: Vec<(f64, bool, f64)> = Vec::new();
    for row in (0..readings.rows()).filter(|row| !left_out[*row] && readings.was_read(*row, channel)) {
        let observed = &readings.observed[row * readings.channels..(row + 1) * readings.channels];
        let (at, is_backward) = places[row];
        found.push((at, is_backward, value(row, observed)));
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let position = |here: &[(f64, bool, f64)]| {
        let towards = |backward: bool| {
            let own = here.iter().filter(|one| one.1 == backward);
            Approach::of(&own.map(|one| one.2).collect::<Vec<_>>())
        };
        Position { at: shown(here[0].0), forward: towards(false), backward: towards(true) }
    };
    found.chunk_by(|a, b| b.0 - a.0 <= SAME).map(position).collect()
}
