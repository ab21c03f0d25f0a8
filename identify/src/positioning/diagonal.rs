//! Figures of ISO 230-6:2002 of tests in which two or three linear axes move along a diagonal and a laser reads along it.
//!
//! The deviation at a position is the read displacement less the nominal one, as in ISO 230-2 with the diagonal in place of
//! the axis. Axes may also move one after the other (step diagonal): the laser then reads the component along the diagonal
//! after every move, and positions are distances along it.

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::rotation_error::Body;
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Deviations, Place, SAME, approaches, places};
use crate::figure::{self, Figure};
use crate::numerics::range;

/// Least movement of an axis that moves, mm.
const MOVES: f64 = 1e-3;
/// Least cosine between the beam and the line from the first to the last position.
const ALONG: f64 = 0.9999;

/// The kind of a diagonal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum DiagonalKind {
    /// Of a plane of two axes.
    Face,
    /// Of a box of three axes.
    Body,
}

/// Figures of a diagonal (ISO 230-6).
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DiagonalTest {
    /// The test.
    pub test: String,
    /// Whether it is the diagonal of a box or of a face.
    pub kind: DiagonalKind,
    /// The axes that move, in the order of the machine X, Y, Z.
    pub axes: Vec<String>,
    /// Whether each of `axes` rises (P) or falls (N) along the diagonal: `PPP`, `NPP`, …
    pub direction: String,
    /// Whether the axes move one after the other (step diagonal).
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub in_turn: bool,
    /// The measured length, mm.
    pub length_mm: f64,
    /// The deviations.
    #[serde(flatten)]
    pub read: Deviations,
}

/// The largest figures of the diagonals of a kind: E, R, M and B of ISO 230-6.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LargestOfDiagonals {
    /// The kind of the diagonals.
    pub kind: DiagonalKind,
    /// Whether their axes move one after the other.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub in_turn: bool,
    /// Their tests.
    pub tests: Vec<String>,
    /// The largest of each figure that all of them have.
    pub figures: Vec<Figure>,
}

/// The figures of every test with readings along a diagonal.
pub fn of_session(session: &Session, left_out: &[Vec<bool>]) -> Vec<DiagonalTest> {
    let measured = session.tests.iter().filter(|test| test.readings.is_some());
    measured.zip(left_out).filter_map(|(test, left_out)| of_test(session, test, left_out)).collect()
}

/// The largest figures of the diagonals of each kind of which there are several.
pub fn largest(tests: &[DiagonalTest]) -> Vec<LargestOfDiagonals> {
    let mut kinds: Vec<(DiagonalKind, bool)> = Vec::new();
    for test in tests {
        if !kinds.contains(&(test.kind, test.in_turn)) {
            kinds.push((test.kind, test.in_turn));
        }
    }
    let of_kind = |(kind, in_turn): (DiagonalKind, bool)| {
        let own: Vec<&DiagonalTest> =
            tests.iter().filter(|test| (test.kind, test.in_turn) == (kind, in_turn)).collect();
        let greatest = |id: &&str| {
            let all = own.iter().map(|test| figure::find(&test.read.figures, id)).collect::<Option<Vec<_>>>()?;
            let most = all.iter().map(|found| found.value).fold(f64::NEG_INFINITY, f64::max);
            Some(all[0].definition.with_value(most, &all[0].unit))
        };
        (own.len() > 1).then(|| LargestOfDiagonals {
            kind,
            in_turn,
            tests: own.iter().map(|test| test.test.clone()).collect(),
            figures: figure::OF_DIAGONALS.iter().filter_map(greatest).collect(),
        })
    };
    kinds.into_iter().filter_map(of_kind).collect()
}

fn of_test(session: &Session, test: &Test, left_out: &[bool]) -> Option<DiagonalTest> {
    let machine = &session.machine;
    let readings = test.readings.as_ref()?;
    let (_, Body::Relative) = test.station.positioning()? else { return None };
    let channel = test.station.channels().first().filter(|channel| !channel.is_angle())?;
    let axes = moved(machine, readings)?;
    let station = test.station.with_datum(machine, readings).unwrap_or_else(|| test.station.clone());
    let mut nominal = readings.nominal(machine, &station);
    let nominal: Vec<f64> = (0..readings.rows()).map(|row| nominal(row).channels()[0]).collect();
    let way = Way::of(readings, &axes, &nominal)?;
    let unit = channel.unit.displayed();
    let factor = way.sign * unit.per_internal();
    let deviation = |row: usize, values: &[f64]| (values[0] - nominal[row]) * factor;
    let positions = approaches(readings, left_out, 0, &way.places, |at| at, deviation);
    let read =
        Deviations::of(test, unit.name().to_string(), AxisKind::Linear.unit().name(), positions, Some(way.length));
    let kind = if axes.len() == 2 { DiagonalKind::Face } else { DiagonalKind::Body };
    let has_figure =
        ["systematic_forward", "systematic_backward"].iter().any(|id| figure::find(&read.figures, id).is_some());
    has_figure.then(|| DiagonalTest {
        test: test.name.clone(),
        kind,
        axes: axes.iter().map(|axis| machine.axes[*axis].name.clone()).collect(),
        direction: way.rises.iter().map(|rises| if *rises { 'P' } else { 'N' }).collect(),
        in_turn: way.in_turn,
        length_mm: way.length,
        read,
    })
}

/// The axes that move, by name, if they are two or three linear ones.
fn moved(machine: &Machine, readings: &Readings) -> Option<Vec<usize>> {
    let moves = |axis: &usize| range(&readings.positions[*axis]) > MOVES;
    let mut axes: Vec<usize> = (0..machine.axes.len()).filter(moves).collect();
    axes.sort_by_key(|axis| machine.axes[*axis].name.clone());
    let all_linear = axes.iter().all(|axis| machine.axes[*axis].kind == AxisKind::Linear);
    (all_linear && (2..=3).contains(&axes.len())).then_some(axes)
}

/// The way along a diagonal.
struct Way {
    /// 1, or −1 if the displacement falls in the direction in which most axes rise.
    sign: f64,
    /// Whether each axis rises with the distance.
    rises: Vec<bool>,
    /// Whether the axes move one after the other.
    in_turn: bool,
    length: f64,
    places: Vec<Place>,
}

impl Way {
    /// `None` if the positions of the axes are not along a diagonal under the beam.
    fn of(readings: &Readings, axes: &[usize], nominal: &[f64]) -> Option<Way> {
        let columns: Vec<&[f64]> = axes.iter().map(|axis| readings.positions[*axis].as_slice()).collect();
        let mut order: Vec<usize> = (0..nominal.len()).collect();
        order.sort_by(|a, b| nominal[*a].total_cmp(&nominal[*b]));
        let (first, last) = (*order.first()?, *order.last()?);
        let mut rises: Vec<bool> = columns.iter().map(|column| column[last] > column[first]).collect();
        // Every axis goes one way, and a distance is one state.
        for pair in order.windows(2) {
            let [from, to] = [pair[0], pair[1]];
            let is_one = nominal[to] - nominal[from] <= SAME;
            for (column, rises) in columns.iter().zip(&rises) {
                let step = column[to] - column[from];
                if (is_one && step.abs() > 2.0 * SAME) || (step.abs() > SAME && (step > 0.0) != *rises) {
                    return None;
                }
            }
        }
        let travel: Vec<f64> = columns.iter().map(|column| column[last] - column[first]).collect();
        let square = travel.iter().map(|step| step * step).sum::<f64>();
        let (length, range) = (square.sqrt(), nominal[last] - nominal[first]);
        if range < ALONG * length {
            return None;
        }
        let leaves = |row: usize| {
            let share = (nominal[row] - nominal[first]) / range;
            let is_off = |(column, step): (&&[f64], &f64)| (column[row] - column[first] - share * step).abs() > 1.0;
            columns.iter().zip(&travel).any(is_off)
        };
        let in_turn = (0..nominal.len()).any(leaves);
        // In the order of the letters of the axes: PP and NP of a face.
        let up = rises.iter().filter(|rises| **rises).count();
        let reversed = 2 * up < rises.len() || (2 * up == rises.len() && !rises[rises.len() - 1]);
        let sign = if reversed { -1.0 } else { 1.0 };
        rises.iter_mut().for_each(|rises| *rises ^= reversed);
        let from = if reversed { nominal[last] } else { nominal[first] };
        let along: Vec<f64> = nominal.iter().map(|at| sign * (at - from)).collect();
        let places = places(&along, &directions(readings, &along));
        Some(Way { sign, rises, in_turn, length: range, places })
    }
}

/// The direction in which every row is approached in its run; the first row has that of the second.
fn directions(readings: &Readings, along: &[f64]) -> Vec<f64> {
    let mut directions = vec![0.0; along.len()];
    for run in readings.runs() {
        let step = |row: usize| along[row] - along[row - 1];
        let mut direction = (run.start + 1..run.end).map(step).find(|step| step.abs() > SAME).unwrap_or(1.0);
        for row in run.clone() {
            if row > run.start && step(row).abs() > SAME {
                direction = step(row);
            }
            directions[row] = direction.signum();
        }
    }
    directions
}
