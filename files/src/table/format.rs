//! What a data format is: the one trait that every format implements.
//!
//! A format is one file beside this one and one line in [`formats`](super::formats).

use std::io::Read;
use std::path::Path;

use abbe_model::Diagnostic;

use super::fill::Filling;
use super::request::Request;
use super::row::Rows;
use crate::stamp::FileStamp;
use crate::store::Store;

/// A format of data files.
pub(super) trait DataFormat: Sync {
    /// Whether the format reads this file: by its extension or its first bytes.
    fn reads(&self, file: &Path, store: &Store) -> bool;

    /// Opens the file and returns its state and its rows, or its readings if they are more than a table.
    ///
    /// # Errors
    /// If the file cannot be opened or is not of this format, with its location and what to do.
    fn open(&self, file: &Path, request: &Request<'_>) -> Result<(FileStamp, Content), Diagnostic>;
}

/// The content of a data file.
pub(super) enum Content {
    /// Rows of cells, which become readings by the roles of their columns; the first may name the columns.
    Table { rows: Box<dyn Rows>, has_header: bool },
    /// Readings that the format itself interprets.
    Readings(Filling),
}

/// Whether the name of a file ends in one of these extensions, in any case.
pub(super) fn has_extension(file: &Path, known: &[&str]) -> bool {
    let extension = file.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    extension.is_some_and(|extension| known.contains(&extension.as_str()))
}

/// Bytes at the start of a file from which a format is recognised.
const START_BYTES: u64 = 1024;

/// Whether a file that can be read starts as `expected` says. A pipe, which can be read once, has no format of its own.
pub(super) fn starts_with(file: &Path, store: &Store, expected: impl Fn(&str) -> bool) -> bool {
    if !store.state(file).is_ok_and(|found| found.regular) {
        return false;
    }
    let mut start = Vec::new();
    let read = store.open(file).and_then(|opened| opened.take(START_BYTES).read_to_end(&mut start));
    read.is_ok() && expected(&String::from_utf8_lossy(&start))
}
