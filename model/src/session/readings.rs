//! Readings as columns, with the driver quantities of effects: time, direction of travel, speed.

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::Vector3;

use crate::axis::AxisKind;
use crate::chain::{AxisPosition, BodyErrors, Machine};
use crate::driver::DriverSample;
use crate::instrument::{Reading, Station, Target};

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
    /// The driver columns by `NAME_unit`, in their unit, such as `temperature_c`; one value per row.
    pub drivers: BTreeMap<String, Vec<f64>>,
    /// Position of every axis of the machine: `positions[axis][row]`.
    pub positions: Vec<Vec<f64>>,
    /// Number of channels of a reading.
    pub channels: usize,
    /// The observed values, row by row, one for each channel, mm or rad; NaN for a value that was not read.
    pub observed: Vec<f64>,
    /// The travel of every axis before the first row, if the rows continue others of the same run; otherwise empty.
    pub travel_before: Vec<AxisTravel>,
    /// The row after the last one, if others of the same run continue these rows.
    pub row_after: Option<RowAfter>,
}

/// A row that continues others.
#[derive(Clone, Debug, PartialEq)]
pub struct RowAfter {
    /// Position of every axis, mm or rad.
    pub positions: Vec<f64>,
    /// Time of the row, s; 0 without a time column.
    pub time_s: f64,
}

/// How an axis has travelled up to a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisTravel {
    /// Its position there, mm or rad.
    pub position: f64,
    /// Time of the row, s; 0 without a time column.
    pub time_s: f64,
    /// Direction of its last movement: −1, 0 or 1.
    pub direction: f64,
    /// Its position at the last reversal.
    pub turned_at: f64,
    /// Time of the last reversal, s; 0 without a time column.
    pub turned_at_s: f64,
}

impl Readings {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.positions.first().map_or(0, Vec::len)
    }

    /// Whether the value of a channel was read in a row.
    pub fn was_read(&self, row: usize, channel: usize) -> bool {
        self.observed.get(row * self.channels + channel).is_none_or(|value| !value.is_nan())
    }

    /// A function that gives the nominal reading of an instrument in a row.
    pub fn nominal<'r>(
        &'r self,
        machine: &'r Machine,
        station: &'r Station<f64>,
    ) -> impl FnMut(usize) -> Reading<f64> + 'r {
        let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
        let mut state = Vec::new();
        move |row| {
            self.state(machine, row, &mut state);
            station.read::<f64>(machine, &state, &none, |_| None)
        }
    }

    /// The nominal position of a point in R, mm, at every row.
    pub fn nominal_points(&self, machine: &Machine, point: &Target<f64>) -> Vec<Vector3<f64>> {
        let mut state = Vec::new();
        let place = |row: usize| {
            self.state(machine, row, &mut state);
            Vector3::from(point.nominal_mm(machine, &state))
        };
        (0..self.rows()).map(place).collect()
    }

    /// Turns the observed values of the columns into those of the channels, for channels that refer to the nominal
    /// reading.
    pub fn columns_to_channels(&mut self, machine: &Machine, station: &Station<f64>) {
        self.change(machine, |state, values| station.channels_of_columns(machine, state, values));
    }

    /// The inverse of [`Readings::columns_to_channels`].
    pub fn channels_to_columns(&mut self, machine: &Machine, station: &Station<f64>) {
        self.change(machine, |state, values| station.columns_of_channels(machine, state, values));
    }

    fn change(&mut self, machine: &Machine, change: impl Fn(&[AxisPosition<f64>], &mut [f64])) {
        let (mut state, mut observed) = (Vec::new(), std::mem::take(&mut self.observed));
        for (row, values) in observed.chunks_exact_mut(self.channels.max(1)).enumerate() {
            self.state(machine, row, &mut state);
            change(&state, values);
        }
        self.observed = observed;
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
            drivers: self.drivers.iter().map(|(name, values)| (name.clone(), of(values, rows))).collect(),
            positions: self.positions.iter().map(|column| of(column, rows)).collect(),
            channels: self.channels,
            observed: rows
                .iter()
                .flat_map(|&row| {
                    let start = row * self.channels;
                    self.observed.get(start..start + self.channels).unwrap_or(&[])
                })
                .copied()
                .collect(),
            travel_before: Vec::new(),
            row_after: None,
        }
    }

    /// States that other rows continue these, which gives the speed at the last row. They change nothing if another run
    /// begins with them.
    pub fn continue_with(&mut self, others: &Readings) {
        let is_continued = others.rows() > 0 && self.run.last() == others.run.first();
        self.row_after = is_continued.then(|| RowAfter {
            positions: others.positions.iter().map(|column| column[0]).collect(),
            time_s: others.time_s.first().copied().unwrap_or(0.0),
        });
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
        let mut end = 0;
        let run = |numbers: &[i64]| {
            let start = end;
            end += numbers.len();
            start..end
        };
        self.run.chunk_by(|a, b| a == b).map(run).collect()
    }

    /// Driver samples of an axis for every row: position, direction, speed, distance and time since the last reversal.
    ///
    /// The direction is the sign of the backward difference of the positions within a run; the first row uses the
    /// second. An axis at rest keeps its last direction. The speed is the central difference over time, 0 without a
    /// time column. Rows before and after these, if they are known, count as rows of the run.
    pub fn axis_samples(&self, axis: usize, kind: AxisKind) -> Vec<DriverSample<f64>> {
        let positions = &self.positions[axis];
        // Positions in a file are rounded; a smaller change is not a movement.
        let still = match kind {
            AxisKind::Linear => 1e-6,
            AxisKind::Rotary => 1e-9,
        };
        let mut samples: Vec<DriverSample<f64>> =
            positions.iter().map(|&value| DriverSample { value, ..DriverSample::default() }).collect();
        for (number, run) in self.runs().into_iter().enumerate() {
            let (first, end) = (run.start, run.end);
            let before = self.travel_before.get(axis).filter(|_| number == 0);
            let after = self.row_after.as_ref().filter(|_| end == positions.len());
            let step = |row: usize| match before {
                Some(travel) if row == first => positions[row] - travel.position,
                _ if row == first => 0.0,
                _ => positions[row] - positions[row - 1],
            };
            let moves = |row: &usize| step(*row).abs() > still;
            let time_s = |row: usize| self.time_s.get(row).copied().unwrap_or(0.0);
            let start = AxisTravel { turned_at: positions[first], turned_at_s: time_s(first), ..AxisTravel::default() };
            let mut travel = before.copied().unwrap_or(start);
            if travel.direction == 0.0 {
                let last_step = after.map_or(0.0, |after| after.positions[axis] - positions[end - 1]);
                let moves_after = if last_step.abs() > still { last_step.signum() } else { 0.0 };
                travel.direction = (first..end).find(moves).map_or(moves_after, |row| step(row).signum());
            }
            for row in first..end {
                if moves(&row) && step(row).signum() != travel.direction {
                    travel.direction = step(row).signum();
                    (travel.turned_at, travel.turned_at_s) = match before {
                        Some(before) if row == first => (before.position, before.time_s),
                        _ => (positions[row - 1], time_s(row - 1)),
                    };
                }
                let sample = &mut samples[row];
                sample.direction = travel.direction;
                sample.since_reversal = (positions[row] - travel.turned_at).abs();
                if !self.time_s.is_empty() {
                    let time = &self.time_s;
                    sample.since_reversal_s = time[row] - travel.turned_at_s;
                    let at = |row: usize| (positions[row], time[row]);
                    let (from, start_s) = match before {
                        Some(before) if row == first => (before.position, before.time_s),
                        _ => at(row.max(first + 1) - 1),
                    };
                    let (to, end_s) = match after {
                        Some(after) if row + 1 == end => (after.positions[axis], after.time_s),
                        _ => at((row + 1).min(end - 1)),
                    };
                    if end_s > start_s {
                        sample.rate = (to - from) / (end_s - start_s);
                    }
                }
            }
        }
        samples
    }

    /// The travel of every axis up to the last row, for rows that continue these.
    pub fn travel_after(&self, machine: &Machine) -> Vec<AxisTravel> {
        let axes = machine.axes.iter().enumerate();
        axes.map(|(axis, of)| {
            let samples = self.axis_samples(axis, of.kind);
            let Some(last) = samples.last() else {
                return self.travel_before.get(axis).copied().unwrap_or_default();
            };
            AxisTravel {
                position: last.value,
                time_s: self.time_s.last().copied().unwrap_or(0.0),
                direction: last.direction,
                turned_at: last.value - last.direction * last.since_reversal,
                turned_at_s: self.time_s.last().map_or(0.0, |time| time - last.since_reversal_s),
            }
        })
        .collect()
    }
}
