//! Data files: tables of readings in any format, and foreign files through `[format]` and `[columns]`.
//!
//! - `format`: what a data format is; `formats`: the registry; one module per format: `csv`, `spreadsheet`,
//!   `ballbar_xml`, `json_lines`, `tpoint`, `mmt`;
//! - `request`: what a test requires of its file; `columns`, `required`: roles of columns; `fill`: readings
//!   from rows;
//! - [`memory`]: columns in memory in place of a file; their missing readings;
//! - `lines`, `encoding`, `comment`, `row`, `number`: lines of a text, rows and cells.

mod ballbar_xml;
pub(crate) mod columns;
pub(crate) mod comment;
pub mod csv;
mod duplicates;
pub(crate) mod encoding;
pub(crate) mod fill;
mod format;
mod formats;
mod json_lines;
mod lines;
pub mod memory;
mod mmt;
pub(crate) mod number;
pub(crate) mod request;
mod required;
mod row;
mod spreadsheet;
mod tpoint;

use std::path::Path;

use abbe_model::Diagnostic;
use fill::Filling;
use format::Content;
use request::Request;

use crate::stamp::FileStamp;

/// Reads a data file: its state when it was read, and its readings.
///
/// # Errors
/// Every fault that prevents the use of the file, with its line and what to do.
pub(crate) fn read(file: &Path, request: &Request<'_>) -> Result<(FileStamp, Filling), Diagnostic> {
    let (stamp, content) = formats::of(file, request.store).open(file, request)?;
    let filling = match content {
        Content::Table { mut rows, has_header } => fill::read(file, rows.as_mut(), has_header, request)?,
        Content::Readings(filling) => filling,
    };
    Ok((stamp, filling))
}
