//! CSV: rows of cells in a text, with a separator between cells. Read with any layout, written with our column names.
//!
//! A header line, then one row per reading. A `#` starts a comment line, unless it begins the error of a cell (`#REF!`). Empty lines, a byte order mark and CRLF are
//! accepted.

use std::path::Path;

use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use abbe_model::driver::column;
use abbe_model::instrument::Station;
use abbe_model::instrument::column::{Column, Quantity};
use abbe_model::session::readings::Readings;
use abbe_model::unit::Unit;

use super::comment::is_comment;
use super::format::{Content, DataFormat};
use super::lines::Lines;
use super::request::Request;
use super::row::{Row, Rows};
use crate::stamp::FileStamp;
use crate::store::Store;

/// The format. It reads every file that is of no other format.
pub(super) struct Csv;

impl DataFormat for Csv {
    fn reads(&self, _: &Path, _: &Store) -> bool {
        true
    }

    fn open(&self, file: &Path, request: &Request<'_>) -> Result<(FileStamp, Content), Diagnostic> {
        let lines = Lines::open(request.store, file, &request.format)?;
        let (stamp, has_header) = (lines.stamp().clone(), request.format.header);
        let rows = Box::new(CsvRows::new(lines, request.format.separator));
        Ok((stamp, Content::Table { rows, has_header }))
    }
}

/// The rows of a text, without comments and empty lines.
struct CsvRows {
    lines: Lines,
    separator: u8,
    /// The cells of an earlier row, whose memory is used again.
    spare: Vec<String>,
}

impl CsvRows {
    fn new(lines: Lines, separator: u8) -> CsvRows {
        CsvRows { lines, separator, spare: Vec::new() }
    }

    /// The cells of a line with quotes.
    fn quoted(&self, text: &str) -> Result<Vec<String>, Diagnostic> {
        if text.matches('"').count() % 2 == 1 {
            return Err(self.lines.fault("a quote is not closed".into(), "a quoted cell must end on its line"));
        }
        let mut record = csv::StringRecord::new();
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .delimiter(self.separator)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        match reader.read_record(&mut record) {
            Ok(true) => Ok(record.iter().map(str::to_string).collect()),
            Ok(false) => Ok(Vec::new()),
            Err(cause) => {
                Err(self.lines.fault(format!("invalid quotes: {cause}"), "a quoted cell must end on its line"))
            }
        }
    }
}

impl Rows for CsvRows {
    fn next_row(&mut self) -> Result<Option<Row>, Diagnostic> {
        while let Some(line) = self.lines.next_line()? {
            let content = line.text.trim();
            if content.is_empty() || is_comment(content) {
                continue;
            }
            let cells = if line.text.contains('"') {
                self.quoted(&line.text)?
            } else {
                let mut cells = std::mem::take(&mut self.spare);
                fill(&mut cells, parts(&line.text, self.separator));
                cells
            };
            self.lines.count_row()?;
            return Ok(Some(Row::of_line(line, cells)));
        }
        Ok(None)
    }

    fn reuse(&mut self, row: Row) {
        self.spare = row.cells;
    }
}

/// The cells of a line without quotes, without surrounding spaces.
fn parts(text: &str, separator: u8) -> impl Iterator<Item = &str> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let whole = rest?;
        let end = whole.bytes().position(|byte| byte == separator);
        let cell = end.map_or(whole, |end| &whole[..end]);
        rest = end.map(|end| &whole[end + 1..]);
        // Most cells are numbers without spaces.
        let is_plain = |byte: Option<&u8>| byte.is_some_and(u8::is_ascii_graphic);
        let bytes = cell.as_bytes();
        Some(if is_plain(bytes.first()) && is_plain(bytes.last()) { cell } else { cell.trim() })
    })
}

/// Replaces the cells of a row, in the memory that they have.
fn fill<'t>(cells: &mut Vec<String>, texts: impl Iterator<Item = &'t str>) {
    let mut filled = 0;
    for text in texts {
        match cells.get_mut(filled) {
            Some(cell) => {
                cell.clear();
                cell.push_str(text);
            }
            None => cells.push(text.to_string()),
        }
        filled += 1;
    }
    cells.truncate(filled);
}

/// Readings as the text of a CSV file with our column names.
///
/// Numbers have up to twelve decimals of mm, degree or s, so that the rounding is far below any resolution.
pub fn text(machine: &Machine, station: &Station<f64>, readings: &Readings) -> String {
    let mut header = Vec::new();
    if !readings.time_s.is_empty() {
        header.push("time_s".to_string());
    }
    if !readings.run.is_empty() {
        header.push("run".into());
    }
    for axis in &machine.axes {
        header.push(axis.column(""));
    }
    header.extend(readings.drivers.keys().map(|name| column::in_files(name).into_owned()));
    let of_channel = |channel: usize| {
        station.columns().iter().find(|column| {
            let holds = matches!(column.quantity, Quantity::Length | Quantity::Channel(_) | Quantity::Polar(_));
            holds && column.quantity.channel().and_then(|of_all| station.kept_channel(of_all)) == Some(channel)
        })
    };
    let columns: Vec<&Column> = (0..readings.channels).filter_map(of_channel).collect();
    header.extend(columns.iter().map(|column| column.name(unit_of(column))));
    let mut text = header.join(",");
    text.push('\n');
    for row in 0..readings.rows() {
        let mut cells = Vec::with_capacity(header.len());
        if let Some(time) = readings.time_s.get(row) {
            cells.push(decimal(*time));
        }
        if let Some(run) = readings.run.get(row) {
            cells.push(run.to_string());
        }
        for (axis, column) in machine.axes.iter().zip(&readings.positions) {
            cells.push(decimal(axis.kind.to_display(column[row])));
        }
        cells.extend(readings.drivers.values().filter_map(|values| values.get(row)).map(|value| decimal(*value)));
        for (channel, column) in columns.iter().enumerate() {
            let value = readings.observed.get(row * readings.channels + channel).filter(|value| !value.is_nan());
            cells.push(value.map_or(String::new(), |value| decimal(unit_of(column).to_display(*value))));
        }
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// The unit in which a column of readings is written.
fn unit_of(column: &Column) -> Unit {
    if column.is_angle() { column.unit } else { Unit::Millimetre }
}

/// A number with the necessary decimals, at most twelve.
pub(crate) fn decimal(value: f64) -> String {
    let text = format!("{value:.12}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

#[cfg(test)]
mod tests;
