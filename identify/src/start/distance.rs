//! Where a station stands that reads distances, and where its reflector is, by multilateration.
//!
//! With the reflector at `P_i` in the frame of the station, the station at `S₀ + δ` and the dead path `D₀`, the squares of the
//! distances are linear in `δ`, `D₀` and `k = ‖δ‖² − D₀²`:
//!
//! ```text
//! D_i² − ‖P_i − S₀‖² = −2 (P_i − S₀)·δ + 2 D_i·D₀ + k
//! ```
//!
//! The same holds for the reflector with the roles exchanged. Where both are unknown they are found in turn.

use abbe_model::chain::{BodyErrors, Machine};
use abbe_model::instrument::{InstrumentKind, SharedBy, Station};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Prior, Session, Test};
use nalgebra::{DMatrix, DVector, Vector3};

use super::{MAX_ROWS, is_unknown, set_point};
use crate::set_up_points::{point_mm, points};

/// The sides of the station and of the reflector among the points of a set-up.
const STATION: usize = 0;
const REFLECTOR: usize = 1;
/// The parameter of the dead path.
const ZERO: usize = 6;
/// Maximum number of turns, and the step at which they end, mm.
const MAX_ROUNDS: usize = 100;
const SETTLED_MM: f64 = 1e-6;
/// Singular values below this share of the largest leave their direction as it is stated.
const OPEN: f64 = 1e-9;

/// Moves stations and reflectors without a prior to where the nominal machine explains the distances best.
pub(super) fn locate(session: &Session, tests: &mut [Test]) {
    let is_open = |test: &Test, side: usize| {
        let first = points(&test.station)[side];
        test.station.kind() == InstrumentKind::Distance && first.is_some_and(|first| is_unknown(test, first))
    };
    if !tests.iter().any(|test| is_open(test, STATION) || is_open(test, REFLECTOR)) {
        return;
    }
    for _ in 0..MAX_ROUNDS {
        let mut largest = 0.0_f64;
        for (side, by) in [(STATION, SharedBy::Setup), (REFLECTOR, SharedBy::SpindleSetup)] {
            let mut groups: Vec<String> =
                tests.iter().filter(|test| is_open(test, side)).map(|test| test.group(by).into()).collect();
            groups.sort_unstable();
            groups.dedup();
            for group in groups {
                let members: Vec<usize> =
                    (0..tests.len()).filter(|k| is_open(&tests[*k], side) && tests[*k].group(by) == group).collect();
                // One object has one place, however differently its tests state it.
                let Some(place) = point_mm(&tests[members[0]].station, side) else { continue };
                let move_to = |tests: &mut [Test], to| {
                    members.iter().for_each(|member| set_point(&mut tests[*member].station, side, to));
                };
                move_to(tests, place);
                let Some(step) = step(&session.machine, tests, &members, side) else { continue };
                largest = largest.max(step.norm());
                move_to(tests, std::array::from_fn(|k| place[k] + step[k]));
            }
        }
        if largest < SETTLED_MM {
            return;
        }
    }
}

/// The step of a station, or of a reflector, that tests share. Each station has a dead path of its own.
fn step(machine: &Machine, tests: &[Test], members: &[usize], side: usize) -> Option<Vector3<f64>> {
    let mut places: Vec<&str> = members.iter().map(|member| tests[*member].setup.as_str()).collect();
    places.sort_unstable();
    places.dedup();
    let count = 3 + 2 * places.len();
    let mut rows: Vec<(DVector<f64>, f64)> = Vec::new();
    for member in members {
        let test = &tests[*member];
        let Some(readings) = &test.readings else { continue };
        let has_zero = test.priors.get(ZERO) == Some(&Prior::Free);
        let place = 3 + 2 * places.iter().position(|place| *place == test.setup)?;
        for (apart, read) in sights(machine, &test.station, readings, side) {
            let mut row = DVector::zeros(count);
            (0..3).for_each(|k| row[k] = 2.0 * apart[k]);
            row[place] = if has_zero { 2.0 * read } else { 0.0 };
            row[place + 1] = 1.0;
            rows.push((row, read * read - apart.norm_squared()));
        }
    }
    // Lengths of metres have squares of 10⁶: columns of similar length keep the digits.
    let mut matrix = DMatrix::from_fn(rows.len(), count, |i, k| rows[i].0[k]);
    let right = DVector::from_iterator(rows.len(), rows.iter().map(|(_, right)| *right));
    let scale: Vec<f64> = matrix.column_iter().map(|column| column.norm().max(f64::MIN_POSITIVE)).collect();
    let longest = scale[..3].iter().copied().fold(0.0, f64::max);
    for (k, mut column) in matrix.column_iter_mut().enumerate() {
        column /= if k < 3 { longest } else { scale[k] };
    }
    let solution = matrix.svd(true, true).solve(&right, OPEN * (rows.len() as f64).sqrt()).ok()?;
    let step = Vector3::new(solution[0], solution[1], solution[2]) / longest;
    step.iter().all(|x| x.is_finite()).then_some(step)
}

/// From the other point to the one that moves, in the frame of the latter, mm, and the distance that was read.
fn sights(machine: &Machine, station: &Station<f64>, readings: &Readings, side: usize) -> Vec<(Vector3<f64>, f64)> {
    let mut own = station.clone();
    let [Some(station), Some(reflector)] = own.points_mut() else { return Vec::new() };
    let (moving, other) = if side == STATION { (station, reflector) } else { (reflector, station) };
    let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
    let mut state = Vec::new();
    let every = readings.rows().div_ceil(MAX_ROWS).max(1);
    let mut sights = Vec::new();
    for row in (0..readings.rows()).step_by(every) {
        readings.state(machine, row, &mut state);
        let read = readings.observed[row * readings.channels];
        let seen = machine.in_frame(moving.frame, &state, &none, other.nominal_in_r(machine, &state));
        let apart = Vector3::from(moving.mm) - Vector3::from(seen.0);
        if read.is_finite() {
            sights.push((apart, read));
        }
    }
    sights
}
