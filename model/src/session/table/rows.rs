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
/// How long a file may be.
#[derive(Clone, Copy)]
struct Limits {
    bytes: u64,
    rows: usize,
}

const LIMITS: Limits = Limits {
    bytes: 2 << 30,
    // A header and ten million readings.
    rows: 10_000_001,
};

/// What to do with a file that is too long.
const SPLIT: &str = "leave out readings (every tenth will do), or split the file over several tests";

/// One row.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// Its line, from 1.
    pub line: usize,
    /// Its cells, without the spaces around them.
    pub cells: Vec<String>,
    /// The bytes of the file that the line takes, without byte-order mark and line end.
    bytes: Range<usize>,
    /// The line as it stands; what is not UTF-8 is replaced.
    text: String,
}

impl Row {
    /// A row that stands in no text: of a sheet.
    pub fn of_cells(line: usize, cells: Vec<String>) -> Row {
        Row {
            line,
            cells,
            bytes: 0..0,
            text: String::new(),
        }
    }

    /// The bytes of the file that a cell takes, where no quotes hide them.
    pub fn span(&self, cell: usize) -> Option<Range<usize>> {
        let cell = self.cells.get(cell).filter(|cell| !cell.is_empty())?;
        let mut found = self.text.match_indices(cell.as_str());
        let (at, _) = found.next()?;
        // The same text twice in the line leaves in doubt which one is meant; what was replaced may have moved the cell.
        if found.next().is_some() || self.text.len() != self.bytes.len() {
            return Some(self.bytes.clone());
        }
        let start = self.bytes.start + at;
        Some(start..start + cell.len())
    }
}

/// The rows of a file: no comments, no empty lines.
pub(super) struct Rows {
    file: PathBuf,
    separator: u8,
    reader: BufReader<File>,
    stamp: Stamp,
    limits: Limits,
    line: usize,
    rows: usize,
    byte: usize,
    buffer: Vec<u8>,
}

impl Rows {
    /// Opens a file.
    pub fn open(file: &Path, format: &Format) -> Result<Rows, ModelError> {
        Self::within(file, format, LIMITS)
    }

    fn within(file: &Path, format: &Format, limits: Limits) -> Result<Rows, ModelError> {
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
        if found.len() > limits.bytes {
            return Err(fault(
                format!(
                    "a data file of {} bytes; {} is the most that is read",
                    found.len(),
                    limits.bytes
                ),
                SPLIT,
            ));
        }
        Ok(Rows {
            file: file.to_path_buf(),
            separator: format.separator,
            stamp: Stamp::of(file, &found),
            limits,
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
            let Some((bytes, text)) = self.next_line()? else {
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
            if self.rows > self.limits.rows {
                let most = self.limits.rows;
                return Err(self.fault(format!("a row beyond {most}, the most that are read"), SPLIT));
            }
            return Ok(Some(Row {
                line: self.line,
                cells,
                bytes,
                text,
            }));
        }
    }

    /// The next line and the bytes of the file that it takes.
    fn next_line(&mut self) -> Result<Option<(Range<usize>, String)>, ModelError> {
        let mut start = self.byte;
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
        if self.byte as u64 > self.limits.bytes {
            let most = self.limits.bytes;
            return Err(self.fault(format!("more than {most} bytes, the most that are read"), SPLIT));
        }
        if read as u64 == LONGEST_LINE && self.buffer.last() != Some(&b'\n') {
            return Err(self.fault(
                format!("a line of more than {LONGEST_LINE} bytes"),
                "a data file has a line for each reading; is it one?",
            ));
        }
        let mut bytes = self.buffer.as_slice();
        if self.line == 1 {
            if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
                return Err(self.fault("the file is UTF-16".into(), "save it as UTF-8"));
            }
            if let Some(behind) = bytes.strip_prefix(b"\xef\xbb\xbf") {
                start += bytes.len() - behind.len();
                bytes = behind;
            }
        }
        let bytes = bytes.strip_suffix(b"\n").unwrap_or(bytes);
        let bytes = bytes.strip_suffix(b"\r").unwrap_or(bytes);
        if bytes.contains(&b'\r') {
            return Err(self.fault(
                "a carriage return within a line".into(),
                "save the file with lines that end in LF or CRLF",
            ));
        }
        // Foreign headers come in all encodings; a cell that is read as a number has to be ASCII anyhow.
        let text = String::from_utf8_lossy(bytes).into_owned();
        Ok(Some((start..start + bytes.len(), text)))
    }

    fn quoted(&self, text: &str) -> Result<Vec<String>, ModelError> {
        if text.matches('"').count() % 2 == 1 {
            return Err(self.fault(
                "a quote without its end".into(),
                "a quoted cell begins and ends on its line",
            ));
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a file with small limits; the number of rows, or the message.
    fn read(text: &str, limits: Limits, meanwhile: impl Fn(&Path)) -> Result<usize, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("data.csv");
        std::fs::write(&file, text).unwrap();
        let mut rows = Rows::within(&file, &Format::default(), limits).map_err(|fault| fault.to_string())?;
        meanwhile(&file);
        let mut count = 0;
        while rows.next_row().map_err(|fault| fault.to_string())?.is_some() {
            count += 1;
        }
        Ok(count)
    }

    #[test]
    fn a_file_at_its_limits_is_read_and_one_beyond_them_is_refused() {
        let limits = Limits { bytes: 12, rows: 3 };
        let still = |_: &Path| {};
        assert_eq!(read("1,2\n3,4\n5,6\n", limits, still), Ok(3));
        let long = read("1,2\n3,4\n5,67\n", limits, still).unwrap_err();
        assert!(
            long.ends_with("a data file of 13 bytes; 12 is the most that is read"),
            "{long}"
        );
        let many = read("1\n2\n3\n4\n", limits, still).unwrap_err();
        assert!(
            many.ends_with("data.csv:4: a row beyond 3, the most that are read"),
            "{many}"
        );
    }

    #[test]
    fn a_cell_is_pointed_at_behind_a_byte_order_mark_and_beside_what_is_not_utf_8() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("data.csv");
        std::fs::write(&file, b"\xef\xbb\xbf0,pq\r\n\xb5\xb5m,7\n").unwrap();
        let mut rows = Rows::within(&file, &Format::default(), LIMITS).unwrap();
        let first = rows.next_row().unwrap().unwrap();
        assert_eq!(first.span(1), Some(5..7));
        // The whole line, since two bytes stand where six do in the text.
        let second = rows.next_row().unwrap().unwrap();
        assert_eq!(second.span(1), Some(9..14));
    }

    #[test]
    fn a_file_that_changes_while_it_is_read_is_refused() {
        let append = |file: &Path| {
            let mut open = std::fs::OpenOptions::new().append(true).open(file).unwrap();
            std::io::Write::write_all(&mut open, b"5,6\n").unwrap();
        };
        let changed = read("1,2\n3,4\n", LIMITS, append).unwrap_err();
        assert!(
            changed.ends_with("the file changed while it was read"),
            "{changed}"
        );
        let cut = |file: &Path| std::fs::write(file, "1,2\n").unwrap();
        let changed = read("1,2\n3,4\n", LIMITS, cut).unwrap_err();
        assert!(
            changed.ends_with("the file changed while it was read"),
            "{changed}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_vanishes_while_it_is_read_is_read_to_its_end() {
        let gone = |file: &Path| std::fs::remove_file(file).unwrap();
        assert_eq!(read("1,2\n3,4\n", LIMITS, gone), Ok(2));
    }
}
