//! Rows of cells from a file, in memory one line at a time.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::Format;
use crate::error::{ModelError, Place};
use crate::session::stamp::Stamp;

/// Most bytes of one line.
const LONGEST_LINE: u64 = 1 << 20;
/// Most bytes of a file.
const MOST_BYTES: u64 = 2 << 30;
/// Most rows of a file.
const MOST_ROWS: usize = 10_000_000;

/// What to do with a file that is too long.
const SPLIT: &str = "leave out readings (every tenth will do), or split the file over several tests";

/// One row.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// Its line, from 1.
    pub line: usize,
    /// Its cells, without the spaces around them.
    pub cells: Vec<String>,
    /// Byte of the file at which the line begins.
    start: usize,
    /// The line as it stands.
    text: String,
}

impl Row {
    /// A row that stands in no text: of a sheet.
    pub fn of_cells(line: usize, cells: Vec<String>) -> Row {
        Row {
            line,
            cells,
            start: 0,
            text: String::new(),
        }
    }

    /// The bytes of the file that a cell takes, where no quotes hide them.
    pub fn span(&self, cell: usize) -> Option<Range<usize>> {
        let cell = self.cells.get(cell).filter(|cell| !cell.is_empty())?;
        let mut found = self.text.match_indices(cell.as_str());
        let (at, _) = found.next()?;
        // The same text twice in the line leaves in doubt which one is meant.
        match found.next() {
            None => Some(self.start + at..self.start + at + cell.len()),
            Some(_) => Some(self.start..self.start + self.text.len()),
        }
    }
}

/// The rows of a file: no comments, no empty lines.
pub(super) struct Rows {
    file: PathBuf,
    separator: u8,
    reader: BufReader<File>,
    stamp: Stamp,
    line: usize,
    rows: usize,
    byte: usize,
    buffer: Vec<u8>,
}

impl Rows {
    /// Opens a file.
    pub fn open(file: &Path, format: &Format) -> Result<Rows, ModelError> {
        let fault = |message: String, help: &str| ModelError::Input {
            place: Place::file(file),
            message,
            help: Some(help.into()),
        };
        let opened = File::open(file).and_then(|opened| {
            let found = opened.metadata()?;
            if found.is_dir() {
                return Err(std::io::Error::other("it is a folder"));
            }
            Ok((opened, found))
        });
        let (opened, found) = opened.map_err(|cause| {
            fault(
                format!("the data file cannot be read: {cause}"),
                "check `data` and the file",
            )
        })?;
        if found.len() > MOST_BYTES {
            return Err(fault(
                format!("a data file of {} bytes; {MOST_BYTES} is the most that is read", found.len()),
                SPLIT,
            ));
        }
        Ok(Rows {
            file: file.to_path_buf(),
            separator: format.separator,
            stamp: Stamp::of(file, &found),
            reader: BufReader::with_capacity(1 << 16, opened),
            line: 0,
            rows: 0,
            byte: 0,
            buffer: Vec::new(),
        })
    }

    /// The file as it was when it was opened.
    pub fn stamp(&self) -> &Stamp {
        &self.stamp
    }

    /// The next row, or `None` at the end.
    pub fn next_row(&mut self) -> Result<Option<Row>, ModelError> {
        loop {
            let start = self.byte;
            let Some(text) = self.next_line()? else {
                return Ok(None);
            };
            let content = text.trim();
            if content.is_empty() || content.starts_with('#') {
                continue;
            }
            let cells = if text.contains('"') {
                self.quoted(&text)?
            } else {
                text.split(char::from(self.separator))
                    .map(|cell| cell.trim().to_string())
                    .collect()
            };
            self.rows += 1;
            if self.rows > MOST_ROWS {
                return Err(self.fault(format!("a row beyond {MOST_ROWS}, the most that are read"), SPLIT));
            }
            return Ok(Some(Row {
                line: self.line,
                cells,
                start,
                text,
            }));
        }
    }

    fn next_line(&mut self) -> Result<Option<String>, ModelError> {
        self.buffer.clear();
        let read = self
            .reader
            .by_ref()
            .take(LONGEST_LINE)
            .read_until(b'\n', &mut self.buffer)
            .map_err(|cause| self.fault(format!("the data file cannot be read: {cause}"), "try again"))?;
        if read == 0 {
            self.stamp.check(self.reader.get_ref())?;
            return Ok(None);
        }
        self.line += 1;
        self.byte += read;
        // A pipe does not say how much there is to come.
        if self.byte as u64 > MOST_BYTES {
            return Err(self.fault(format!("more than {MOST_BYTES} bytes, the most that are read"), SPLIT));
        }
        if read as u64 == LONGEST_LINE && self.buffer.last() != Some(&b'\n') {
            return Err(self.fault(
                format!("a line of more than {LONGEST_LINE} bytes"),
                "a data file has a line for each reading; is it one?",
            ));
        }
        let mut bytes = self.buffer.as_slice();
        if self.line == 1 {
            bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        }
        let bytes = bytes.strip_suffix(b"\n").unwrap_or(bytes);
        let bytes = bytes.strip_suffix(b"\r").unwrap_or(bytes);
        // Foreign headers come in all encodings; a cell that is read as a number has to be ASCII anyhow.
        Ok(Some(String::from_utf8_lossy(bytes).into_owned()))
    }

    fn quoted(&self, text: &str) -> Result<Vec<String>, ModelError> {
        let mut record = csv::StringRecord::new();
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .delimiter(self.separator)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        match reader.read_record(&mut record) {
            Ok(true) => Ok(record.iter().map(str::to_string).collect()),
            Ok(false) => Ok(Vec::new()),
            Err(cause) => Err(self.fault(
                format!("quotes that cannot be read: {cause}"),
                "a quoted cell begins and ends on its line",
            )),
        }
    }

    fn fault(&self, message: String, help: &str) -> ModelError {
        ModelError::Input {
            place: Place::line(&self.file, self.line),
            message,
            help: Some(help.to_string()),
        }
    }
}
