//! Tables on the terminal: aligned columns under a header.

use abbe::model::words::{cut, shortened};

use crate::report::table::{Align, Table};

/// Largest width of a cell, in characters. A longer text is cut with an ellipsis; CSV and JSON hold it whole.
const MAX_WIDTH: usize = 160;

/// The table without its title: one line per row under the header, then the notes, without a line end at the end.
pub fn text(table: &Table) -> String {
    let shown = |text: &str| cut(text, MAX_WIDTH).into_owned();
    let header: Vec<String> = table.columns.iter().map(|column| shown(&column.heading)).collect();
    let rows: Vec<Vec<String>> =
        table.rows.iter().map(|row| row.iter().map(|cell| shown(&cell.to_string())).collect()).collect();
    let mut width: Vec<usize> = header.iter().map(|cell| cell.chars().count()).collect();
    for row in &rows {
        for (w, cell) in width.iter_mut().zip(row) {
            *w = (*w).max(cell.chars().count());
        }
    }
    let line = |cells: &Vec<String>| {
        let aligned = cells.iter().zip(&table.columns).zip(&width).map(|((cell, column), width)| match column.align {
            Align::Left => format!("{cell:<width$}"),
            Align::Right => format!("{cell:>width$}"),
        });
        format!("  {}", aligned.collect::<Vec<_>>().join("  ")).trim_end().to_string()
    };
    let notes = table.notes.iter().map(|note| format!("  {}", shortened(note)));
    std::iter::once(&header).chain(&rows).map(line).chain(notes).collect::<Vec<_>>().join("\n")
}
