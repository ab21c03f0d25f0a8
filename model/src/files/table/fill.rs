//! Readings from rows of cells, by the roles of their columns.

use std::path::{Path, PathBuf};

use super::columns::{self, Column, Role};
use super::format::Rows;
use super::number::number;
use super::request::{Format, Request};
use super::row::Row;
use super::{duplicates, required};
use crate::error::{Location, ModelError};
use crate::instrument::Fault;
use crate::instrument::column::Quantity;
use crate::session::check;
use crate::session::readings::{Origin, Readings};

/// Largest number of sockets in a file.
const MAX_SOCKETS: usize = 1000;

/// Readings of one data file: one set per socket in the file, else one.
pub(crate) type BySocket = Vec<(Option<String>, Readings)>;

/// Reads the rows of a data file. Returns the readings, and warnings about the file.
///
/// # Errors
/// Any cell that is not a finite number where one is expected, with file, line and column; missing or unknown columns;
/// decreasing time; fewer than two readings.
pub(super) fn read(
    file: &Path,
    rows: &mut dyn Rows,
    has_header: bool,
    request: &Request<'_>,
) -> Result<(BySocket, Vec<String>), ModelError> {
    let empty = |what: &str| ModelError::Input {
        location: Location::file(file),
        message: format!("an empty data file: {what}"),
        help: Some("check that the measurement was exported".into()),
    };
    let Some(first) = rows.next_row()? else {
        return Err(empty("no header and no readings"));
    };
    let width = first.cells.len();
    let header = has_header.then_some(&first);
    let columns = columns::columns(request, file, &first, header)?;
    required::required(request, file, first.line, &columns, header.map(|row| row.cells.as_slice()))?;
    let mut filled = ReadingColumns::new(request, file, columns);
    if header.is_none() {
        filled.push(&first)?;
    }
    while let Some(row) = rows.next_row()? {
        if row.cells.len() != width {
            return Err(wrong_width(file, &row, width, &request.format));
        }
        filled.push(&row)?;
    }
    let (readings, warning) = filled.without_duplicates();
    match readings.line.len() {
        0 => Err(empty("a header without readings")),
        1 => Err(ModelError::Input {
            location: Location::line(file, readings.line[0]),
            message: "one reading, which is not enough for a fit".into(),
            help: Some("a test needs at least two readings, and as many as it has parameters".into()),
        }),
        _ => Ok((readings.by_socket(), warning.into_iter().collect())),
    }
}

fn wrong_width(file: &Path, row: &Row, width: usize, format: &Format) -> ModelError {
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
    file: PathBuf,
    columns: Vec<Column>,
    readings: Readings,
    /// The line of each row.
    line: Vec<usize>,
    /// The socket of each row, as an index into `sockets`.
    socket: Vec<usize>,
    sockets: Vec<String>,
    /// A hash of the cells of each row, over all columns of the file.
    cells: Vec<u64>,
}

impl<'a> ReadingColumns<'a> {
    fn new(request: &'a Request<'a>, file: &Path, columns: Vec<Column>) -> Self {
        ReadingColumns {
            request,
            file: file.to_path_buf(),
            columns,
            readings: Readings {
                positions: vec![Vec::new(); request.machine.axes.len()],
                coordinates: request.instrument().coordinates(),
                ..Readings::default()
            },
            line: Vec::new(),
            socket: Vec::new(),
            sockets: Vec::new(),
            cells: Vec::new(),
        }
    }

    /// Removes rows that are copies of earlier ones, with a message that lists them.
    fn without_duplicates(mut self) -> (Self, Option<String>) {
        let Some(kept) = duplicates::kept(&self.readings, &self.cells) else {
            return (self, None);
        };
        let message = duplicates::message(&self.file, &self.line, &kept);
        self.readings = self.readings.of_rows(&kept);
        self.line = kept.iter().map(|row| self.line[*row]).collect();
        if !self.socket.is_empty() {
            self.socket = kept.iter().map(|row| self.socket[*row]).collect();
        }
        (self, Some(message))
    }

    fn push(&mut self, row: &Row) -> Result<(), ModelError> {
        let readings = &mut self.readings;
        let mut observed = [0.0; 3];
        for (positions, &at) in readings.positions.iter_mut().zip(&self.request.test.at) {
            positions.push(at);
        }
        for column in &self.columns {
            let cell = row.cells[column.index].as_str();
            if column.role == Role::Socket {
                let index = socket_index(&mut self.sockets, cell).map_err(|(message, help)| ModelError::Input {
                    location: Location::line(&self.file, row.line),
                    message,
                    help: Some(help),
                })?;
                self.socket.push(index);
                continue;
            }
            let fault = |message: String, help: &str| ModelError::Input {
                location: Location { span: row.span(column.index), ..Location::line(&self.file, row.line) },
                message: format!("{}: {message}", row.place(column.index, &column.name)),
                help: Some(help.to_string()),
            };
            let value = number(cell, &self.request.format).map_err(|(message, help)| fault(message, help))?;
            match &column.role {
                Role::Time => {
                    if let Some(&before) = readings.time_s.last()
                        && let Some(message) = check::decreasing_time(before, value)
                    {
                        return Err(fault(
                            message,
                            "sort the rows by time, or omit the time column from [columns] if it has no meaning",
                        ));
                    }
                    readings.time_s.push(value);
                }
                Role::Run => {
                    readings.run.push(run_number(value).ok_or_else(|| {
                        fault(
                            format!("`{cell}` is not a run number"),
                            "run numbers are integers, one for each traversal in one direction",
                        )
                    })?);
                }
                Role::Driver(name) => match readings.drivers.get_mut(name) {
                    Some(values) => values.push(value),
                    None => _ = readings.drivers.insert(name.clone(), vec![value]),
                },
                Role::Axis(axis, unit) => {
                    if let Some(last) = readings.positions[*axis].last_mut() {
                        *last = unit.to_internal(value);
                    }
                }
                Role::Reading(quantity, unit) => {
                    let coordinate = if let Quantity::Coordinate(i) = quantity { *i } else { 0 };
                    observed[coordinate] = self::observed(*quantity, unit.to_internal(value), self.request);
                }
                Role::Socket => {}
            }
        }
        self.cells.push(duplicates::hash_of(&row.cells));
        self.line.push(row.line);
        readings.observed.extend(&observed[..readings.coordinates]);
        Ok(())
    }

    /// The readings, split by socket if a column names it.
    fn by_socket(self) -> BySocket {
        let all = Readings { origin: Some(Origin { file: self.file, line: self.line }), ..self.readings };
        by_socket(all, self.sockets, &self.socket)
    }
}

/// Readings by socket; `socket` has the index of the socket of each row, and nothing if no column names sockets.
pub(super) fn by_socket(all: Readings, sockets: Vec<String>, socket: &[usize]) -> BySocket {
    if sockets.is_empty() {
        return vec![(None, all)];
    }
    sockets
        .into_iter()
        .enumerate()
        .map(|(index, name)| {
            let rows: Vec<usize> = (0..socket.len()).filter(|&row| socket[row] == index).collect();
            (Some(name), all.of_rows(&rows))
        })
        .collect()
}

/// A run number, if the number is one.
pub(super) fn run_number(value: f64) -> Option<i64> {
    (value.fract() == 0.0 && value.abs() <= 1e9).then_some(value as i64)
}

/// The observed value of a cell in the internal unit.
pub(super) fn observed(quantity: Quantity, value: f64, request: &Request<'_>) -> f64 {
    match quantity {
        Quantity::Length | Quantity::Coordinate(_) => value,
        Quantity::Deviation => request.bar_mm() + value,
        Quantity::Outward => -value,
        Quantity::Socket => 0.0,
    }
}

/// The index of a socket among those found so far in the file.
pub(super) fn socket_index(sockets: &mut Vec<String>, name: &str) -> Result<usize, Fault> {
    if let Some(known) = sockets.iter().position(|socket| socket == name) {
        return Ok(known);
    }
    if sockets.len() == MAX_SOCKETS {
        let message = format!("more than {MAX_SOCKETS} sockets in column `socket`");
        return Err((message, "a socket has many poses; does the column contain the socket's name?".into()));
    }
    if let Some(control) = name.chars().find(|c| c.is_control()) {
        let message = format!("a socket's name contains the control character U+{:04X}", control as u32);
        return Err((message, "remove it".into()));
    }
    sockets.push(name.to_string());
    Ok(sockets.len() - 1)
}
