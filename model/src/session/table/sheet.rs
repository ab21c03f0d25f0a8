//! Spreadsheets (XLSX, XLS, ODS) as rows of cells, read by calamine.
//!
//! The first row that is not empty is the header; a row whose first cell begins with `#` is a comment. What a cell shows is of no account: a
//! number is read with all its digits, a formula by its last value.

use std::path::Path;

use calamine::{Data, Reader, open_workbook_auto};

use super::Format;
use super::rows::Row;
use crate::error::{ModelError, Place};

/// Whether a file is a spreadsheet, by its name.
pub(super) fn is_spreadsheet(file: &Path) -> bool {
    let extension = file
        .extension()
        .map(|extension| extension.to_string_lossy().to_lowercase());
    matches!(
        extension.as_deref(),
        Some("xlsx" | "xlsm" | "xlsb" | "xls" | "ods")
    )
}

/// The rows of a sheet.
pub(super) fn rows(file: &Path, format: &Format) -> Result<Vec<Row>, ModelError> {
    let fault = |message: String, help: String| ModelError::Input {
        place: Place::file(file),
        message,
        help: Some(help),
    };
    let broken = |cause: calamine::Error| {
        fault(
            format!("the spreadsheet cannot be read: {cause}"),
            "check that it opens in a spreadsheet program, or export it as CSV".into(),
        )
    };
    let mut book = open_workbook_auto(file).map_err(broken)?;
    let names = book.sheet_names();
    let wanted: Vec<String> = match &format.sheet {
        Some(name) if names.contains(name) => vec![name.clone()],
        Some(name) => {
            return Err(fault(
                format!("there is no sheet `{name}`"),
                format!("it has {}", names.join(", ")),
            ));
        }
        None => names.clone(),
    };
    let mut found: Vec<(String, Vec<Row>)> = Vec::new();
    for name in wanted {
        let range = book.worksheet_range(&name).map_err(broken)?;
        let (top, width) = (range.start().map_or(0, |start| start.0 as usize), range.width());
        let rows: Vec<Row> = range
            .rows()
            .enumerate()
            .filter(|(_, cells)| cells.iter().any(|cell| *cell != Data::Empty))
            .filter(
                |(_, cells)| !matches!(&cells[0], Data::String(text) if text.trim_start().starts_with('#')),
            )
            .map(|(index, cells)| {
                let mut cells: Vec<String> = cells.iter().map(|cell| text(cell, format)).collect();
                cells.resize(width, String::new());
                Row::of_cells(top + index + 1, cells)
            })
            .collect();
        if !rows.is_empty() {
            found.push((name, rows));
        }
    }
    match found.len() {
        0 | 1 => Ok(found.pop().map(|(_, rows)| rows).unwrap_or_default()),
        _ => {
            let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
            Err(fault(
                format!("several sheets hold cells: {}", names.join(", ")),
                format!("say which one: `[format] sheet = \"{}\"`", names[0]),
            ))
        }
    }
}

/// A cell as it would stand in a CSV file of this format.
fn text(cell: &Data, format: &Format) -> String {
    let number = |text: String| {
        if format.decimal == b',' {
            text.replace('.', ",")
        } else {
            text
        }
    };
    match cell {
        Data::Empty => String::new(),
        Data::String(text) => text.trim().to_string(),
        Data::Int(value) => value.to_string(),
        Data::Float(value) => number(value.to_string()),
        Data::Bool(truth) => truth.to_string(),
        Data::DateTime(_) => "a date".into(),
        Data::DateTimeIso(text) | Data::DurationIso(text) => text.clone(),
        Data::Error(error) => format!("the error {error}"),
    }
}
