//! A table as data: columns with headings and units, cells of text or numbers, sentences around it.

use super::number;

/// Alignment of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// A column.
#[derive(Clone, Debug)]
pub struct Column {
    /// Heading, with the unit of all cells if they have one: `offset, µm`.
    pub heading: String,
    /// Alignment.
    pub align: Align,
}

/// A column of words.
pub fn words(heading: impl Into<String>) -> Column {
    Column { heading: heading.into(), align: Align::Left }
}

/// A column of numbers.
pub fn numbers(heading: impl Into<String>) -> Column {
    Column { heading: heading.into(), align: Align::Right }
}

/// A column of numbers after `>`, else of words.
impl From<&'static str> for Column {
    fn from(text: &'static str) -> Column {
        text.strip_prefix('>').map_or_else(|| words(text), numbers)
    }
}

/// A cell.
#[derive(Clone, Debug)]
pub enum Cell {
    /// Text.
    Text(String),
    /// A number with its decimal places; `None` for all digits that distinguish it.
    Number(f64, Option<usize>),
}

impl Cell {
    /// A number with decimal places.
    pub fn fixed(value: f64, places: usize) -> Cell {
        Cell::Number(value, Some(places))
    }

    /// A number with all its digits.
    pub fn exact(value: f64) -> Cell {
        Cell::Number(value, None)
    }

    /// A value and its standard uncertainty, rounded to the same place: two digits of the uncertainty.
    pub fn estimate(value: f64, u: f64) -> [Cell; 2] {
        [value, u].map(|number| Cell::fixed(number, number::places(u)))
    }

    /// A cell that may have no number.
    pub fn or_dash(number: Option<Cell>) -> Cell {
        number.unwrap_or_else(|| "–".into())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Cell {
        Cell::Text(text)
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Cell {
        Cell::Text(text.to_string())
    }
}

impl From<&String> for Cell {
    fn from(text: &String) -> Cell {
        Cell::Text(text.clone())
    }
}

/// The cell as tables for people show it. A number that rounds to zero has no sign.
impl std::fmt::Display for Cell {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Cell::Text(text) => formatter.write_str(text),
            Cell::Number(value, Some(places)) => formatter.write_str(&number::fixed(*value, *places)),
            Cell::Number(value, None) => write!(formatter, "{value}"),
        }
    }
}

/// Cells of anything that is a cell.
#[doc(hidden)]
#[macro_export]
macro_rules! cells {
    ($($cell:expr),* $(,)?) => { vec![$($crate::report::table::Cell::from($cell)),*] };
}
pub use crate::cells;

/// A table.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// What it shows, without a full stop; empty if the place of the table says it.
    pub title: String,
    /// The columns.
    pub columns: Vec<Column>,
    /// The rows. A row may be shorter than the header.
    pub rows: Vec<Vec<Cell>>,
    /// Sentences below it.
    pub notes: Vec<String>,
    /// The rows that a terminal shows without `--all`; `None` for all.
    pub key_rows: Option<Vec<usize>>,
    /// Name of its files in a paper.
    pub name: String,
}

impl Table {
    /// A table without a title.
    pub fn new<C: Into<Column>>(
        columns: impl IntoIterator<Item = C>,
        rows: impl IntoIterator<Item = Vec<Cell>>,
    ) -> Table {
        let columns = columns.into_iter().map(Into::into).collect();
        Table { columns, rows: rows.into_iter().collect(), ..Table::default() }
    }

    /// A column at the end, with its cells from the first row on.
    pub fn push(&mut self, column: impl Into<Column>, cells: impl IntoIterator<Item = Cell>) {
        self.columns.push(column.into());
        self.rows.iter_mut().zip(cells).for_each(|(row, cell)| row.push(cell));
    }

    /// The table with a title.
    pub fn titled(self, title: impl Into<String>) -> Table {
        Table { title: title.into(), ..self }
    }

    /// The table with a name of its files.
    pub fn named(self, name: impl Into<String>) -> Table {
        Table { name: name.into(), ..self }
    }

    /// The table, of which a terminal shows the first rows without `--all`. A row more than these costs no more room
    /// than the number of the others.
    pub fn folded(self, max: usize) -> Table {
        let key_rows = (self.rows.len() > max + 1).then(|| (0..max).collect());
        Table { key_rows, ..self }
    }

    /// Without the columns that have no text in any row.
    pub fn without_empty_columns(mut self) -> Table {
        for column in (0..self.columns.len()).rev() {
            let is_empty = |row: &Vec<Cell>| matches!(&row[column], Cell::Text(text) if text.is_empty());
            if self.rows.iter().all(is_empty) {
                self.columns.remove(column);
                self.rows.iter_mut().for_each(|row| drop(row.remove(column)));
            }
        }
        self
    }

    /// Without the columns at the end after the first `count`.
    pub fn first_columns(mut self, count: usize) -> Table {
        self.columns.truncate(count);
        self.rows.iter_mut().for_each(|row| row.truncate(count));
        self
    }
}
