//! The registry of data formats.

use std::path::Path;

use super::ballbar_xml::BallBarXml;
use super::csv::Csv;
use super::format::DataFormat;
use super::json_lines::JsonLines;
use super::mmt::Mmt;
use super::spreadsheet::Spreadsheet;
use super::tpoint::TPoint;
use crate::store::Store;

/// Every format but CSV, which reads what no other format does.
const FORMATS: &[&dyn DataFormat] = &[
    &Spreadsheet, // XLSX, XLSM, XLSB, XLS, ODS
    &BallBarXml,  // B5R, XML
    &JsonLines,   // JSONL, NDJSON
    &TPoint,      // DAT, observations of TPOINT
    &Mmt,         // DAT, records of the MMT
];

/// The format of a file.
pub(super) fn of(file: &Path, store: &Store) -> &'static dyn DataFormat {
    FORMATS.iter().copied().find(|format| format.reads(file, store)).unwrap_or(&Csv)
}
