//! Readings from the rows of a file or of columns in memory, by the roles of their columns.

use std::collections::TryReserveError;
use std::hash::Hasher;
use std::path::{Path, PathBuf};

use abbe_model::diagnostic::{Diagnostic, Location};
use abbe_model::instrument::column::{OF_ROTATION, Quantity};
use abbe_model::instrument::{Fault, MAX_CHANNELS};
use abbe_model::session::readings::{Origin, Readings};
use abbe_model::session::trajectory;
use abbe_model::words::listed;
use nalgebra::{Quaternion, UnitQuaternion};

use super::columns::{self, Column, Role};
use super::duplicates::{self, CellHasher};
use super::number::number;
use super::request::{Format, Request};
use super::required;
use super::row::{Row, Rows};
use crate::check;

/// Largest number of sockets in a file.
const MAX_SOCKETS: usize = 1000;

/// Readings of one data file: one set per socket in the file, else one.
pub(crate) type BySocket = Vec<(Option<String>, Readings)>;

/// The readings of a table.
pub(crate) struct Filling {
    /// The readings.
    pub by_socket: BySocket,
    /// The columns of readings that it has.
    pub quantities: Vec<Quantity>,
    /// Warnings about the table.
    pub warnings: Vec<String>,
}

/// The cells of one row.
pub(super) trait Cells {
    /// The number in a column, or what is wrong with it.
    fn number(&self, column: &Column) -> Result<f64, Fault>;
    /// The text in a column.
    fn text(&self, column: &Column) -> &str;
    /// The error of a fault in a column, with its place.
    fn error(&self, column: &Column, fault: Fault) -> Diagnostic;
    /// Whether the cell of a column is empty.
    fn lacks(&self, column: &Column) -> bool;
    /// Adds all cells of the row to a hash.
    fn hash(&self, hasher: &mut CellHasher);
}

/// A row of a file.
struct FileRow<'r> {
    file: &'r Path,
    row: &'r Row,
    format: &'r Format,
}

impl Cells for FileRow<'_> {
    fn number(&self, column: &Column) -> Result<f64, Fault> {
        number(self.text(column), self.format).map_err(|(message, help)| (message, help.to_string()))
    }

    fn text(&self, column: &Column) -> &str {
        &self.row.cells[column.index]
    }

    fn error(&self, column: &Column, (message, help): Fault) -> Diagnostic {
        Diagnostic::input(
            Location { span: self.row.span(column.index), ..Location::line(self.file, self.row.line) },
            format!("{}: {message}", self.row.place(column.index, &column.name)),
            help,
        )
    }

    fn lacks(&self, column: &Column) -> bool {
        let text = self.text(column);
        text.is_empty() || text.eq_ignore_ascii_case("nan")
    }

    fn hash(&self, hasher: &mut CellHasher) {
        self.row.cells.iter().for_each(|cell| hasher.write(cell.as_bytes()));
    }
}

/// Reads the rows of a data file.
///
/// # Errors
/// Any cell that is not a finite number where one is expected, with file, line and column; missing or unknown columns;
/// decreasing time; fewer than two readings.
pub(super) fn read(
    file: &Path,
    rows: &mut dyn Rows,
    has_header: bool,
    request: &Request<'_>,
) -> Result<Filling, Diagnostic> {
    let empty = |what: &str| {
        Diagnostic::input(
            Location::file(file),
            format!("an empty data file: {what}"),
            "check that the measurement was exported",
        )
    };
    let Some(first) = rows.next_row()? else {
        return Err(empty("no header and no readings"));
    };
    let width = first.cells.len();
    let header = has_header.then_some(&first);
    let columns = columns::columns(request, file, &first, header)?;
    let names = header.map(|row| row.cells.as_slice());
    required::required(request, &columns, names)
        .map_err(|(message, help)| Diagnostic::input(Location::line(file, first.line), message, help))?;
    let mut filled = Filled::new(request, columns, 0);
    let push = |filled: &mut Filled<'_>, row: &Row| {
        let cells = FileRow { file, row, format: &request.format };
        if filled.line.len() == filled.line.capacity() && filled.line.len() >= MIN_TESTED {
            filled.reserve().map_err(|_| {
                Diagnostic::input(
                    Location::line(file, row.line),
                    format!("too little memory for more than {} rows", filled.line.len()),
                    "free memory, thin out the readings, or split the file into several tests",
                )
            })?;
        }
        filled.push(&cells)?;
        filled.line.push(row.line);
        if filled.can_have_copies() {
            filled.cells.push(duplicates::hash_of(|hasher| cells.hash(hasher)));
        }
        Ok::<(), Diagnostic>(())
    };
    let traversals = filled.traversals(file)?;
    let mut all = Vec::new();
    let mut next = header.is_none().then_some(first);
    while let Some(row) = next.take().map_or_else(|| rows.next_row(), |row| Ok(Some(row)))? {
        if row.cells.len() != width {
            return Err(wrong_width(file, &row, width, &request.format));
        }
        if traversals == 0 {
            push(&mut filled, &row)?;
            rows.reuse(row);
        } else {
            all.push(row);
        }
    }
    for traversal in 0..traversals {
        let is_backward = filled.begin(traversal);
        for place in 0..all.len() {
            let row = &all[if is_backward { all.len() - 1 - place } else { place }];
            // An empty cell is a position that this traversal did not read.
            if !filled.reads_nothing(&FileRow { file, row, format: &request.format }) {
                push(&mut filled, row)?;
                filled.readings.run.push(traversal as i64 + 1);
            }
        }
    }
    filled.complete(filled.line.len())?;
    let warnings: Vec<String> = filled.lacking(file).into_iter().chain(filled.remove_duplicates(file)).collect();
    match filled.line[..] {
        [] => Err(empty("a header without readings")),
        [line] => {
            Err(Diagnostic::input(Location::line(file, line), "one reading, which is not enough for a fit", NOT_ENOUGH))
        }
        _ => Ok(Filling {
            quantities: columns::quantities(&filled.columns),
            by_socket: filled.by_socket(Some(file)),
            warnings: request.named(warnings),
        }),
    }
}

/// Rows from which the memory for more is asked for before they are read.
const MIN_TESTED: usize = 1 << 14;

/// What to do about a test with fewer than two readings.
pub(super) const NOT_ENOUGH: &str = "a test needs at least two readings, and as many as it has parameters";

fn wrong_width(file: &Path, row: &Row, width: usize, format: &Format) -> Diagnostic {
    let found = row.cells.len();
    let cells = |n: usize| format!("{n} cell{}", if n == 1 { "" } else { "s" });
    let help = if format.separator == b',' && found > width {
        "a decimal comma in a file separated by commas is indistinguishable from a separator: export it with another \
         separator and declare `[format] separator = \";\", decimal = \",\"`"
    } else {
        "complete the row or remove it"
    };
    Diagnostic::input(
        Location::line(file, row.line),
        format!("a row of {}, but the file has {width} columns", cells(found)),
        help,
    )
}

/// The readings while they are filled.
pub(super) struct Filled<'a> {
    request: &'a Request<'a>,
    columns: Vec<Column>,
    /// For each column its channel among those that the data have.
    channel: Vec<usize>,
    /// For each channel whether the values are less the nominal reading.
    from_nominal: Vec<bool>,
    /// The channels of a row before it is read: a contact reads zero.
    unread: [f64; MAX_CHANNELS],
    pub readings: Readings,
    /// The line or item of each row, from 1.
    pub line: Vec<usize>,
    /// The socket of each row, as an index into `sockets`.
    socket: Vec<usize>,
    sockets: Vec<String>,
    /// The polar angle of each row on a circle, rad; empty without such a column.
    polar: Vec<f64>,
    /// A hash of the cells of each row, over all columns; empty if there can be no copies.
    pub cells: Vec<u64>,
}

impl<'a> Filled<'a> {
    /// Nothing yet, with room for some rows.
    pub fn new(request: &'a Request<'a>, columns: Vec<Column>, rows: usize) -> Self {
        let station = columns::kept(&request.test.station, &columns::quantities(&columns));
        let channels = station.channels().len();
        let mut unread = [f64::NAN; MAX_CHANNELS];
        let contacts = unread.iter_mut().zip(station.channels()).filter(|(_, channel)| channel.is_contact);
        contacts.for_each(|(value, _)| *value = 0.0);
        let mut readings = Readings {
            positions: vec![Vec::new(); request.machine.axes.len()],
            channels,
            observed: Vec::with_capacity(rows * channels),
            ..Readings::default()
        };
        let mut from_nominal = vec![false; channels];
        let mut channel = vec![0; columns.len()];
        for (column, channel) in columns.iter().zip(&mut channel) {
            if let Role::Reading(quantity, _) = column.role {
                *channel = quantity.channel().and_then(|of_all| station.kept_channel(of_all)).unwrap_or(0);
                from_nominal[*channel] = matches!(quantity, Quantity::FromNominal(_));
            }
        }
        for column in &columns {
            match &column.role {
                Role::Time => readings.time_s.reserve_exact(rows),
                Role::Run => readings.run.reserve_exact(rows),
                Role::Driver(name) => _ = readings.drivers.insert(name.clone(), Vec::with_capacity(rows)),
                Role::Axis(axis, _) => readings.positions[*axis].reserve_exact(rows),
                Role::Reading(..) | Role::Socket | Role::Polar(_) => {}
            }
        }
        let (line, socket, sockets, cells) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let polar = Vec::new();
        Filled { request, columns, channel, from_nominal, unread, readings, line, socket, sockets, polar, cells }
    }

    /// The number of traversals whose readings stand side by side; 0 if each row is a reading.
    fn traversals(&self, file: &Path) -> Result<usize, Diagnostic> {
        let counts = self.columns.iter().filter(|column| !column.traversals.is_empty());
        let counts: Vec<usize> = counts.map(|column| column.traversals.len()).collect();
        let Some(first) = counts.first() else { return Ok(0) };
        let fault = |message: &str, help: &str| Diagnostic::input(Location::file(file), message, help);
        if self.columns.iter().any(|column| matches!(column.role, Role::Time | Role::Run)) {
            return Err(fault(
                "a time or a run for readings of several traversals in a row",
                "remove `time_s` and `run` from [columns]: `forward` and `backward` number the runs",
            ));
        }
        let is_reading = |column: &&Column| matches!(column.role, Role::Reading(..));
        if self.columns.iter().filter(is_reading).any(|column| column.traversals.len() != *first) {
            return Err(fault(
                "columns of readings with different numbers of traversals",
                "name a column of each reading for every traversal in `forward` and `backward`",
            ));
        }
        Ok(*first)
    }

    /// Reads the columns of a traversal from now on; whether it is against the order of the rows.
    fn begin(&mut self, traversal: usize) -> bool {
        let mut is_backward = false;
        for column in &mut self.columns {
            if let Some((index, backward)) = column.traversals.get(traversal) {
                (column.index, is_backward) = (*index, *backward);
            }
        }
        is_backward
    }

    /// Whether the cells of all readings are empty.
    fn reads_nothing(&self, row: &impl Cells) -> bool {
        let mut readings = self.columns.iter().filter(|column| matches!(column.role, Role::Reading(..)));
        readings.all(|column| row.lacks(column))
    }

    /// Whether a row may lack a channel.
    fn can_lack(&self) -> bool {
        self.readings.channels > 1 && self.request.instrument().entry().rows_can_lack_channels
    }

    /// Adds a row.
    ///
    /// # Errors
    /// A cell that is not what its column expects, with its place.
    pub fn push(&mut self, row: &impl Cells) -> Result<(), Diagnostic> {
        let can_lack = self.can_lack();
        let readings = &mut self.readings;
        let mut observed = self.unread;
        let mut quaternion = [f64::NAN; 4];
        let mut of_quaternion = None;
        for (column, channel) in self.columns.iter().zip(&self.channel) {
            let fault = |message: String, help: &str| row.error(column, (message, help.to_string()));
            if column.role == Role::Socket {
                let index = socket_index(&mut self.sockets, row.text(column));
                self.socket.push(index.map_err(|fault| row.error(column, fault))?);
                continue;
            }
            if let Role::Reading(Quantity::Quaternion(_), _) = column.role {
                of_quaternion = Some(column);
            }
            if matches!(column.role, Role::Reading(..)) && can_lack && row.lacks(column) {
                continue;
            }
            let value = row.number(column).map_err(|fault| row.error(column, fault))?;
            match &column.role {
                Role::Time => {
                    if let Some(&before) = readings.time_s.last()
                        && let Some(message) = check::decreasing_time(before, value)
                    {
                        return Err(fault(message, "sort the rows by time, or omit the times if they have no meaning"));
                    }
                    readings.time_s.push(value);
                }
                Role::Run => {
                    if value.fract() != 0.0 || value.abs() > 1e9 {
                        return Err(fault(
                            format!("`{}` is not a run number", abbe_model::words::number(value)),
                            "run numbers are integers, one for each traversal in one direction",
                        ));
                    }
                    readings.run.push(value as i64);
                }
                Role::Driver(name) => {
                    if let Some(values) = readings.drivers.get_mut(name) {
                        values.push(value);
                    }
                }
                Role::Axis(axis, unit) => readings.positions[*axis].push(unit.to_internal(value)),
                Role::Polar(unit) => self.polar.push(unit.to_internal(value)),
                Role::Reading(Quantity::Quaternion(component), _) => quaternion[*component] = value,
                Role::Reading(quantity, unit) => {
                    let value = unit.to_internal(value);
                    observed[*channel] = match quantity {
                        Quantity::Deviation => self.request.bar_mm() + value,
                        Quantity::Outward => -value,
                        _ => value,
                    };
                }
                Role::Socket => {}
            }
        }
        if let Some(column) = of_quaternion {
            let vector = rotation_vector(quaternion).map_err(|fault| row.error(column, fault))?;
            observed[OF_ROTATION].copy_from_slice(&vector);
        }
        let values = &observed[..readings.channels];
        if !values.is_empty() && values.iter().all(|value| value.is_nan()) {
            let fault = ("no channel has a value in this row".to_string(), "remove the row".to_string());
            return Err(self
                .columns
                .last()
                .map_or_else(|| row.error(&self.columns[0], fault.clone()), |last| row.error(last, fault.clone())));
        }
        readings.observed.extend(values);
        Ok(())
    }

    /// Makes room for as many rows again.
    ///
    /// # Errors
    /// If there is too little memory for them.
    fn reserve(&mut self) -> Result<(), TryReserveError> {
        let rows = self.line.len();
        let Readings { positions, time_s, run, drivers, observed, .. } = &mut self.readings;
        observed.try_reserve(observed.len())?;
        run.try_reserve(run.len())?;
        for column in positions.iter_mut().chain([time_s, &mut self.polar]).chain(drivers.values_mut()) {
            column.try_reserve(column.len())?;
        }
        self.socket.try_reserve(self.socket.len())?;
        self.cells.try_reserve(self.cells.len())?;
        self.line.try_reserve(rows)
    }

    /// The columns.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Completes the columns: the axes without one stay where the test holds them, or follow the angle on a circle.
    ///
    /// # Errors
    /// If the axes of the circle are not at right angles.
    pub fn complete(&mut self, rows: usize) -> Result<(), Diagnostic> {
        if !self.polar.is_empty()
            && let Some(states) = trajectory::on_circle(self.request.machine, self.request.test, &self.polar)
        {
            let states = states.map_err(|(message, help)| Diagnostic::session(message, help))?;
            for (axis, positions) in self.readings.positions.iter_mut().enumerate() {
                if positions.is_empty() {
                    *positions = states.iter().map(|state| state[axis]).collect();
                }
            }
        }
        for (positions, at) in self.readings.positions.iter_mut().zip(&self.request.test.at) {
            if positions.is_empty() {
                *positions = vec![*at; rows];
            }
        }
        if self.from_nominal.contains(&true) {
            let station = columns::kept(&self.request.test.station, &columns::quantities(&self.columns));
            let Readings { observed, channels, .. } = &mut self.readings;
            let (mut observed, channels) = (std::mem::take(observed), *channels);
            let mut nominal = self.readings.nominal(self.request.machine, &station);
            for (row, values) in observed.chunks_exact_mut(channels).enumerate() {
                let reading = nominal(row);
                let of_nominal = values.iter_mut().zip(&self.from_nominal).zip(reading.channels());
                of_nominal.filter(|((_, from), _)| **from).for_each(|((value, _), nominal)| *value += nominal);
            }
            drop(nominal);
            self.readings.observed = observed;
        }
        Ok(())
    }

    /// A message of the rows that lack a channel, the first by its line.
    fn lacking(&self, file: &Path) -> Option<String> {
        let lacks = |values: &[f64]| values.iter().any(|value| value.is_nan());
        let rows = || self.readings.observed.chunks_exact(self.readings.channels.max(1));
        let first = rows().position(lacks)?;
        let of_column = |column: &Column, channel: usize| match column.role {
            Role::Reading(Quantity::Quaternion(_), _) => OF_ROTATION,
            _ => channel..channel + 1,
        };
        let is_lacking = |(column, channel): &(&Column, &usize)| {
            matches!(column.role, Role::Reading(..))
                && rows().any(|values| lacks(&values[of_column(column, **channel)]))
        };
        let columns = self.columns.iter().zip(&self.channel).filter(is_lacking);
        let names: Vec<String> = columns.map(|(column, _)| format!("`{}`", column.name)).collect();
        let count = rows().filter(|values| lacks(values)).count();
        let lack = if count == 1 { "lacks" } else { "lack" };
        let line = self.line.get(first).copied().unwrap_or_default();
        let rows = abbe_model::words::counted(count, "row");
        Some(format!(
            "{}:{line}: {rows} {lack} {}, this one first; the other channels are used",
            file.display(),
            listed(&names, "or")
        ))
    }

    /// Whether a column tells copies of rows from repeats.
    pub fn can_have_copies(&self) -> bool {
        self.columns.iter().any(|column| matches!(column.role, Role::Time | Role::Run))
    }

    /// Removes rows that are copies of earlier ones, with a message that lists them; `file` names where they are.
    pub fn remove_duplicates(&mut self, file: &Path) -> Option<String> {
        let kept = duplicates::kept(&self.readings, &self.cells)?;
        let message = duplicates::message(file, &self.line, &kept);
        self.readings = self.readings.of_rows(&kept);
        self.line = kept.iter().map(|row| self.line[*row]).collect();
        if !self.socket.is_empty() {
            self.socket = kept.iter().map(|row| self.socket[*row]).collect();
        }
        Some(message)
    }

    /// The readings, split by socket if a column names it, with their lines if they are of a file.
    pub fn by_socket(self, file: Option<&Path>) -> BySocket {
        let Filled { readings, line, sockets, socket, .. } = self;
        let origin = file.map(|file| Origin { file: PathBuf::from(file), line });
        let all = Readings { origin, ..readings };
        if sockets.is_empty() {
            return vec![(None, all)];
        }
        let rows_of = |index: usize| (0..socket.len()).filter(|row| socket[*row] == index).collect::<Vec<_>>();
        sockets.into_iter().enumerate().map(|(index, name)| (Some(name), all.of_rows(&rows_of(index)))).collect()
    }
}

/// A norm of a quaternion that differs from 1 by more is no rounding.
const MAX_NORM_ERROR: f64 = 0.01;

/// The rotation vector of a unit quaternion `x`, `y`, `z`, `w`, rad; NaN if a component was not read.
fn rotation_vector(quaternion: [f64; 4]) -> Result<[f64; 3], Fault> {
    let [x, y, z, w] = quaternion;
    let norm = quaternion.iter().map(|component| component * component).sum::<f64>().sqrt();
    if norm.is_nan() {
        return Ok([f64::NAN; 3]);
    }
    if (norm - 1.0).abs() > MAX_NORM_ERROR {
        let message = format!("the quaternion has the norm {}", abbe_model::words::number(norm));
        return Err((message, "a unit quaternion `qx`, `qy`, `qz`, `qw` is expected, `qw` the scalar".into()));
    }
    Ok(UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).scaled_axis().into())
}

/// The index of a socket among those found so far in the file.
fn socket_index(sockets: &mut Vec<String>, name: &str) -> Result<usize, Fault> {
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
