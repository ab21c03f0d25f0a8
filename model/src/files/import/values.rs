//! The numbers in the columns that are used.

use std::collections::BTreeMap;

use super::Expected;
use super::clock::clock_s;
use super::grid::{Grid, number_with_unit};
use super::meaning::{Found, Meaning};
use crate::instrument::Fault;
use crate::words::counted;

/// Largest share of rows without a number in a column that is read.
const MAX_DROPPED: f64 = 0.1;

/// The numbers of the columns that are used, by row; NaN where an instrument may lack a channel.
pub(super) struct Values {
    pub by_column: BTreeMap<usize, Vec<f64>>,
    /// The rows that are read, by index in the grid.
    pub rows: Vec<usize>,
    /// What a reader of tables would not accept.
    pub unreadable: Vec<String>,
}

impl Values {
    pub fn of(name: &str, grid: &Grid, found: &[Found], expected: &Expected<'_>) -> Result<Values, Fault> {
        let entry = expected.kind().entry();
        let is_word =
            |one: &Found| matches!(&one.meaning, Meaning::Socket) || one.meaning == Meaning::Hinted("socket".into());
        let (mut rows, mut by_column) = (Vec::new(), BTreeMap::<usize, Vec<f64>>::new());
        let (mut with_units, mut grouped, mut first_dropped) = (false, false, None);
        for (index, row) in grid.rows.iter().enumerate() {
            let mut values = Vec::with_capacity(found.len());
            for one in found.iter().filter(|one| !is_word(one)) {
                let cell = &row.cells[one.column];
                let lacks = cell.is_empty() || cell.eq_ignore_ascii_case("nan");
                let value = match one.meaning {
                    Meaning::Clock => clock_s(cell),
                    Meaning::Reading(..) if lacks && entry.rows_can_lack_channels => Some(f64::NAN),
                    _ => number_with_unit(cell, grid.decimal).map(|(value, unit)| {
                        with_units |= !unit.is_empty();
                        value
                    }),
                };
                grouped |= cell.contains('\u{2212}') || grid.decimal == ',' && cell.contains('.');
                values.extend(value.map(|value| (one.column, value)));
            }
            if values.len() < found.iter().filter(|one| !is_word(one)).count() {
                first_dropped = first_dropped.or(Some(row.line + 1));
                continue;
            }
            rows.push(index);
            values.into_iter().for_each(|(column, value)| by_column.entry(column).or_default().push(value));
        }
        let dropped = grid.rows.len() - rows.len();
        if dropped as f64 > MAX_DROPPED * grid.rows.len() as f64 {
            let line = first_dropped.unwrap_or_default();
            let found = format!(
                "{name}: {dropped} of {} rows lack a number in a column that is read, line {line} the first",
                grid.rows.len()
            );
            return Err((found, "export every reading, or say with a hint which columns to read".into()));
        }
        let mut unreadable = grid.unreadable.clone();
        if let Some(line) = first_dropped {
            unreadable.push(format!("{} without a number, line {line} the first, left out", counted(dropped, "row")));
        }
        if with_units {
            unreadable.push("numbers have their units behind them".into());
        }
        if grouped {
            unreadable.push("numbers have signs between thousands or a sign of their own for minus".into());
        }
        Ok(Values { by_column, rows, unreadable })
    }

    pub fn largest(&self, columns: &[usize]) -> f64 {
        let values = columns.iter().filter_map(|column| self.by_column.get(column)).flatten();
        values.map(|value| value.abs()).filter(|value| value.is_finite()).fold(0.0, f64::max)
    }

    pub fn median(&self, column: usize) -> f64 {
        let mut values: Vec<f64> =
            self.by_column.get(&column).into_iter().flatten().copied().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    }
}
