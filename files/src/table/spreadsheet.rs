//! Spreadsheets (XLSX, XLS, ODS) as rows of cells, read by calamine.
//!
//! The first row that is not empty is the header; a row whose first cell begins with `#` is a comment. The display
//! format of a cell is ignored: a number is read with all its digits, a formula by its last value.

use std::io::{Cursor, Read, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use abbe_model::diagnostic::{Diagnostic, Location};
use calamine::{Data, Error, Ods, Reader, Sheets, Xls, Xlsb, Xlsx, XlsxError, open_workbook_from_rs};
use zip::ZipArchive;

use super::comment::is_comment;
use super::format::{Content, DataFormat, has_extension};
use super::request::{Format, Request};
use super::row::{Row, Rows};
use crate::stamp::FileStamp;
use crate::store::Store;

/// The format, recognised by the extension of the file.
pub(super) struct Spreadsheet;

impl DataFormat for Spreadsheet {
    fn reads(&self, file: &Path, _: &Store) -> bool {
        has_extension(file, &["xlsx", "xlsm", "xlsb", "xls", "ods"])
    }

    fn open(&self, file: &Path, request: &Request<'_>) -> Result<(FileStamp, Content), Diagnostic> {
        let (stamp, rows) = rows(request.store, file, &request.format)?;
        let rows = Box::new(SheetRows(rows.into_iter()));
        Ok((stamp, Content::Table { rows, has_header: request.format.header }))
    }
}

/// The rows of a sheet that was read as a whole.
struct SheetRows(std::vec::IntoIter<Row>);

impl Rows for SheetRows {
    fn next_row(&mut self) -> Result<Option<Row>, Diagnostic> {
        Ok(self.0.next())
    }
}

/// Largest size of a spreadsheet, bytes.
const MAX_BYTES: u64 = 64 << 20;
/// Largest unpacked size, bytes; the content is held in memory.
const MAX_UNPACKED: u64 = 256 << 20;
/// Largest number of columns.
const MAX_COLUMNS: u32 = 1000;
/// Largest number of filled cells. Each takes about a hundred bytes of memory.
const MAX_FILLED: usize = 5_000_000;
/// Largest number of cells of the rectangle around all filled cells.
const MAX_CELLS: usize = 20_000_000;
/// Largest text between two tags of a part, bytes: a cell has at most 32,767 characters.
const MAX_TEXT: usize = 1 << 20;

/// The rows of a sheet, and the state of the file.
fn rows(store: &Store, file: &Path, format: &Format) -> Result<(FileStamp, Vec<Row>), Diagnostic> {
    let fault = |message: String, help: String| Diagnostic::input(Location::file(file), message, help);
    let broken = |cause: Error| {
        fault(
            format!("the spreadsheet cannot be read: {cause}"),
            "check that it opens in a spreadsheet program, or export it as CSV".into(),
        )
    };
    let found = store.state(file).map_err(|cause| broken(cause.into()))?;
    if !found.regular {
        return Err(broken(std::io::Error::other("it is not a file").into()));
    }
    if found.bytes > MAX_BYTES {
        return Err(fault(
            format!("a spreadsheet of {} bytes; the limit is {MAX_BYTES}", found.bytes),
            "export it as CSV".into(),
        ));
    }
    let mut contents = Vec::new();
    let mut opened = store.open(file).map_err(|cause| broken(cause.into()))?;
    opened.by_ref().take(MAX_BYTES + 1).read_to_end(&mut contents).map_err(|cause| broken(cause.into()))?;
    let stamp = FileStamp::of(file, found);
    stamp.finish(&opened)?;
    unpacks_within(&contents, MAX_UNPACKED).map_err(|message| {
        fault(format!("a spreadsheet that {message}, which is the limit"), "export it as CSV".into())
    })?;
    let mut book = catch_panic(|| workbook(file, contents)).map_err(broken)?;
    let names = book.sheet_names();
    let sheets_to_read: Vec<String> = match &format.sheet {
        Some(name) if names.contains(name) => vec![name.clone()],
        Some(name) => {
            return Err(fault(format!("there is no sheet `{name}`"), format!("it has {}", names.join(", "))));
        }
        None => names.clone(),
    };
    let mut filled: Vec<(String, Vec<Row>)> = Vec::new();
    for name in sheets_to_read {
        let cells = catch_panic(|| cells(&mut book, &name)).map_err(broken)?;
        let rows = by_row(cells, format).map_err(|(message, help)| fault(message, help))?;
        if !rows.is_empty() {
            filled.push((name, rows));
        }
    }
    match filled.len() {
        0 | 1 => Ok((stamp, filled.pop().map(|(_, rows)| rows).unwrap_or_default())),
        _ => {
            let names: Vec<&str> = filled.iter().map(|(name, _)| name.as_str()).collect();
            Err(fault(
                format!("several sheets contain cells: {}", names.join(", ")),
                format!("select one: `[format] sheet = \"{}\"`", names[0]),
            ))
        }
    }
}

/// A spreadsheet in memory.
type Book = Sheets<Cursor<Vec<u8>>>;

/// The spreadsheet of a file, in the format that its extension states.
fn workbook(file: &Path, contents: Vec<u8>) -> Result<Book, Error> {
    let contents = Cursor::new(contents);
    Ok(if has_extension(file, &["xls"]) {
        Sheets::Xls(open_workbook_from_rs::<Xls<_>, _>(contents)?)
    } else if has_extension(file, &["xlsb"]) {
        Sheets::Xlsb(open_workbook_from_rs::<Xlsb<_>, _>(contents)?)
    } else if has_extension(file, &["ods"]) {
        Sheets::Ods(open_workbook_from_rs::<Ods<_>, _>(contents)?)
    } else {
        Sheets::Xlsx(open_workbook_from_rs::<Xlsx<_>, _>(contents)?)
    })
}

/// Unpacks the parts of a ZIP file and forgets them: whether they are within the limits of their size and of their
/// texts. The sizes stated in the file are not trusted. The error says what exceeds a limit.
fn unpacks_within(contents: &[u8], most: u64) -> Result<(), String> {
    // A file that is not ZIP is not packed.
    let Ok(mut archive) = ZipArchive::new(Cursor::new(contents)) else { return Ok(()) };
    let mut left = most;
    for part in 0..archive.len() {
        let Ok(part) = archive.by_index(part) else {
            continue;
        };
        let is_xml = part.name().is_ok_and(|name| has_extension(Path::new(name.as_ref()), &["xml"]));
        let mut texts = Texts::default();
        let read = std::io::copy(&mut part.take(left + 1), &mut texts).unwrap_or(0);
        if read > left {
            return Err(format!("unpacks to more than {most} bytes"));
        }
        if is_xml && texts.longest > MAX_TEXT {
            return Err(format!("has a text of more than {MAX_TEXT} bytes"));
        }
        left -= read;
    }
    Ok(())
}

/// The longest text between two tags of XML that is written to it.
#[derive(Default)]
struct Texts {
    /// Bytes since the last tag began.
    since: usize,
    longest: usize,
}

impl Write for Texts {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        for (number, part) in bytes.split(|byte| *byte == b'<').enumerate() {
            self.since = part.len() + if number == 0 { self.since } else { 0 };
            self.longest = self.longest.max(self.since);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Calls the library. It may panic on a contradictory file (a row number beyond 32 bits, in builds with overflow
/// checks); the panic becomes an ordinary error.
fn catch_panic<T>(read: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    let contradicts = || std::io::Error::other("its content is contradictory").into();
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(|_| Err(contradicts()))
}

/// A cell with its row and column, from 0.
type PlacedCell = (u32, u32, Data);

/// The filled cells of a sheet.
///
/// Cells that the file lists one by one are read one by one: the rectangle around two cells in opposite corners would
/// not fit in memory.
fn cells(book: &mut Book, name: &str) -> Result<Vec<PlacedCell>, Error> {
    let mut cells = Vec::new();
    let within = |cells: &Vec<PlacedCell>| match cells.len() > MAX_FILLED {
        true => Err(Error::from(std::io::Error::other(format!(
            "it has more than {MAX_FILLED} filled cells, which is the limit"
        )))),
        false => Ok(()),
    };
    match book {
        Sheets::Xlsx(book) => {
            let mut reader = match book.worksheet_cells_reader(name) {
                Err(XlsxError::NotAWorksheet(_)) => return Ok(cells),
                reader => reader?,
            };
            while let Some(cell) = reader.next_cell()? {
                let (row, column) = cell.get_position();
                cells.push((row, column, Data::from(cell.get_value().clone())));
                within(&cells)?;
            }
        }
        Sheets::Xlsb(book) => {
            let mut reader = book.worksheet_cells_reader(name)?;
            while let Some(cell) = reader.next_cell()? {
                let (row, column) = cell.get_position();
                cells.push((row, column, Data::from(cell.get_value().clone())));
                within(&cells)?;
            }
        }
        book => {
            let range = book.worksheet_range(name)?;
            let (top, left) = range.start().unwrap_or_default();
            let used = range.used_cells();
            let placed = used.map(|(row, column, cell)| (top + row as u32, left + column as u32, cell.clone()));
            cells.extend(placed.take(MAX_FILLED + 1));
            within(&cells)?;
        }
    }
    cells.retain(|(_, _, cell)| *cell != Data::Empty);
    Ok(cells)
}

/// Cells as rows of equal width, without comments and empty rows. If they are too far apart: a message and what to do.
fn by_row(mut cells: Vec<PlacedCell>, format: &Format) -> Result<Vec<Row>, (String, String)> {
    cells.retain(|(row, ..)| *row as usize >= format.skip_lines);
    let columns = || cells.iter().map(|(_, column, _)| *column);
    let (Some(left), Some(right)) = (columns().min(), columns().max()) else {
        return Ok(Vec::new());
    };
    let help = "remove the cells beside the table, or export it as CSV";
    if right - left >= MAX_COLUMNS {
        let message = format!(
            "cells from column {} to column {}; the limit is {MAX_COLUMNS} columns",
            left + 1,
            u64::from(right) + 1
        );
        return Err((message, help.into()));
    }
    let width = (right - left) as usize + 1;
    // If two cells have the same position, the later one is used.
    cells.sort_by_key(|(row, column, _)| (*row, *column));
    let mut rows: Vec<Row> = Vec::new();
    for of_row in cells.chunk_by(|(row, ..), (next, ..)| row == next) {
        let first = of_row.iter().find(|(_, column, _)| *column == left);
        if matches!(first, Some((_, _, Data::String(text))) if is_comment(text)) {
            continue;
        }
        if (rows.len() + 1) * width > MAX_CELLS {
            let message = format!("more than {MAX_CELLS} cells in the rectangle around all filled cells");
            return Err((message, help.into()));
        }
        let mut texts = vec![String::new(); width];
        for (_, column, cell) in of_row {
            texts[(column - left) as usize] = text(cell, format);
        }
        rows.push(Row::of_cells(of_row[0].0 as usize + 1, texts));
    }
    Ok(rows)
}

/// The text of a cell in a CSV file of this format.
fn text(cell: &Data, format: &Format) -> String {
    let number = |text: String| {
        if format.decimal == b',' { text.replace('.', ",") } else { text }
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
