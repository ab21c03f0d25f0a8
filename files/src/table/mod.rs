//! Data files: tables of readings in any format, and foreign files through `[format]` and `[columns]`.
//!
//! - `format`: what a data format is; `formats`: the registry; one module per format: `csv`, `spreadsheet`,
//!   `ballbar_xml`, `json_lines`, `tpoint`, `mmt`;
//! - `request`: what a test requires of its file; `columns`, `required`: roles of columns; `fill`: readings
//!   from rows;
//! - [`memory`]: columns in memory in place of a file; `missing`: readings that they lack;
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
mod missing;
mod mmt;
pub(crate) mod number;
pub(crate) mod request;
mod required;
mod row;
mod spreadsheet;
mod tpoint;

use std::path::Path;

use abbe_model::Diagnostic;
use abbe_model::instrument::column::Quantity;
use fill::{BySocket, Filling};
use format::Content;
use request::Request;

use crate::stamp::FileStamp;

/// The content of a data file.
pub(crate) struct Data {
    /// The state of the file when it was read.
    pub stamp: FileStamp,
    /// Its readings: one set per socket in the file, else one.
    pub by_socket: BySocket,
    /// The columns of readings that it has.
    pub quantities: Vec<Quantity>,
    /// Warnings about the file.
    pub warnings: Vec<String>,
}

/// Reads a data file.
///
/// # Errors
/// Every fault that prevents the use of the file, with its line and what to do.
pub(crate) fn read(file: &Path, request: &Request<'_>) -> Result<Data, Diagnostic> {
    match formats::of(file, request.store).open(file, request)? {
        Content::Table(mut table) => {
            let Filling { by_socket, quantities, warnings } =
                fill::read(file, table.rows.as_mut(), table.has_header, request)?;
            Ok(Data { stamp: table.stamp, by_socket, quantities, warnings: request.named(warnings) })
        }
        Content::Readings(whole) => {
            let by_socket = vec![(None, whole.readings)];
            Ok(Data { stamp: whole.stamp, by_socket, quantities: Vec::new(), warnings: whole.warnings })
        }
    }
}
