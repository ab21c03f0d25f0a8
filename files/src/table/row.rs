//! The rows of a data file.

use std::ops::Range;

use abbe_model::Diagnostic;
use encoding_rs::Encoding;

use super::lines::Line;

/// The rows of a file, one after another. All have the same number of cells.
pub(super) trait Rows {
    /// The next row, or `None` at the end.
    ///
    /// # Errors
    /// If the next line is not a row of the format, or beyond a limit.
    fn next_row(&mut self) -> Result<Option<Row>, Diagnostic>;

    /// Takes a row that is no longer needed, so that the next one can use its memory: a file has millions of them.
    fn reuse(&mut self, _: Row) {}
}

/// One row: its cells, and their place in the file.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// Its line, from 1.
    pub line: usize,
    /// Its cells, without surrounding spaces.
    pub cells: Vec<String>,
    /// Whether cells are found by a key in their row instead of the number of their column.
    pub keyed: bool,
    /// The bytes of the line in the file, without byte order mark and line end.
    bytes: Range<usize>,
    /// The text of the line.
    text: String,
    /// The encoding, if the line is not plain ASCII.
    pub encoding: Option<&'static Encoding>,
}

impl Row {
    /// A row of a file that has no text, such as a spreadsheet.
    pub fn of_cells(line: usize, cells: Vec<String>) -> Row {
        Row { line, cells, keyed: false, bytes: 0..0, text: String::new(), encoding: None }
    }

    /// A row that is a line of a text.
    pub fn of_line(line: Line, cells: Vec<String>) -> Row {
        Row { line: line.number, cells, keyed: false, bytes: line.bytes, encoding: line.encoding, text: line.text }
    }

    /// The row, with cells that are found by a key.
    pub fn with_keys(self) -> Row {
        Row { keyed: true, ..self }
    }

    /// The place of a cell in messages; `name` is that of its column.
    pub fn place(&self, cell: usize, name: &str) -> String {
        if self.keyed { format!("key `{name}`") } else { format!("column {} (`{name}`)", cell + 1) }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn row(text: &str, bytes: Range<usize>) -> Row {
        let cells = text.split(',').map(|cell| cell.trim().to_string()).collect();
        Row::of_line(Line { number: 3, text: text.to_string(), bytes, encoding: None }, cells)
    }

    /// A message points at the cell; at the whole line if the text of the cell occurs twice, or another encoding has moved
    /// it; nowhere if there is no cell.
    #[test]
    fn the_bytes_of_a_cell_are_its_place_in_the_file() {
        let plain = row("1, 90.5,abc", 20..31);
        assert_eq!(plain.span(0), Some(20..21));
        assert_eq!(plain.span(1), Some(23..27));
        assert_eq!(plain.span(2), Some(28..31));
        assert_eq!(plain.span(3), None);
        assert_eq!(row("1,10", 20..24).span(0), Some(20..24));
        assert_eq!(row("1,,3", 20..24).span(1), None);
        assert_eq!(row("1,abc", 20..30).span(1), Some(20..30));
        assert_eq!(Row::of_cells(1, vec!["7".into()]).span(0), None);
    }

    #[test]
    fn a_cell_is_named_by_its_column_or_its_key() {
        let plain = row("1,2", 0..3);
        assert_eq!(plain.place(1, "c_deg"), "column 2 (`c_deg`)");
        assert_eq!(plain.with_keys().place(1, "c_deg"), "key `c_deg`");
    }
}
