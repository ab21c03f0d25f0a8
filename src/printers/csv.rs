//! Tables as CSV: one row per row, numbers with all their places, for spreadsheets.

use crate::report::block::{Body, Report, Text};
use crate::report::table::{Cell, Table};

/// A cell that a spreadsheet takes for text: one that begins as a formula does (`=`, `+`, `-`, `@`) and is no number
/// stands behind an apostrophe. A sign alone, such as a direction of travel, is no formula.
///
/// Names in a table come from session files, which others may have written.
pub fn cell(text: String) -> String {
    let begins = text.trim_start().starts_with(['=', '+', '-', '@']) && text.trim().len() > 1;
    let formula = begins || text.starts_with(['\t', '\r', '\n']);
    if formula && text.parse::<f64>().is_err() { format!("'{text}") } else { text }
}

/// The table as CSV: cells that hold a separator stand in quotes.
///
/// # Errors
/// If a row is not as long as the header.
pub fn text(table: &Table) -> Result<Vec<u8>, String> {
    let fault = |error: csv::Error| error.to_string();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(table.columns.iter().map(|column| cell(column.heading.clone()))).map_err(fault)?;
    for row in &table.rows {
        let missing = table.columns.len().saturating_sub(row.len());
        let cells = row.iter().map(|value| match value {
            Cell::Text(text) => cell(text.clone()),
            Cell::Number(value, Some(places)) => format!("{value:.places$}"),
            Cell::Number(value, None) => value.to_string(),
        });
        let cells = cells.chain(std::iter::repeat_n(String::new(), missing));
        writer.write_record(cells).map_err(fault)?;
    }
    writer.into_inner().map_err(|error| error.to_string())
}

/// The values of a report, or its tables if it has no values; each under a comment with its title.
///
/// # Errors
/// If a row is not as long as the header.
pub fn report(report: &Report) -> Result<Vec<u8>, String> {
    if !report.values.rows.is_empty() {
        return titled(&report.values.title, &report.values);
    }
    let (mut printed, mut heading) = (Vec::new(), "");
    for block in &report.blocks {
        match &block.body {
            Body::Text(Text::Section(words) | Text::Heading(words) | Text::Fold(words)) => heading = words,
            Body::Table(table) => {
                printed.extend(titled(if table.title.is_empty() { heading } else { &table.title }, table)?);
            }
            _ => {}
        }
    }
    Ok(printed)
}

/// A table under its title, each line of which is a comment.
fn titled(title: &str, table: &Table) -> Result<Vec<u8>, String> {
    let comment: String = title.lines().map(|line| format!("# {line}\n")).collect();
    Ok([comment.as_bytes(), &text(table)?].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_may_be_a_formula_stands_behind_an_apostrophe() {
        for plain in ["+", "-", "−3", "-3.5", "+1e-3", "EX0C", "a=b"] {
            assert_eq!(cell(plain.to_string()), plain);
        }
        for formula in ["=1+1", "+A1", "-A1", "@SUM(A1)", " =1", "\tx"] {
            assert_eq!(cell(formula.to_string()), format!("'{formula}"));
        }
    }
}
