//! The file of known compensations.

use std::path::Path;

use abbe_files::Source;
use abbe_model::Diagnostic;

use super::date;
use super::unusable;

/// The change of an error of a machine by a compensation: the value that its table takes away, with its sign.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Compensation {
    /// Identifier of the machine.
    pub machine_id: String,
    /// When it became active, first and last time: days since the epoch of the sessions. A date without a time is a
    /// whole day.
    pub days: [f64; 2],
    /// The parameter.
    pub id: String,
    /// Its change, in `unit`.
    pub value: f64,
    /// Unit.
    pub unit: String,
    /// Where it is stated: file and line.
    pub source: String,
}

/// The columns of the file.
const COLUMNS: [&str; 5] = ["machine_id", "date", "parameter", "change", "unit"];

/// Reads known compensations: a CSV file with the columns `machine_id`, `date`, `parameter`, `change` and `unit`, one
/// row for each parameter. The unit is that of the parameter: `um`, `arcsec`.
///
/// # Errors
/// If the file cannot be read; with the line of what cannot be used.
pub fn read(file: &Path) -> Result<Vec<Compensation>, Diagnostic> {
    of_source(&abbe_files::text(file, "the file of compensations")?)
}

/// As [`read`], from a file that has been read.
///
/// # Errors
/// As [`read`].
pub fn of_source(source: &Source) -> Result<Vec<Compensation>, Diagnostic> {
    #[derive(serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Row {
        machine_id: String,
        date: String,
        parameter: String,
        change: f64,
        unit: String,
    }
    let name = source.file.display();
    let fault = |line: usize, found: String, expected: &str| unusable(format_args!("{name}:{line}"), found, expected);
    let mut contents = source.text.clone();
    // The line of a row is that before the place of the reader behind it.
    if !contents.ends_with('\n') {
        contents.push('\n');
    }
    let mut found: Vec<Compensation> = Vec::new();
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(contents.as_bytes());
    let expected = |line: usize, error: &dyn std::fmt::Display| {
        fault(line, error.to_string(), &format!("columns {} are expected", COLUMNS.join(", ")))
    };
    let columns = reader.headers().map_err(|error| expected(1, &error))?.clone();
    // A header without rows is checked too.
    if let Some(lacking) = COLUMNS.iter().find(|column| !columns.iter().any(|stated| stated == **column)) {
        return Err(expected(1, &format!("no column `{lacking}`")));
    }
    let mut cells = csv::StringRecord::new();
    loop {
        let read = reader.read_record(&mut cells);
        let line = usize::try_from(reader.position().line()).unwrap_or(usize::MAX).saturating_sub(1);
        if !read.map_err(|error| expected(line, &error))? {
            break;
        }
        let row: Row = cells.deserialize(Some(&columns)).map_err(|error| expected(line, &error))?;
        let no_date = || fault(line, format!("date `{}`", row.date), "the form 2026-11-23T08:00:00 is expected");
        let days = date::interval(&row.date).ok_or_else(no_date)?;
        if !row.change.is_finite() {
            return Err(fault(line, format!("change `{}`", row.change), "a number is expected"));
        }
        let Row { machine_id, date, parameter: id, change: value, unit } = row;
        if found.iter().any(|known| known.machine_id == machine_id && known.days == days && known.id == id) {
            return Err(fault(line, format!("the change of {id} on {date} is stated twice"), "remove a row"));
        }
        found.push(Compensation { machine_id, days, id, value, unit, source: format!("{name}:{line}") });
    }
    Ok(found)
}
