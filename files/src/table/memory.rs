//! Readings from columns in memory: the same names, units and checks as the columns of a file.

use std::hash::Hash;
use std::path::Path;

use abbe_model::Diagnostic;
use abbe_model::instrument::Fault;
use abbe_model::session::limits;

use super::columns::quantities;
use super::columns::{Column, Role, known, listed};
use super::duplicates::{self, CellHasher};
use super::fill::{Cells, Filled, Filling, NOT_ENOUGH};
use super::request::Request;
use super::required;
use crate::check;
use crate::spelling::suggestion;

/// A column of readings in memory.
#[derive(Clone, Copy, Debug)]
pub struct MemoryColumn<'a> {
    /// Its name in a data file, with the unit: `c_deg`, `length_mm`, `run`, `socket`.
    pub name: &'a str,
    /// Its values, one for each reading.
    pub values: Values<'a>,
    /// Which of the values are missing, one for each reading; empty if none is. A reading of which a value is missing is
    /// left out, and a warning tells how many they are and where.
    pub missing: &'a [bool],
}

impl<'a> MemoryColumn<'a> {
    /// Numbers of which none is missing.
    pub const fn numbers(name: &'a str, numbers: &'a [f64]) -> MemoryColumn<'a> {
        MemoryColumn { name, values: Values::Numbers(numbers), missing: &[] }
    }
}

/// The values of a column.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// Numbers in the unit of the name.
    Numbers(&'a [f64]),
    /// The names of sockets.
    Words(&'a [String]),
}

impl Values<'_> {
    fn len(self) -> usize {
        match self {
            Values::Numbers(numbers) => numbers.len(),
            Values::Words(words) => words.len(),
        }
    }
}

/// The values of one reading.
struct Item<'a> {
    given: &'a [MemoryColumn<'a>],
    item: usize,
}

impl Cells for Item<'_> {
    fn number(&self, column: &Column) -> Result<f64, Fault> {
        let Values::Numbers(numbers) = self.given[column.index].values else { return Ok(f64::NAN) };
        let number = numbers[self.item];
        let fault = if number.is_finite() { limits::too_large(number) } else { Some(number.to_string()) };
        fault.map_or(Ok(number), |fault| Err((format!("it is {fault}"), "a finite number is expected".into())))
    }

    fn text(&self, column: &Column) -> &str {
        match self.given[column.index].values {
            Values::Words(words) => &words[self.item],
            Values::Numbers(_) => "",
        }
    }

    fn error(&self, column: &Column, (message, help): Fault) -> Diagnostic {
        fault((format!("`{}`, item {}: {message}", column.name, self.item), help))
    }

    fn lacks(&self, column: &Column) -> bool {
        self.given[column.index].missing.get(self.item) == Some(&true)
    }

    fn hash(&self, hasher: &mut CellHasher) {
        for column in self.given {
            match column.values {
                Values::Numbers(numbers) => numbers[self.item].to_bits().hash(hasher),
                Values::Words(words) => words[self.item].hash(hasher),
            }
        }
    }
}

/// Readings of the columns, one set per socket if a column names sockets, and warnings.
///
/// # Errors
/// A column of an unknown name, of another length or with a number that is not finite; a missing column; decreasing
/// time.
pub(crate) fn read(given: &[MemoryColumn<'_>], request: &Request<'_>) -> Result<Filling, Diagnostic> {
    let columns = roles(given, request).map_err(fault)?;
    let names: Vec<String> = given.iter().map(|column| column.name.to_string()).collect();
    required::required(request, &columns, Some(&names)).map_err(fault)?;
    let rows = given.first().map_or(0, |column| column.values.len());
    // A reading that lacks a channel stays, if the instrument has others.
    let can_lack = request.instrument().entry().rows_can_lack_channels && quantities(&columns).len() > 1;
    let stays = |column: &Column| can_lack && matches!(column.role, Role::Reading(..));
    let marks: Vec<MemoryColumn<'_>> = (given.iter().zip(&columns))
        .map(|(of, column)| MemoryColumn { missing: if stays(column) { &[] } else { of.missing }, ..*of })
        .collect();
    let present = present(&marks, rows).map_err(fault)?;
    let found = present.as_ref().map_or(rows, Vec::len);
    if found < check::MIN_READINGS {
        let message = match present {
            Some(_) => format!("{} of {rows} readings are missing, the rest is not enough for a fit", rows - found),
            None => format!("{rows} readings, which is not enough for a fit"),
        };
        return Err(fault((message, NOT_ENOUGH.into())));
    }
    let item = |row: usize| Item { given, item: present.as_ref().map_or(row, |present| present[row]) };
    let mut filled = Filled::new(request, columns, found);
    for row in 0..found {
        filled.push(&item(row))?;
    }
    filled.complete(found)?;
    let mut warnings = Vec::new();
    if found < rows {
        warnings.push(missing_readings(&marks, rows, found));
    }
    // Hashes of all rows take as much memory as the rows themselves.
    if filled.can_have_copies() && !duplicates::cannot_occur(&filled.readings) {
        filled.cells = (0..found).map(|row| duplicates::hash_of(|hasher| item(row).hash(hasher))).collect();
        filled.line = (0..found).map(|row| item(row).item + 1).collect();
        warnings.extend(filled.remove_duplicates(Path::new("the arrays")));
    }
    let quantities = quantities(filled.columns());
    Ok(Filling { quantities, by_socket: filled.by_socket(None), warnings: request.named(warnings) })
}

fn fault((message, help): Fault) -> Diagnostic {
    Diagnostic::session(message, help)
}

/// The role of each column.
fn roles(given: &[MemoryColumn<'_>], request: &Request<'_>) -> Result<Vec<Column>, Fault> {
    let mut columns: Vec<Column> = Vec::with_capacity(given.len());
    for (index, MemoryColumn { name, values, .. }) in given.iter().enumerate() {
        let Some(role) = Role::of(name, request).or_else(|| Role::of(&name.to_lowercase(), request)) else {
            let known = known(request);
            let help = format!("{}known columns are {}", suggestion(name, &known), listed(&known));
            return Err((format!("unknown column `{name}`"), help));
        };
        if let Some(other) = columns.iter().find(|other| other.role.same_as(&role)) {
            let message = format!("columns `{}` and `{name}` have the same meaning", other.name);
            return Err((message, "keep one of them".into()));
        }
        if (role == Role::Socket) != matches!(values, Values::Words(_)) {
            let what = if role == Role::Socket { "the names of sockets" } else { "numbers" };
            return Err((format!("`{name}`: {what} are expected"), "one for each reading".into()));
        }
        if values.len() != given[0].values.len() {
            let (first, count) = (given[0].name, given[0].values.len());
            let message = format!("`{name}` has {} values, `{first}` has {count}", values.len());
            return Err((message, "all columns have one value for each reading".into()));
        }
        columns.push(Column { role, index, name: (*name).to_string(), traversals: Vec::new() });
    }
    Ok(columns)
}

/// Largest number of intervals of items that a message lists for a column.
const MAX_LISTED: usize = 8;

/// The rows of which no value is missing; `None` if no value is missing at all.
fn present(given: &[MemoryColumn<'_>], rows: usize) -> Result<Option<Vec<usize>>, Fault> {
    for column in given.iter().filter(|column| !column.missing.is_empty()) {
        let marks = column.missing.len();
        if marks != rows {
            let message = format!("`{}` has {rows} values, and marks {marks} of them as missing or not", column.name);
            return Err((message, "one mark for each value".into()));
        }
    }
    let is_missing = |row: usize| given.iter().any(|column| column.missing.get(row) == Some(&true));
    let present: Vec<usize> = (0..rows).filter(|row| !is_missing(*row)).collect();
    Ok((present.len() < rows).then_some(present))
}

/// How many readings are missing, and where.
fn missing_readings(given: &[MemoryColumn<'_>], rows: usize, present: usize) -> String {
    let named = given.iter().filter(|column| column.missing.contains(&true));
    let places: Vec<String> = named.map(|column| format!("`{}` {}", column.name, items(column.missing))).collect();
    let missing = rows - present;
    let are = if missing == 1 { "is" } else { "are" };
    format!("{missing} of {rows} readings {are} missing: {}", places.join("; "))
}

/// The marked items, counted from 0: `item 3`, `items 7 to 9, 20`.
fn items(missing: &[bool]) -> String {
    let marked: Vec<usize> = (0..missing.len()).filter(|item| missing[*item]).collect();
    let intervals: Vec<String> = marked
        .chunk_by(|a, b| a + 1 == *b)
        .map(|run| match run {
            [one] => one.to_string(),
            [one, two] => format!("{one}, {two}"),
            [first, .., last] => format!("{first} to {last}"),
            [] => String::new(),
        })
        .collect();
    let more = if intervals.len() > MAX_LISTED { ", …" } else { "" };
    let listed = intervals[..intervals.len().min(MAX_LISTED)].join(", ");
    format!("item{} {listed}{more}", if marked.len() == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::items;

    #[test]
    fn items_are_listed_as_intervals() {
        let of = |marked: &[usize]| items(&(0..100).map(|item| marked.contains(&item)).collect::<Vec<_>>());
        assert_eq!(of(&[3]), "item 3");
        assert_eq!(of(&[0, 1, 99]), "items 0, 1, 99");
        assert_eq!(of(&[7, 8, 9, 20]), "items 7 to 9, 20");
        assert_eq!(of(&[1, 3, 5, 7, 9, 11, 13, 15]), "items 1, 3, 5, 7, 9, 11, 13, 15");
        assert_eq!(of(&[1, 3, 5, 7, 9, 11, 13, 15, 17]), "items 1, 3, 5, 7, 9, 11, 13, 15, …");
    }
}
