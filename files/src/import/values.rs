//! The numbers in the columns that are used.

use std::collections::BTreeMap;

use abbe_model::calendar::{DAY_S, DateOrder, Moment, clock};
use abbe_model::instrument::Fault;
use abbe_model::unit::Unit;
use abbe_model::words::{counted, with_article};

use super::Expected;
use super::grid::{Grid, number_with_unit};
use super::meaning::{Found, Meaning};

/// Largest share of rows without a number in a column that is read.
const MAX_DROPPED: f64 = 0.1;

/// The numbers of the columns that are used, by row; NaN where an instrument may lack a channel.
pub(super) struct Values {
    pub by_column: BTreeMap<usize, Vec<f64>>,
    /// The rows that are read, by index in the grid.
    pub rows: Vec<usize>,
    /// What a reader of tables would not accept.
    pub unreadable: Vec<String>,
    /// The rows that lack a number, in words.
    pub left_out: Vec<String>,
}

/// What the cells of the columns need besides a reader of tables.
#[derive(Default)]
struct Needs {
    units: bool,
    mixed_units: bool,
    signs: bool,
}

impl Values {
    /// # Errors
    /// If too many rows lack a number, or a unit behind a number contradicts its column: with the line.
    pub fn of(grid: &Grid, found: &[Found], expected: &Expected<'_>) -> Result<Values, Fault> {
        let entry = expected.kind().entry();
        let numeric: Vec<&Found> = found.iter().filter(|one| one.meaning != Meaning::Socket).collect();
        let orders: Vec<DateOrder> = numeric.iter().map(|one| date_order(grid, one)).collect();
        let (mut rows, mut by_column) = (Vec::new(), BTreeMap::<usize, Vec<f64>>::new());
        let (mut needs, mut first_dropped) = (Needs::default(), None);
        // Seconds that a time of day lies behind the first one, by column: it goes on over midnight.
        let mut before: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for (index, row) in grid.rows.iter().enumerate() {
            let mut values = Vec::with_capacity(numeric.len());
            for (one, order) in numeric.iter().zip(&orders) {
                let cell = &row.cells[one.column];
                let lacks = cell.is_empty() || cell.eq_ignore_ascii_case("nan");
                let value = match one.meaning {
                    Meaning::Clock => clock(cell, *order).filter(|moment| moment.second.is_some()).map(|moment| {
                        let (last, days) = before.entry(one.column).or_insert((moment.seconds(), 0.0));
                        going_on(moment, last, days)
                    }),
                    Meaning::Reading(..) if lacks && entry.rows_can_lack_channels => Some(f64::NAN),
                    _ => number_of(grid, one, row.line, cell, &mut needs)?,
                };
                needs.signs |= cell.contains('\u{2212}') || grid.decimal == ',' && cell.contains('.');
                values.extend(value.map(|value| (one.column, value)));
            }
            if values.len() < numeric.len() {
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
                "{dropped} of {} rows lack a number in a column that is read, line {line} the first",
                grid.rows.len()
            );
            return Err((found, "export every reading, or say with a hint which columns to read".into()));
        }
        let mut unreadable = grid.unreadable.clone();
        let left_out: Vec<String> = (first_dropped.iter())
            .map(|line| format!("{} without a number, line {line} the first, left out", counted(dropped, "row")))
            .collect();
        unreadable.extend(left_out.iter().cloned());
        if needs.units {
            unreadable.push("numbers have their units behind them".into());
        }
        if needs.mixed_units {
            unreadable.push("units differ from row to row, and are converted to that of their column".into());
        }
        if needs.signs {
            unreadable.push("numbers have signs between thousands or a sign of their own for minus".into());
        }
        Ok(Values { by_column, rows, unreadable, left_out })
    }

    pub fn largest(&self, columns: &[usize]) -> f64 {
        let values = columns.iter().filter_map(|column| self.by_column.get(column)).flatten();
        values.map(|value| value.abs()).filter(|value| value.is_finite()).fold(0.0, f64::max)
    }

    /// The least and the largest number of a column; `None` if it has none.
    pub fn range(&self, column: usize) -> Option<[f64; 2]> {
        let values = self.by_column.get(&column)?.iter().copied().filter(|value| value.is_finite());
        let range =
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
        (range[0] <= range[1]).then_some(range)
    }

    pub fn median(&self, column: usize) -> f64 {
        let mut values: Vec<f64> =
            self.by_column.get(&column).into_iter().flatten().copied().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    }

    /// Root mean square over columns.
    pub fn rms(&self, columns: &[usize]) -> f64 {
        let values = columns.iter().filter_map(|column| self.by_column.get(column)).flatten();
        let (count, squares) = (values.copied().filter(|value| value.is_finite()))
            .fold((0.0, 0.0), |(count, squares), value| (count + 1.0, squares + value * value));
        if count > 0.0 { (squares / count).sqrt() } else { 0.0 }
    }
}

/// The number of a cell in the unit of its column; `None` if it has none.
fn number_of(grid: &Grid, one: &Found, line: usize, cell: &str, needs: &mut Needs) -> Result<Option<f64>, Fault> {
    let Some((value, word)) = number_with_unit(cell, grid.decimal) else { return Ok(None) };
    let fault = |what: String| {
        let help = "export the column with one unit, or with the unit of each number behind it";
        Err((
            format!("line {}: `{cell}` in column {} ({}) {what}", line + 1, one.column + 1, grid.name(one.column)),
            help.into(),
        ))
    };
    let Some(unit) = Unit::of_word(word) else {
        return if one.has_unit_in_cells {
            fault("has no unit, and other numbers of the column have one".into())
        } else {
            Ok(Some(value))
        };
    };
    needs.units = true;
    match one.unit {
        Some(own) if own == unit => Ok(Some(value)),
        Some(own) => match unit.convert(value, own).filter(|_| ![own, unit].contains(&Unit::Grad)) {
            Some(value) => {
                needs.mixed_units = true;
                Ok(Some(value))
            }
            None => {
                let what = with_article(&unit.dimension().to_string());
                fault(format!("is {what}, and the column is in {}", own.key()))
            }
        },
        None => fault("has a unit, and the column holds numbers without one".into()),
    }
}

/// The order of the dates of a column: the day first, unless more cells have a date with the month first.
fn date_order(grid: &Grid, one: &Found) -> DateOrder {
    let possible = |order: DateOrder| {
        grid.rows.iter().filter(|row| clock(row.cells[one.column].as_str(), order).is_some()).count()
    };
    let is_other = one.meaning == Meaning::Clock && possible(DateOrder::MonthFirst) > possible(DateOrder::DayFirst);
    if is_other { DateOrder::MonthFirst } else { DateOrder::DayFirst }
}

/// Seconds of a moment after the last one: a time of day without a date that falls by more than half a day is past midnight.
fn going_on(moment: Moment, last: &mut f64, days: &mut f64) -> f64 {
    let seconds = moment.seconds();
    if moment.day.is_none() && seconds < *last - 0.5 * DAY_S {
        *days += 1.0;
    }
    *last = seconds;
    seconds + *days * DAY_S
}
