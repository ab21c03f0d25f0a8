//! Records of the MMT telescope: one star per record, of lines that start with a keyword.
//!
//! `CAT:` starts a record. `TAA:` is the true elevation and azimuth of the star, `RAA:` those of the encoders, degrees.
//! The azimuth of this project is 180° less that of the file, modulo 360°. The columns are those of a file of TPOINT.

use std::path::Path;

use abbe_model::Diagnostic;
use abbe_model::words::counted;

use super::format::{Content, DataFormat, has_extension, starts_with};
use super::lines::{Line, Lines};
use super::number::number;
use super::request::{Format, Request};
use super::row::{Row, Rows};
use super::tpoint;
use crate::stamp::FileStamp;
use crate::store::Store;

/// The format, recognised by its extension and the keyword of its first line.
pub(super) struct Mmt;

const START: &str = "CAT:";
const TRUE: &str = "TAA:";
const ENCODERS: &str = "RAA:";

impl DataFormat for Mmt {
    fn reads(&self, file: &Path, store: &Store) -> bool {
        has_extension(file, &["dat"]) && starts_with(file, store, |start| start.trim_start().starts_with(START))
    }

    fn open(&self, file: &Path, request: &Request<'_>) -> Result<(FileStamp, Content), Diagnostic> {
        let header = tpoint::columns(file, request)?[..4].to_vec();
        let lines = Lines::open(request.store, file, &request.format)?;
        let stamp = lines.stamp().clone();
        let format = Format { decimal: b'.', ..request.format.clone() };
        let rows = Box::new(RecordRows { lines, format, header: Some(header), record: None });
        Ok((stamp, Content::Table { rows, has_header: true }))
    }
}

/// The stars of a file, after a row of the names of their columns.
struct RecordRows {
    lines: Lines,
    format: Format,
    /// The header, until it has been read.
    header: Option<Vec<String>>,
    record: Option<Record>,
}

/// What has been read of a record.
#[derive(Default)]
struct Record {
    star: Option<[f64; 2]>,
    /// The encoders, with their line.
    encoders: Option<([f64; 2], Line)>,
}

const RECORD: &str = "a record starts with `CAT:` and has a line `TAA:` and a line `RAA:`, each with an elevation and an \
                      azimuth in degrees";

impl RecordRows {
    /// Azimuth and elevation from a line of elevation and azimuth.
    fn direction(&self, keyword: &str, text: &str) -> Result<[f64; 2], Diagnostic> {
        let cells: Vec<&str> = text.split_whitespace().collect();
        let [elevation, azimuth] = cells[..] else {
            return Err(self
                .lines
                .fault(format!("`{keyword}` with {} instead of 2", counted(cells.len(), "number")), RECORD));
        };
        let of = |cell| {
            let fault = |(message, help): (String, &str)| self.lines.fault(format!("`{keyword}`: {message}"), help);
            number(cell, &self.format).map_err(fault)
        };
        Ok([(180.0 - of(azimuth)?).rem_euclid(360.0), of(elevation)?])
    }

    /// The row of a record that ended before the line that was read last.
    fn row(&mut self, record: Record) -> Result<Row, Diagnostic> {
        let Record { star: Some(star), encoders: Some((encoders, line)) } = record else {
            let lacks = if record.star.is_none() { TRUE } else { ENCODERS };
            return Err(self.lines.fault(format!("the record that ends here has no `{lacks}`"), RECORD));
        };
        self.lines.count_row()?;
        // The file has seven decimals.
        let cells = star.into_iter().chain(encoders).map(|value| format!("{value:.10}"));
        Ok(Row::of_line(line, cells.collect()))
    }
}

impl Rows for RecordRows {
    fn next_row(&mut self) -> Result<Option<Row>, Diagnostic> {
        if let Some(header) = self.header.take() {
            return Ok(Some(Row::of_cells(1, header)));
        }
        while let Some(line) = self.lines.next_line()? {
            let text = line.text.trim_start();
            if text.starts_with(START) {
                if let Some(record) = self.record.replace(Record::default()) {
                    return self.row(record).map(Some);
                }
            } else if let Some(rest) = text.strip_prefix(TRUE) {
                let star = self.direction(TRUE, rest)?;
                self.record.get_or_insert_default().star = Some(star);
            } else if let Some(rest) = text.strip_prefix(ENCODERS) {
                let encoders = self.direction(ENCODERS, rest)?;
                self.record.get_or_insert_default().encoders = Some((encoders, line));
            }
        }
        self.record.take().map(|record| self.row(record)).transpose()
    }
}
