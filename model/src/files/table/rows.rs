//! Rows of cells from a file, read one line at a time.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE};

use super::{Format, encoding};
use crate::error::{Location, ModelError};
use crate::files::stamp::FileStamp;

/// Largest length of one line, bytes.
const LONGEST_LINE: u64 = 1 << 20;
/// Limits of the size of a file.
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

/// The remedy for a file that is too long.
const SPLIT: &str = "thin out the readings (every tenth is enough), or split the file into several tests";

/// One row.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// Its line, from 1.
    pub line: usize,
    /// Its cells, without surrounding spaces.
    pub cells: Vec<String>,
    /// The bytes of the line in the file, without byte order mark and line end.
    bytes: Range<usize>,
    /// The text of the line.
    text: String,
    /// The encoding, if the line is not plain ASCII.
    pub encoding: Option<&'static Encoding>,
}

impl Row {
    /// A row of a spreadsheet, which has no text.
    pub fn of_cells(line: usize, cells: Vec<String>) -> Row {
        Row {
            line,
            cells,
            bytes: 0..0,
            text: String::new(),
            encoding: None,
        }
    }

    /// The bytes of a cell in the file, if it is not quoted.
    pub fn span(&self, cell: usize) -> Option<Range<usize>> {
        let cell = self.cells.get(cell).filter(|cell| !cell.is_empty())?;
        let mut found = self.text.match_indices(cell.as_str());
        let (at, _) = found.next()?;
        // If the same text occurs twice in the line, the cell is ambiguous; another encoding may have moved it.
        if found.next().is_some() || self.text.len() != self.bytes.len() {
            return Some(self.bytes.clone());
        }
        let start = self.bytes.start + at;
        Some(start..start + cell.len())
    }
}

/// The rows of a file, without comments and empty lines.
pub(super) struct Rows {
    file: PathBuf,
    separator: u8,
    /// As stated or by the byte order mark. `None` means UTF-8, or Latin-1 from the first line that is not UTF-8.
    encoding: Option<&'static Encoding>,
    /// Number of lines of the file still to be skipped.
    skip: usize,
    reader: BufReader<File>,
    stamp: FileStamp,
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
            location: Location::file(file),
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
                    "a data file of {} bytes; the limit is {}",
                    found.len(),
                    limits.bytes
                ),
                SPLIT,
            ));
        }
        Ok(Rows {
            file: file.to_path_buf(),
            separator: format.separator,
            encoding: format.encoding,
            skip: format.skip_lines,
            stamp: FileStamp::of(file, &found),
            limits,
            reader: BufReader::with_capacity(1 << 16, opened),
            line: 0,
            rows: 0,
            byte: 0,
            buffer: Vec::new(),
        })
    }

    /// The state of the file when it was opened.
    pub fn stamp(&self) -> &FileStamp {
        &self.stamp
    }

    /// The next row, or `None` at the end.
    pub fn next_row(&mut self) -> Result<Option<Row>, ModelError> {
        loop {
            let Some(bytes) = self.next_line()? else {
                return Ok(None);
            };
            if self.skip > 0 {
                self.skip -= 1;
                continue;
            }
            let text = self.decoded()?;
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
                return Err(self.fault(format!("more than {most} rows, which is the limit"), SPLIT));
            }
            return Ok(Some(Row {
                line: self.line,
                cells,
                bytes,
                encoding: (!text.is_ascii()).then_some(self.encoding.unwrap_or(UTF_8)),
                text,
            }));
        }
    }

    /// Reads the next line into the buffer, without byte order mark and line end; returns its bytes in the file.
    fn next_line(&mut self) -> Result<Option<Range<usize>>, ModelError> {
        let mut start = self.byte;
        self.buffer.clear();
        self.until_line_end()?;
        let mut read = self.buffer.len();
        if read == 0 {
            self.stamp.check(self.reader.get_ref())?;
            return Ok(None);
        }
        self.line += 1;
        if self.line == 1 {
            let (found, mark) = encoding::of_start(&self.buffer, self.encoding);
            self.encoding = found;
            // The position of the line end is known only after decoding.
            if self.is_wide() {
                self.until_line_end()?;
                read = self.buffer.len();
            }
            start += mark;
            self.buffer.drain(..mark);
        }
        self.byte += read;
        // The length of a pipe is unknown in advance.
        if self.byte as u64 > self.limits.bytes {
            let most = self.limits.bytes;
            return Err(self.fault(format!("more than {most} bytes, which is the limit"), SPLIT));
        }
        if self.buffer.len() as u64 >= LONGEST_LINE && !self.ends_with(b'\n') {
            return Err(self.fault(
                format!("a line of more than {LONGEST_LINE} bytes"),
                "a data file has one line per reading; check that it is a data file",
            ));
        }
        for end in [b'\n', b'\r'] {
            if self.ends_with(end) {
                let unit = if self.is_wide() { 2 } else { 1 };
                self.buffer.truncate(self.buffer.len() - unit);
            }
        }
        Ok(Some(start..start + self.buffer.len()))
    }

    /// Reads until the buffer ends with a line end in the encoding of the file, or contains the longest line.
    fn until_line_end(&mut self) -> Result<(), ModelError> {
        while !self.ends_with(b'\n') && (self.buffer.len() as u64) < LONGEST_LINE {
            let room = LONGEST_LINE - self.buffer.len() as u64;
            let cut_short = self.encoding == Some(UTF_16LE) && self.buffer.last() == Some(&b'\n');
            let mut part = self.reader.by_ref().take(if cut_short { 1 } else { room });
            let read = part
                .read_until(b'\n', &mut self.buffer)
                .map_err(|cause| self.fault(format!("the data file cannot be read: {cause}"), "try again"))?;
            if read == 0 {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Whether a character takes two bytes.
    fn is_wide(&self) -> bool {
        self.encoding
            .is_some_and(|encoding| encoding == UTF_16LE || encoding == UTF_16BE)
    }

    /// Whether the buffer ends with this character.
    fn ends_with(&self, character: u8) -> bool {
        let bytes = &self.buffer;
        match self.encoding {
            Some(encoding) if encoding == UTF_16LE => {
                bytes.len().is_multiple_of(2) && bytes.ends_with(&[character, 0])
            }
            Some(encoding) if encoding == UTF_16BE => {
                bytes.len().is_multiple_of(2) && bytes.ends_with(&[0, character])
            }
            _ => bytes.last() == Some(&character),
        }
    }

    /// The buffer as text.
    fn decoded(&mut self) -> Result<String, ModelError> {
        let (text, found) = encoding::decode(&self.buffer, self.encoding).map_err(|encoding| {
            let name = encoding::name_of(encoding);
            let help = "declare the encoding of the file, such as `[format] encoding = \"latin1\"`";
            self.fault(format!("the line is not valid {name}"), help)
        })?;
        let text = text.into_owned();
        if text.contains('\r') {
            return Err(self.fault(
                "a carriage return within a line".into(),
                "save the file with line ends LF or CRLF",
            ));
        }
        // One line that is not UTF-8 determines the encoding of all that follow.
        if found != UTF_8 {
            self.encoding = Some(found);
        }
        Ok(text)
    }

    fn quoted(&self, text: &str) -> Result<Vec<String>, ModelError> {
        if text.matches('"').count() % 2 == 1 {
            return Err(self.fault(
                "a quote is not closed".into(),
                "a quoted cell must end on its line",
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
                format!("invalid quotes: {cause}"),
                "a quoted cell must end on its line",
            )),
        }
    }

    fn fault(&self, message: String, help: &str) -> ModelError {
        ModelError::Input {
            location: Location::line(&self.file, self.line),
            message,
            help: Some(help.to_string()),
        }
    }
}

#[cfg(test)]
mod tests;
