//! One row of a data file.

use std::ops::Range;

use encoding_rs::Encoding;

use super::lines::Line;

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
