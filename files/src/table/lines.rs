//! Lines of a text file, read one at a time within the limits of a data file.

use std::io::{BufRead, BufReader, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};

use abbe_model::diagnostic::{Diagnostic, Location};
use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE};

use super::encoding;
use super::request::Format;
use crate::stamp::FileStamp;
use crate::store::{OpenFile, Store};

/// Largest length of one line, bytes.
const LONGEST_LINE: u64 = 1 << 20;
/// Limits of the size of a file.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    pub bytes: u64,
    pub rows: usize,
}

pub(super) const LIMITS: Limits = Limits {
    bytes: 2 << 30,
    // A header and ten million readings.
    rows: 10_000_001,
};

/// The remedy for a file that is too long.
const SPLIT: &str = "thin out the readings (every tenth is enough), or split the file into several tests";

/// One line.
pub(super) struct Line {
    /// Its number, from 1.
    pub number: usize,
    /// Its text, without line end.
    pub text: String,
    /// Its bytes in the file, without byte order mark and line end.
    pub bytes: Range<usize>,
    /// The encoding, if the line is not plain ASCII.
    pub encoding: Option<&'static Encoding>,
}

/// The lines of a file below those that are skipped.
pub(super) struct Lines {
    file: PathBuf,
    /// As stated or by the byte order mark. `None` means UTF-8, or Latin-1 from the first line that is not UTF-8.
    encoding: Option<&'static Encoding>,
    /// Number of lines of the file still to be skipped.
    skip: usize,
    reader: BufReader<OpenFile>,
    stamp: FileStamp,
    limits: Limits,
    line: usize,
    rows: usize,
    byte: usize,
    buffer: Vec<u8>,
}

impl Lines {
    /// Opens a file.
    pub fn open(store: &Store, file: &Path, format: &Format) -> Result<Lines, Diagnostic> {
        Self::within(store, file, format, LIMITS)
    }

    /// Opens a file with other limits.
    pub fn within(store: &Store, file: &Path, format: &Format, limits: Limits) -> Result<Lines, Diagnostic> {
        let fault = |message: String, help: &str| Diagnostic::input(Location::file(file), message, help);
        let opened = store.open(file).and_then(|opened| {
            let found = opened.state()?;
            if found.folder {
                return Err(std::io::Error::other("it is a folder"));
            }
            Ok((opened, found))
        });
        let (opened, found) = opened
            .map_err(|cause| fault(format!("the data file cannot be read: {cause}"), "check `data` and the file"))?;
        if found.bytes > limits.bytes {
            return Err(fault(format!("a data file of {} bytes; the limit is {}", found.bytes, limits.bytes), SPLIT));
        }
        Ok(Lines {
            file: file.to_path_buf(),
            encoding: format.encoding,
            skip: format.skip_lines,
            stamp: FileStamp::of(file, found),
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

    /// The next line, or `None` at the end.
    pub fn next_line(&mut self) -> Result<Option<Line>, Diagnostic> {
        loop {
            let Some(bytes) = self.read_line()? else {
                return Ok(None);
            };
            if self.skip > 0 {
                self.skip -= 1;
                continue;
            }
            let text = self.decoded()?;
            return Ok(Some(Line {
                number: self.line,
                bytes,
                encoding: (!text.is_ascii()).then_some(self.encoding.unwrap_or(UTF_8)),
                text,
            }));
        }
    }

    /// Counts the line that was read last as a row, within the largest number of rows.
    pub fn count_row(&mut self) -> Result<(), Diagnostic> {
        self.rows += 1;
        if self.rows > self.limits.rows {
            let most = self.limits.rows;
            return Err(self.fault(format!("more than {most} rows, which is the limit"), SPLIT));
        }
        Ok(())
    }

    /// Reads the next line into the buffer, without byte order mark and line end; returns its bytes in the file.
    fn read_line(&mut self) -> Result<Option<Range<usize>>, Diagnostic> {
        let mut start = self.byte;
        self.buffer.clear();
        self.until_line_end()?;
        let mut read = self.buffer.len();
        if read == 0 {
            self.stamp.finish(self.reader.get_ref())?;
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
    fn until_line_end(&mut self) -> Result<(), Diagnostic> {
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
        self.encoding.is_some_and(|encoding| encoding == UTF_16LE || encoding == UTF_16BE)
    }

    /// Whether the buffer ends with this character.
    fn ends_with(&self, character: u8) -> bool {
        let bytes = &self.buffer;
        match self.encoding {
            Some(encoding) if encoding == UTF_16LE => bytes.len().is_multiple_of(2) && bytes.ends_with(&[character, 0]),
            Some(encoding) if encoding == UTF_16BE => bytes.len().is_multiple_of(2) && bytes.ends_with(&[0, character]),
            _ => bytes.last() == Some(&character),
        }
    }

    /// The buffer as text.
    fn decoded(&mut self) -> Result<String, Diagnostic> {
        let (text, found) = encoding::decode(&self.buffer, self.encoding).map_err(|encoding| {
            let name = encoding::name_of(encoding);
            let help = "declare the encoding of the file, such as `[format] encoding = \"latin1\"`";
            self.fault(format!("the line is not valid {name}"), help)
        })?;
        let text = text.into_owned();
        if text.contains('\r') {
            return Err(self.fault("a carriage return within a line".into(), "save the file with line ends LF or CRLF"));
        }
        // One line that is not UTF-8 determines the encoding of all that follow.
        if found != UTF_8 {
            self.encoding = Some(found);
        }
        Ok(text)
    }

    /// An error in the line that was read last.
    pub fn fault(&self, message: String, help: &str) -> Diagnostic {
        Diagnostic::input(Location::line(&self.file, self.line), message, help)
    }
}
