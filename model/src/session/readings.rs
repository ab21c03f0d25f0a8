//! Readings as columns, with the driver quantities of effects: time, direction of travel, speed.

use std::path::PathBuf;

use crate::axis::AxisKind;
use crate::chain::{AxisPosition, Machine};
use crate::driver::DriverSample;

/// The file of readings, for messages about single readings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// The file.
    pub file: PathBuf,
    /// Line of each row in the file, from 1.
    pub line: Vec<usize>,
}

/// The readings of one test, one row per reading, in mm, rad, s, °C.
#[derive(Clone, Debug, Default)]
pub struct Readings {
    /// Where they come from; `None` for readings that come from no file.
    pub origin: Option<Origin>,
    /// The traversal of each row, as numbered in the file; empty without such a column.
    pub run: Vec<i64>,
    /// Time of each row, s; empty without such a column.
    pub time_s: Vec<f64>,
    /// Temperature of each row, °C; empty without such a column.
    pub temperature_c: Vec<f64>,
    /// Position of every axis of the machine: `positions[axis][row]`.
    pub positions: Vec<Vec<f64>>,
    /// Number of scalar coordinates of a reading: 1 or 3.
    pub coordinates: usize,
    /// The observed values, row by row, `coordinates` each, mm.
    pub observed: Vec<f64>,
}

impl Readings {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.positions.first().map_or(0, Vec::len)
    }

    /// Line of a row in the file of the readings, from 1; `None` for readings that come from no file.
    pub fn line(&self, row: usize) -> Option<usize> {
        self.origin.as_ref()?.line.get(row).copied()
    }

    /// A selection of rows, in the given order.
    pub fn of_rows(&self, rows: &[usize]) -> Readings {
        fn of<T: Copy>(column: &[T], rows: &[usize]) -> Vec<T> {
            if column.is_empty() {
                return Vec::new();
            }
            rows.iter().map(|&row| column[row]).collect()
        }
        Readings {
            origin: self
                .origin
                .as_ref()
                .map(|origin| Origin { file: origin.file.clone(), line: of(&origin.line, rows) }),
            run: of(&self.run, rows),
            time_s: of(&self.time_s, rows),
            temperature_c: of(&self.temperature_c, rows),
            positions: self.positions.iter().map(|column| of(column, rows)).collect(),
            coordinates: self.coordinates,
            observed: rows
                .iter()
                .flat_map(|&row| {
                    let start = row * self.coordinates;
                    self.observed.get(start..start + self.coordinates).unwrap_or(&[])
                })
                .copied()
                .collect(),
        }
    }

    /// Writes the positions of the axes in a row to `state`.
    pub fn state(&self, machine: &Machine, row: usize, state: &mut Vec<AxisPosition<f64>>) {
        state.clear();
        state.extend(
            machine.axes.iter().zip(&self.positions).map(|(axis, column)| AxisPosition::new(axis.kind, column[row])),
        );
    }

    /// The rows of each run: half-open ranges of consecutive rows with the same number. Without a run column, one
    /// range.
    pub fn runs(&self) -> Vec<std::ops::Range<usize>> {
        let rows = self.rows();
        if self.run.is_empty() {
            return std::iter::once(0..rows).filter(|run| !run.is_empty()).collect();
        }
        let mut runs = Vec::new();
        let mut start = 0;
        for row in 1..=rows {
            if row == rows || self.run[row] != self.run[start] {
                runs.push(start..row);
                start = row;
            }
        }
        runs
    }

    /// Driver samples of an axis for every row: position, direction, speed, distance and time since the last reversal.
    ///
    /// The direction is the sign of the backward difference of the positions within a run; the first row uses the
    /// second. An axis at rest keeps its last direction. The speed is the central difference over time, 0 without a
    /// time column.
    pub fn axis_samples(&self, axis: usize, kind: AxisKind) -> Vec<DriverSample<f64>> {
        let positions = &self.positions[axis];
        // Positions in a file are rounded; a smaller change is not a movement.
        let still = match kind {
            AxisKind::Linear => 1e-6,
            AxisKind::Rotary => 1e-9,
        };
        let mut samples: Vec<DriverSample<f64>> =
            positions.iter().map(|&value| DriverSample { value, ..DriverSample::default() }).collect();
        for run in self.runs() {
            let (first, end) = (run.start, run.end);
            let step = |row: usize| positions[row] - positions[row - 1];
            let moving = (first + 1..end).find(|&row| step(row).abs() > still);
            let mut direction = moving.map_or(0.0, |row| step(row).signum());
            let mut turned_at = first;
            for row in first..end {
                if row > first && step(row).abs() > still && step(row).signum() != direction {
                    direction = step(row).signum();
                    turned_at = row - 1;
                }
                let sample = &mut samples[row];
                sample.direction = direction;
                sample.since_reversal = (positions[row] - positions[turned_at]).abs();
                if !self.time_s.is_empty() {
                    let time = &self.time_s;
                    sample.since_reversal_s = time[row] - time[turned_at];
                    let (before, after) = (row.max(first + 1) - 1, (row + 1).min(end - 1));
                    let elapsed = time[after] - time[before];
                    if elapsed > 0.0 {
                        sample.rate = (positions[after] - positions[before]) / elapsed;
                    }
                }
            }
        }
        samples
    }
}
