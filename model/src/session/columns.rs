//! Readings that are given in memory, as columns.

use std::collections::BTreeMap;

use super::check::{self, MIN_READINGS, MissingPosition};
use super::limits;
use super::motion::{self, Motion};
use super::readings::Readings;
use crate::chain::Machine;
use crate::driver::column;
use crate::instrument::{Fault, InstrumentKind};

/// Readings as columns, all of the same length but for those that are empty.
#[derive(Clone, Debug, Default)]
pub struct Columns {
    /// Positions of axes by their name, mm or rad. Other axes stay where the test holds them.
    pub axes: Vec<(String, Vec<f64>)>,
    /// The number of the traversal in one direction, or empty.
    pub run: Vec<i64>,
    /// Time, s, or empty.
    pub time_s: Vec<f64>,
    /// Driver columns by `NAME_unit`, in their unit: `temperature_c`, `spindle_speed_rpm`.
    pub drivers: BTreeMap<String, Vec<f64>>,
    /// The observed values, mm, row by row: one length each (of a ball bar: from ball to ball), or three coordinates.
    pub observed: Vec<f64>,
}

impl Columns {
    /// The readings of a test.
    pub(super) fn readings(
        &self,
        machine: &Machine,
        kind: InstrumentKind,
        motion: Option<&Motion>,
        at: &[f64],
        listed: &[bool],
    ) -> Result<Readings, Fault> {
        let coordinates = kind.coordinates();
        // The ball in a socket is where it is.
        let has_readings = kind.entry().has_readings;
        let by_axis = || self.axes.first().map_or(0, |(_, column)| column.len());
        let rows = if has_readings { self.observed.len() / coordinates } else { by_axis() };
        if rows < MIN_READINGS {
            return Err((
                format!("{rows} readings, which is not enough for a fit"),
                "a test needs at least two readings, and as many as it has parameters".into(),
            ));
        }
        let mut positions: Vec<Vec<f64>> = at.iter().map(|&position| vec![position; rows]).collect();
        let mut read = vec![false; at.len()];
        for (name, column) in &self.axes {
            let axis = machine.named_axis(name)?;
            if read[axis] {
                return Err((format!("two columns of axis {name}"), "keep one of them".into()));
            }
            column_of(&format!("positions of {name}"), column, rows)?;
            positions[axis].clone_from(column);
            read[axis] = true;
        }
        match check::missing_position(
            machine,
            kind,
            |axis| listed[axis],
            |axis| read[axis],
            &motion::named_axes(motion),
        ) {
            None => {}
            Some(MissingPosition::All) => {
                return Err(("no positions of an axis".into(), "add them to the columns".into()));
            }
            Some(MissingPosition::Moved(axis) | MissingPosition::NotStated(axis)) => {
                return Err((
                    format!("no positions of axis {}", machine.axes[axis].name),
                    "add them to the columns, or state the position at which the test holds the axis".into(),
                ));
            }
        }
        let observed = if has_readings {
            column_of("observed values", &self.observed, rows * coordinates)?;
            self.observed.clone()
        } else {
            vec![0.0; rows * coordinates]
        };
        if !self.time_s.is_empty() {
            column_of("times", &self.time_s, rows)?;
        }
        for (name, column) in &self.drivers {
            if !column::is_name(name) {
                return Err((format!("the driver column `{name}`"), column::help_on_name()));
            }
            column_of(&format!("values of {name}"), column, rows)?;
        }
        if !self.run.is_empty() && self.run.len() != rows {
            return Err(wrong_count("run numbers", self.run.len(), rows));
        }
        for pair in self.time_s.windows(2) {
            if let Some(fault) = check::decreasing_time(pair[0], pair[1]) {
                return Err((fault, "sort the readings by time, or omit the times".into()));
            }
        }
        Ok(Readings {
            origin: None,
            run: self.run.clone(),
            time_s: self.time_s.clone(),
            drivers: self.drivers.clone(),
            positions,
            coordinates,
            observed,
            travel_before: Vec::new(),
            row_after: None,
        })
    }
}

/// Checks a column.
fn column_of(what: &str, column: &[f64], rows: usize) -> Result<(), Fault> {
    if column.len() != rows {
        return Err(wrong_count(what, column.len(), rows));
    }
    for (row, value) in column.iter().enumerate() {
        number(what, *value).map_err(|(message, help)| (format!("{message} (item {})", row + 1), help))?;
    }
    Ok(())
}

fn wrong_count(what: &str, found: usize, expected: usize) -> Fault {
    (format!("{what}: {found} where {expected} are expected"), "all columns have one item for each reading".into())
}

/// Checks that a number is finite and within [`limits::LARGEST`].
pub(crate) fn number(what: &str, value: f64) -> Result<(), Fault> {
    let fault = if value.is_finite() { limits::too_large(value) } else { Some(value.to_string()) };
    match fault {
        None => Ok(()),
        Some(fault) => Err((format!("{what} is {fault}"), "a finite number is expected".into())),
    }
}
