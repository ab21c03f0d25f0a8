//! What a session records beyond a single reading: the values from which drivers count, and the history of columns.
//!
//! An effect that follows a column q through a first-order lag follows the solution of `τ dy/dt + y = q`. Between
//! recorded values q is linear in time, so that each step of y is exact: with a = Δt/τ and f = (1 − e⁻ᵃ)/a,
//! `y₁ − q₁ = e⁻ᵃ (y₀ − q₀) + f (q₀ − q₁)`. At the first recorded value y = q: the equilibrium.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::column;
use crate::session::readings::Readings;

/// Reference values of the session, from which drivers count, and the history of its driver columns.
#[derive(Clone, Debug, Default)]
pub struct Reference {
    /// Time of the session's first reading, s.
    pub time_s: f64,
    /// The mean of each driver column, in its unit, by `NAME_unit`.
    pub means: BTreeMap<String, f64>,
    /// What each file recorded, with readings in their order in time.
    recordings: Arc<Vec<Recording>>,
}

/// Values that differ by less than this share of themselves are equal but for rounding.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// The sum of a column, counted from its first value, so that the mean of equal values is that value exactly.
struct Deviations {
    first: f64,
    sum: f64,
    count: usize,
}

impl Deviations {
    fn mean(&self) -> f64 {
        self.first + self.sum / self.count as f64
    }
}

/// The driver columns of the tests that one file holds.
#[derive(Debug)]
struct Recording {
    file: Option<PathBuf>,
    /// Time of the last reading, s.
    last_s: f64,
    /// Time and value of each reading, by column.
    columns: BTreeMap<String, Vec<[f64; 2]>>,
}

impl Reference {
    /// The reference values of a session, from the readings of its tests.
    pub fn of<'a>(readings: impl Iterator<Item = &'a Readings> + Clone) -> Reference {
        let first = readings.clone().flat_map(|r| r.time_s.first().copied()).fold(f64::INFINITY, f64::min);
        let mut columns: BTreeMap<String, Deviations> = BTreeMap::new();
        for (name, values) in readings.clone().flat_map(|r| &r.drivers) {
            let Some(first) = values.first() else { continue };
            let of_column = columns.entry(name.clone()).or_insert(Deviations { first: *first, sum: 0.0, count: 0 });
            of_column.sum += values.iter().map(|value| value - of_column.first).sum::<f64>();
            of_column.count += values.len();
        }
        Reference {
            time_s: if first.is_finite() { first } else { 0.0 },
            means: columns.into_iter().map(|(name, column)| (name, column.mean())).collect(),
            recordings: Arc::new(recordings(readings)),
        }
    }

    /// Reference values without the history of a session.
    pub fn without_history(time_s: f64, means: BTreeMap<String, f64>) -> Reference {
        Reference { time_s, means, recordings: Arc::default() }
    }

    /// A value of a column as an effect counts it: from the mean for units whose zero is a convention, else from 0.
    /// A difference that is no more than the rounding of the value is 0, so that a constant column determines nothing.
    pub fn counted(&self, column: &str, value: f64) -> f64 {
        if !column::counts_from_mean(column) {
            return value;
        }
        let mean = self.means.get(column).copied().unwrap_or(0.0);
        let difference = value - mean;
        if difference.abs() <= ROUNDING * mean.abs() { 0.0 } else { difference }
    }

    /// A column of some readings after a first-order lag of time constant τ. It starts at the first value that the
    /// file of the readings recorded, or a file that ended before them. `None` without the column or without times.
    pub(super) fn lagged(&self, column: &str, readings: &Readings, tau_s: f64) -> Option<Vec<f64>> {
        let values = readings.drivers.get(column)?;
        let first_s = readings.time_s.first()?;
        let file = readings.origin.as_ref().map(|origin| &origin.file);
        let applies =
            |recording: &&Recording| recording.last_s < *first_s || file.is_some() && recording.file.as_ref() == file;
        let before = self.recordings.iter().filter(applies).filter_map(|recording| recording.columns.get(column));
        let before = before.flatten().map(|[time_s, value]| (*time_s, *value, None));
        let own = readings.time_s.iter().zip(values).enumerate();
        let own = own.map(|(row, (time_s, value))| (*time_s, *value, Some(row)));
        let mut points: Vec<(f64, f64, Option<usize>)> = before.chain(own).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut time_s, mut value, _) = *points.first()?;
        let mut behind = 0.0;
        let mut lagged = vec![0.0; values.len()];
        for (next_s, next, row) in points {
            let elapsed = (next_s - time_s) / tau_s;
            let mean_decay = if elapsed > 0.0 { -(-elapsed).exp_m1() / elapsed } else { 1.0 };
            behind = (-elapsed).exp() * behind + mean_decay * (value - next);
            (time_s, value) = (next_s, next);
            if let Some(row) = row {
                lagged[row] = next + behind;
            }
        }
        Some(lagged)
    }
}

/// The recordings of each file. Readings that come from no file are a recording of their own.
fn recordings<'a>(readings: impl Iterator<Item = &'a Readings>) -> Vec<Recording> {
    let mut recordings: Vec<Recording> = Vec::new();
    for of_test in readings.filter(|r| !r.time_s.is_empty() && !r.drivers.is_empty()) {
        let file = of_test.origin.as_ref().map(|origin| origin.file.clone());
        let known = recordings.iter().position(|recording| file.is_some() && recording.file == file);
        let index = known.unwrap_or_else(|| {
            recordings.push(Recording { file, last_s: f64::NEG_INFINITY, columns: BTreeMap::new() });
            recordings.len() - 1
        });
        let recording = &mut recordings[index];
        recording.last_s = of_test.time_s.iter().copied().fold(recording.last_s, f64::max);
        for (name, values) in &of_test.drivers {
            let points = of_test.time_s.iter().zip(values).map(|(time_s, value)| [*time_s, *value]);
            recording.columns.entry(name.clone()).or_default().extend(points);
        }
    }
    recordings
}
