//! Reader of tables of readings: CSV files, foreign CSV files through `[format]` and `[columns]`, spreadsheets, and ball-bar files in
//! XML.
//!
//! A header line, then one row per reading. A `#` starts a comment line. Empty lines, a byte order mark and CRLF are accepted. Errors
//! have file, line and column.

mod ballbar_xml;
mod columns;
pub mod csv;
mod duplicates;
pub(crate) mod encoding;
mod required;
mod rows;
mod spreadsheet;

use std::path::Path;

use encoding_rs::Encoding;

pub(crate) use ballbar_xml::{is_xml, read as read_xml};
pub(crate) use columns::{ColumnMapping, ForeignColumn};

use columns::{Column, Role};
use rows::Rows;

use crate::chain::Machine;
use crate::error::{Location, ModelError};
use crate::files::stamp::FileStamp;
use crate::instrument::InstrumentKind;
use crate::session::limits;
use crate::session::readings::Readings;

/// The layout of the rows of a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Format {
    /// The separator between cells.
    pub separator: u8,
    /// `.` or `,`.
    pub decimal: u8,
    /// Whether the first row names the columns.
    pub header: bool,
    /// The sheet of a spreadsheet; by default the first that is not empty.
    pub sheet: Option<String>,
    /// The word in a ball-bar file in XML for the direction from the first axis of the plane towards the second.
    pub anticlockwise: Option<String>,
    /// The stated encoding of the text.
    pub encoding: Option<&'static Encoding>,
    /// Lines (of a spreadsheet: rows) above the header.
    pub skip_lines: usize,
}

impl Default for Format {
    fn default() -> Self {
        Format {
            separator: b',',
            decimal: b'.',
            header: true,
            sheet: None,
            anticlockwise: None,
            encoding: None,
            skip_lines: 0,
        }
    }
}

/// What a test requires of its data file.
pub(crate) struct Request<'a> {
    /// The machine that has the axes of the columns.
    pub machine: &'a Machine,
    /// The instrument.
    pub instrument: InstrumentKind,
    /// Whether the sensors of an R-test are read singly instead of as X, Y, Z.
    pub sensors: bool,
    /// The reference length of deviations, mm.
    pub bar_mm: f64,
    /// The layout of the rows.
    pub format: Format,
    /// Foreign names, if declared.
    pub columns: Option<&'a [ColumnMapping]>,
    /// Positions of axes that the data do not contain, mm or rad.
    pub at: &'a [f64],
    /// Which of them the test states.
    pub at_listed: &'a [bool],
    /// Axes that move in the planned test.
    pub moved: &'a [usize],
    /// The socket of all poses, if the test states one.
    pub socket: Option<&'a str>,
}

/// Largest number of sockets in a file.
const MAX_SOCKETS: usize = 1000;

/// Readings of one data file: one set per socket in the file, else one.
pub(crate) type BySocket = Vec<(Option<String>, Readings)>;

/// Reads a data file. Returns the readings, and warnings about the file.
///
/// # Errors
/// Any cell that is not a finite number where one is expected, with file, line and column; missing or unknown columns; decreasing time;
/// fewer than two readings.
pub(crate) fn read(file: &Path, request: &Request<'_>) -> Result<(BySocket, Vec<String>), ModelError> {
    let (stamp, mut rows) = if spreadsheet::is_spreadsheet(file) {
        let (stamp, rows) = spreadsheet::rows(file, &request.format)?;
        (stamp, Source::Sheet(rows.into_iter()))
    } else {
        let rows = Rows::open(file, &request.format)?;
        (rows.stamp().clone(), Source::Text(rows))
    };
    let empty = |what: &str| ModelError::Input {
        location: Location::file(file),
        message: format!("an empty data file: {what}"),
        help: Some("check that the measurement was exported".into()),
    };
    let Some(first) = rows.next_row()? else {
        return Err(empty("no header and no readings"));
    };
    let width = first.cells.len();
    let header = request.format.header.then_some(&first);
    let columns = columns::columns(request, file, &first, header)?;
    required::required(
        request,
        file,
        first.line,
        &columns,
        header.map(|row| row.cells.as_slice()),
    )?;
    let mut filled = ReadingColumns::new(request, stamp, columns);
    if header.is_none() {
        filled.push(&first)?;
    }
    while let Some(row) = rows.next_row()? {
        if row.cells.len() != width {
            return Err(wrong_width(file, &row, width, &request.format));
        }
        filled.push(&row)?;
    }
    let warning = filled.without_duplicates();
    match filled.readings.line.len() {
        0 => Err(empty("a header without readings")),
        1 => Err(ModelError::Input {
            location: Location::line(file, filled.readings.line[0]),
            message: "one reading, which is not enough for a fit".into(),
            help: Some("a test needs at least two readings, and as many as it has parameters".into()),
        }),
        _ => Ok((filled.by_socket(), warning.into_iter().collect())),
    }
}

/// Rows of a text or of a spreadsheet.
enum Source {
    Text(Rows),
    Sheet(std::vec::IntoIter<rows::Row>),
}

impl Source {
    fn next_row(&mut self) -> Result<Option<rows::Row>, ModelError> {
        match self {
            Source::Text(rows) => rows.next_row(),
            Source::Sheet(rows) => Ok(rows.next()),
        }
    }
}

fn wrong_width(file: &Path, row: &rows::Row, width: usize, format: &Format) -> ModelError {
    let found = row.cells.len();
    let cells = |n: usize| format!("{n} cell{}", if n == 1 { "" } else { "s" });
    let help = if format.separator == b',' && found > width {
        "a decimal comma in a file separated by commas is indistinguishable from a separator: export it with another \
         separator and declare `[format] separator = \";\", decimal = \",\"`"
    } else {
        "complete the row or remove it"
    };
    ModelError::Input {
        location: Location::line(file, row.line),
        message: format!("a row of {}, but the file has {width} columns", cells(found)),
        help: Some(help.into()),
    }
}

/// The columns while they are filled.
struct ReadingColumns<'a> {
    request: &'a Request<'a>,
    columns: Vec<Column>,
    readings: Readings,
    /// The socket of each row, as an index into `sockets`.
    socket: Vec<usize>,
    sockets: Vec<String>,
    /// A hash of the cells of each row, over all columns of the file.
    cells: Vec<u64>,
}

impl<'a> ReadingColumns<'a> {
    fn new(request: &'a Request<'a>, stamp: FileStamp, columns: Vec<Column>) -> Self {
        ReadingColumns {
            request,
            columns,
            readings: Readings {
                file: stamp.file.clone(),
                stamp: Some(stamp),
                positions: vec![Vec::new(); request.machine.axes.len()],
                coordinates: request.instrument.coordinates(),
                ..Readings::default()
            },
            socket: Vec::new(),
            sockets: Vec::new(),
            cells: Vec::new(),
        }
    }

    /// Removes rows that are copies of earlier ones and returns a message that lists them.
    fn without_duplicates(&mut self) -> Option<String> {
        let kept = duplicates::kept(&self.readings, &self.cells)?;
        let message = duplicates::message(&self.readings, &kept);
        self.readings = self.readings.of_rows(&kept);
        if !self.socket.is_empty() {
            self.socket = kept.iter().map(|row| self.socket[*row]).collect();
        }
        Some(message)
    }

    fn push(&mut self, row: &rows::Row) -> Result<(), ModelError> {
        let readings = &mut self.readings;
        let mut observed = [0.0; 3];
        for (positions, &at) in readings.positions.iter_mut().zip(self.request.at) {
            positions.push(at);
        }
        for column in &self.columns {
            let cell = row.cells[column.index].as_str();
            if column.role == Role::Socket {
                let location = Location::line(&readings.file, row.line);
                self.socket.push(socket_index(&mut self.sockets, cell, location)?);
                continue;
            }
            let fault = |message: String, help: &str| ModelError::Input {
                location: Location {
                    span: row.span(column.index),
                    ..Location::line(&readings.file, row.line)
                },
                message: format!("column {} (`{}`): {message}", column.index + 1, column.name),
                help: Some(help.to_string()),
            };
            let value = number(cell, &self.request.format).map_err(|(message, help)| fault(message, help))?;
            match column.role {
                Role::Time => {
                    if let Some(&before) = readings.time_s.last()
                        && value < before
                    {
                        return Err(fault(
                            format!("time decreases: {value} s after {before} s in the row before"),
                            "sort the rows by time, or omit the time column from [columns] if it has no meaning",
                        ));
                    }
                    readings.time_s.push(value);
                }
                Role::Run => {
                    if value.fract() != 0.0 || value.abs() > 1e9 {
                        return Err(fault(
                            format!("`{cell}` is not a run number"),
                            "run numbers are integers, one for each traversal in one direction",
                        ));
                    }
                    readings.run.push(value as i64);
                }
                Role::Temperature => readings.temperature_c.push(value),
                Role::Axis(axis, unit) => {
                    if let Some(last) = readings.positions[axis].last_mut() {
                        *last = unit.to_internal(value);
                    }
                }
                Role::Length(unit) => observed[0] = unit.to_internal(value),
                Role::Deviation(unit) => observed[0] = self.request.bar_mm + unit.to_internal(value),
                Role::Outward(unit) => observed[0] = -unit.to_internal(value),
                Role::Coordinate(i, unit) => observed[i] = unit.to_internal(value),
                Role::Socket => {}
            }
        }
        self.cells.push(duplicates::hash_of(&row.cells));
        readings.line.push(row.line);
        readings.observed.extend(&observed[..readings.coordinates]);
        Ok(())
    }

    /// The readings, split by socket if a column names it.
    fn by_socket(self) -> BySocket {
        if self.sockets.is_empty() {
            return vec![(None, self.readings)];
        }
        let all = &self.readings;
        self.sockets
            .into_iter()
            .enumerate()
            .map(|(index, name)| {
                let rows: Vec<usize> = (0..self.socket.len())
                    .filter(|&row| self.socket[row] == index)
                    .collect();
                (Some(name), all.of_rows(&rows))
            })
            .collect()
    }
}

/// The index of a socket among those found so far in the file.
fn socket_index(sockets: &mut Vec<String>, name: &str, location: Location) -> Result<usize, ModelError> {
    if let Some(known) = sockets.iter().position(|socket| socket == name) {
        return Ok(known);
    }
    let fault = |message: String, help: &str| ModelError::Input {
        location,
        message,
        help: Some(help.into()),
    };
    if sockets.len() == MAX_SOCKETS {
        let message = format!("more than {MAX_SOCKETS} sockets in column `socket`");
        return Err(fault(
            message,
            "a socket has many poses; does the column contain the socket's name?",
        ));
    }
    if let Some(control) = name.chars().find(|c| c.is_control()) {
        let message = format!(
            "a socket's name contains the control character U+{:04X}",
            control as u32
        );
        return Err(fault(message, "remove it"));
    }
    sockets.push(name.to_string());
    Ok(sockets.len() - 1)
}

/// A finite number in a cell, or its fault and what to do.
fn number(cell: &str, format: &Format) -> Result<f64, (String, &'static str)> {
    const NUMBER: &str = "enter a number or remove the row";
    if cell.is_empty() {
        return Err(("an empty cell where a number is expected".into(), NUMBER));
    }
    let parsed = if format.decimal == b',' {
        if cell.contains('.') {
            return Err((
                format!("`{cell}` has a decimal point, but `decimal = \",\"` is declared"),
                "declare the decimal sign of the file",
            ));
        }
        cell.replace(',', ".").parse::<f64>()
    } else {
        cell.parse::<f64>()
    };
    match parsed {
        Ok(value) if value.abs() <= limits::LARGEST => Ok(value),
        Ok(value) if value.is_nan() => Err((format!("`{cell}` is not a number (NaN)"), NUMBER)),
        Ok(_) => {
            let fault = format!(
                "`{cell}` is infinite or too large; the limit is {:e}",
                limits::LARGEST
            );
            Err((fault, NUMBER))
        }
        Err(_) if cell.replacen(',', ".", 1).parse::<f64>().is_ok() => Err((
            format!("`{cell}` has a decimal comma, which is not declared"),
            "declare `[format] decimal = \",\"`",
        )),
        Err(_) => Err((format!("`{cell}` is not a number"), NUMBER)),
    }
}
