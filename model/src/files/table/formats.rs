//! The registry of data formats.

use std::path::Path;

use super::ballbar_xml::BallBarXml;
use super::csv::Csv;
use super::format::DataFormat;
use super::json_lines::JsonLines;
use super::spreadsheet::Spreadsheet;

/// Every format but CSV, which reads what no other format does.
const FORMATS: &[&dyn DataFormat] = &[
    &Spreadsheet, // XLSX, XLSM, XLSB, XLS, ODS
    &BallBarXml,  // B5R, XML
    &JsonLines,   // JSONL, NDJSON
];

/// The format of a file.
pub(super) fn of(file: &Path) -> &'static dyn DataFormat {
    FORMATS.iter().copied().find(|format| format.reads(file)).unwrap_or(&Csv)
}
