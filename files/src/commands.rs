//! Files of commanded positions, read in blocks: a file of any length needs the memory of one block.
//!
//! A CSV with a header line. Columns that name an axis (`x_mm`, `c_deg`, `J1_rad`) are its positions; `time_s`, `run` and
//! driver columns (`temperature_c`, `driver.NAME_unit`) are what errors may depend on; `px_mm py_mm pz_mm` are a pose of the tool in the table frame, with
//! `i j k` (the direction of the tool's Z) or `qw qx qy qz` (a quaternion). Every other column is kept as it is. A row
//! with a cell that is no number is marked and kept.

use std::io::{self, Read};
use std::path::{Path, PathBuf};

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::diagnostic::{Diagnostic, Location};
use abbe_model::session::readings::{AxisTravel, Readings};
use abbe_model::unit::Unit;
use csv::StringRecord;

use super::stamp::FileStamp;
use super::store::{OpenFile, Store};
use super::table::columns::Role;
use super::table::comment::is_comment;
use super::table::number;
use super::table::request::Format;

/// The content of a column.
#[derive(Clone, Debug, PartialEq)]
enum Meaning {
    /// A time, a run, a driver, the position of an axis.
    Of(Role),
    Pose(usize, Unit),
    Other,
}

/// The columns of a pose: the point, the direction of the tool's Z, the quaternion.
const POSE: [&str; 10] = ["px", "py", "pz", "i", "j", "k", "qw", "qx", "qy", "qz"];

/// Pose columns present in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseColumns {
    /// No poses: axis positions.
    None,
    /// A point.
    Point,
    /// A point and the direction of the tool's Z.
    PointAndAxis,
    /// A point and an orientation.
    PointAndQuaternion,
}

/// Largest length of a row, bytes.
const LONGEST_ROW: u64 = 1 << 20;

/// A file whose rows have a limited length.
struct Bounded {
    opened: OpenFile,
    /// Bytes that the present row may still have.
    left: u64,
}

impl Read for Bounded {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.opened.read(buffer)?;
        self.left = self
            .left
            .checked_sub(count as u64)
            .ok_or_else(|| io::Error::other(format!("a row of more than {LONGEST_ROW} bytes, which is the limit")))?;
        Ok(count)
    }
}

/// A block of rows.
#[derive(Debug)]
pub struct Block {
    /// The positions with the quantities that errors depend on. A row with a fault has those of the row before it, or
    /// of the first row of numbers, so that it changes no direction of travel and no speed. There are no observed
    /// values.
    pub rows: Readings,
    /// The poses, row by row: a point in mm, a direction, a quaternion; NaN where the file has no such column.
    pub poses: Vec<[f64; 10]>,
    /// The cells of each row.
    pub cells: Vec<StringRecord>,
    /// Line of each row, from 1.
    pub lines: Vec<u64>,
    /// The rows with a fault, by index in the block, with the fault.
    pub faults: Vec<(usize, String)>,
}

/// A file of commanded positions.
pub struct CommandFile {
    warning: Option<String>,
    path: PathBuf,
    stamp: FileStamp,
    reader: csv::Reader<Bounded>,
    header: StringRecord,
    meanings: Vec<Meaning>,
    /// Name of the column and kind of each axis of the machine.
    axes: Vec<(String, AxisKind)>,
    at: Vec<f64>,
    poses: PoseColumns,
    travel: Vec<AxisTravel>,
    last_run: i64,
    /// The last row without a fault.
    last: Option<Row>,
}

impl CommandFile {
    /// Opens a file and reads its header. `at` are the positions of axes without a column, mm or rad.
    ///
    /// # Errors
    /// If the file cannot be read, or its header names no axis and no pose, a quantity twice, or a part of a pose.
    pub fn open(path: &Path, machine: &Machine, at: Vec<f64>) -> Result<CommandFile, Diagnostic> {
        let opened = Store::Disk.open(path).and_then(|opened| Ok((opened.state()?, opened)));
        let (state, opened) = opened.map_err(|cause| {
            Diagnostic::input(Location::file(path), format!("the file of commands cannot be read: {cause}"), None)
        })?;
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(Bounded { opened, left: LONGEST_ROW });
        let mut header = StringRecord::new();
        let found = next_record(&mut reader, &mut header, path)?;
        let fault = |message: String, help: String| {
            Diagnostic::input(
                Location::line(path, header.position().map_or(1, |place| place.line() as usize)),
                message,
                help,
            )
        };
        let expected = || {
            if header.len() == 1 && header.iter().any(|cell| cell.contains([';', '\t'])) {
                return "the cells of a file of commands are separated by commas, and its decimal sign is a point"
                    .into();
            }
            let axes: Vec<String> = machine.axes.iter().map(|axis| axis.column("")).collect();
            format!(
                "the header names axis positions ({}) or a pose (px_mm, py_mm, pz_mm with i, j, k or qw, qx, qy, qz)",
                axes.join(", ")
            )
        };
        if !found {
            return Err(fault("the file of commands is empty".into(), expected()));
        }
        let meanings: Vec<Meaning> =
            header.iter().enumerate().map(|(place, name)| meaning(machine, name, place == 0)).collect();
        for (place, meaning) in meanings.iter().enumerate() {
            let same = |other: &Meaning| match (meaning, other) {
                (Meaning::Of(a), Meaning::Of(b)) => a.same_as(b),
                (Meaning::Pose(a, _), Meaning::Pose(b, _)) => a == b,
                _ => false,
            };
            if let Some(other) = meanings[..place].iter().position(same) {
                return Err(fault(
                    format!("columns `{}` and `{}` have the same meaning", &header[other], &header[place]),
                    "keep one of them".into(),
                ));
            }
        }
        let has = |part: usize| meanings.iter().any(|meaning| matches!(meaning, Meaning::Pose(own, _) if *own == part));
        let parts: Vec<bool> = (0..POSE.len()).map(has).collect();
        let (point, axis, quaternion) = (&parts[..3], &parts[3..6], &parts[6..]);
        let whole = |part: &[bool]| part.iter().all(|has| *has);
        let none = |part: &[bool]| !part.iter().any(|has| *has);
        let poses = match () {
            () if none(&parts) => PoseColumns::None,
            () if whole(point) && none(axis) && none(quaternion) => PoseColumns::Point,
            () if whole(point) && whole(axis) && none(quaternion) => PoseColumns::PointAndAxis,
            () if whole(point) && none(axis) && whole(quaternion) => PoseColumns::PointAndQuaternion,
            () => return Err(fault("the columns of the pose are incomplete, or state it twice".into(), expected())),
        };
        let axes = meanings.iter().any(|meaning| matches!(meaning, Meaning::Of(Role::Axis(..))));
        if axes == (poses != PoseColumns::None) {
            let message = if axes {
                "the file states both axis positions and poses of the tool"
            } else {
                "no column names an axis position or a pose of the tool"
            };
            return Err(fault(message.into(), expected()));
        }
        // An axis whose positions stand in a column without a unit would be taken to be elsewhere.
        let is_read = |axis: usize| {
            meanings.iter().any(|meaning| matches!(meaning, Meaning::Of(Role::Axis(own, _)) if *own == axis))
        };
        let unread =
            header.iter().zip(&meanings).filter(|(_, meaning)| **meaning == Meaning::Other).map(|(name, _)| name);
        let nameless = unread.clone().find_map(|name| {
            let same =
                |axis: &usize| machine.axes[*axis].name.eq_ignore_ascii_case(name.trim_start_matches('\u{feff}'));
            (0..machine.axes.len()).find(same).filter(|axis| !is_read(*axis)).map(|axis| (name, axis))
        });
        if let Some((name, axis)) = nameless {
            let axis = &machine.axes[axis];
            return Err(fault(
                format!("column `{name}` has the name of axis {}, and no unit", axis.name),
                format!("call it `{}` if it holds its positions, and otherwise by another name", axis.column("")),
            ));
        }
        let unread: Vec<&str> = unread.filter(|name| !name.is_empty()).collect();
        let line = header.position().map_or(1, |place| place.line());
        let warning = (!unread.is_empty()).then(|| {
            format!("{}:{line}: columns that are not read, and kept as they are: {}", path.display(), unread.join(", "))
        });
        Ok(CommandFile {
            warning,
            path: path.to_path_buf(),
            stamp: FileStamp::of(path, state),
            reader,
            header: header.clone(),
            meanings,
            axes: machine.axes.iter().map(|axis| (axis.column(""), axis.kind)).collect(),
            at,
            poses,
            travel: Vec::new(),
            last_run: 0,
            last: None,
        })
    }

    /// The file; the bytes that were read are known after the last block.
    pub fn stamp(&self) -> &FileStamp {
        &self.stamp
    }

    /// The columns that nothing is read from, with file and line.
    pub fn warning(&self) -> Option<&str> {
        self.warning.as_deref()
    }

    /// The names of the columns.
    pub fn header(&self) -> &StringRecord {
        &self.header
    }

    /// The axis of each column; `None` for other columns.
    pub fn axis_columns(&self) -> Vec<Option<usize>> {
        let axis = |meaning: &Meaning| match meaning {
            Meaning::Of(Role::Axis(axis, _)) => Some(*axis),
            _ => None,
        };
        self.meanings.iter().map(axis).collect()
    }

    /// The name of a column for an axis: that of the machine's tables.
    pub fn column_of(&self, axis: usize) -> String {
        self.axes.get(axis).map(|(name, _)| name.clone()).unwrap_or_default()
    }

    /// A position of an axis in the unit of that column, mm or degrees.
    pub fn display(&self, axis: usize, position: f64) -> f64 {
        self.axes.get(axis).map_or(position, |(_, kind)| kind.to_display(position))
    }

    /// A position in the unit of a column, mm and rad inside.
    pub fn in_unit_of(&self, column: usize, position: f64) -> f64 {
        match self.meanings.get(column) {
            Some(Meaning::Of(Role::Axis(_, unit))) => unit.to_display(position),
            _ => position,
        }
    }

    /// The pose columns present.
    pub fn poses(&self) -> PoseColumns {
        self.poses
    }

    /// The next rows, at most `most`; `None` at the end of the file.
    ///
    /// # Errors
    /// If the file cannot be read on, or is not text.
    pub fn next_block(&mut self, machine: &Machine, most: usize) -> Result<Option<Block>, Diagnostic> {
        let has = |wanted: Role| self.meanings.contains(&Meaning::Of(wanted));
        let (time, run) = (has(Role::Time), has(Role::Run));
        let mut block = Block {
            rows: Readings { positions: vec![Vec::new(); machine.axes.len()], channels: 1, ..Readings::default() },
            poses: Vec::new(),
            cells: Vec::new(),
            lines: Vec::new(),
            faults: Vec::new(),
        };
        let mut record = StringRecord::new();
        // Rows with a fault before the first row of numbers.
        let mut leading = 0;
        while block.cells.len() < most {
            self.reader.get_mut().left = LONGEST_ROW;
            if !next_record(&mut self.reader, &mut record, &self.path)? {
                self.stamp.finish(&self.reader.get_ref().opened)?;
                break;
            }
            let last_run = block.rows.run.last().copied().unwrap_or(self.last_run);
            let row = match self.row(&record) {
                Ok(row) => self.last.insert(row).clone(),
                Err(fault) => {
                    block.faults.push((block.cells.len(), fault));
                    leading += usize::from(self.last.is_none());
                    let nothing = Row::not_a_number(machine.axes.len(), last_run);
                    let last = self.last.clone().unwrap_or_else(|| nothing.clone());
                    Row { run: last_run, pose: nothing.pose, ..last }
                }
            };
            block.rows.positions.iter_mut().zip(&row.positions).for_each(|(column, position)| column.push(*position));
            time.then(|| block.rows.time_s.push(row.time_s));
            for (place, meaning) in self.meanings.iter().enumerate() {
                if let Meaning::Of(Role::Driver(name)) = meaning {
                    let value = row.drivers.get(place).copied().unwrap_or(f64::NAN);
                    block.rows.drivers.entry(name.clone()).or_default().push(value);
                }
            }
            run.then(|| block.rows.run.push(row.run));
            block.poses.push(row.pose);
            block.lines.push(record.position().map_or(0, csv::Position::line));
            block.cells.push(record.clone());
        }
        if block.cells.is_empty() {
            return Ok(None);
        }
        let Readings { positions, time_s, drivers, .. } = &mut block.rows;
        for column in positions.iter_mut().chain([time_s]).chain(drivers.values_mut()) {
            if let Some(first) = column.get(leading).copied() {
                column[..leading].fill(first);
            }
        }
        if self.poses == PoseColumns::None {
            self.follow(&mut block.rows, machine);
        }
        Ok(Some(block))
    }

    /// Continues the travel of the axes from the rows before, and keeps it for the rows after.
    pub fn follow(&mut self, rows: &mut Readings, machine: &Machine) {
        let before = std::mem::take(&mut self.travel);
        if rows.run.first().is_none_or(|run| *run == self.last_run) {
            rows.travel_before = before;
        }
        self.travel = if self.last.is_some() { rows.travel_after(machine) } else { Vec::new() };
        self.last_run = rows.run.last().copied().unwrap_or(self.last_run);
    }

    fn row(&self, record: &StringRecord) -> Result<Row, String> {
        if record.len() != self.header.len() {
            return Err(format!("{} cells, but the header has {}", record.len(), self.header.len()));
        }
        let mut row = Row { positions: self.at.clone(), ..Row::not_a_number(0, 0) };
        for (place, ((cell, meaning), name)) in record.iter().zip(&self.meanings).zip(&self.header).enumerate() {
            if *meaning == Meaning::Other {
                continue;
            }
            let value = number::number(cell, &Format::default()).map_err(|(fault, _)| format!("`{name}`: {fault}"))?;
            match meaning {
                Meaning::Of(Role::Axis(axis, unit)) => row.positions[*axis] = unit.to_internal(value),
                Meaning::Of(Role::Time) => row.time_s = value,
                Meaning::Of(Role::Run) if value.fract() != 0.0 => {
                    return Err(format!("`{name}`: {cell} is no integer"));
                }
                Meaning::Of(Role::Run) => row.run = value as i64,
                Meaning::Of(Role::Driver(_)) => {
                    row.drivers.resize(place + 1, f64::NAN);
                    row.drivers[place] = value;
                }
                Meaning::Pose(part, unit) => row.pose[*part] = unit.to_internal(value),
                Meaning::Of(Role::Reading(..) | Role::Socket | Role::Polar(_)) | Meaning::Other => {}
            }
        }
        Ok(row)
    }
}

/// The numbers of one row.
#[derive(Clone)]
struct Row {
    positions: Vec<f64>,
    time_s: f64,
    /// The values of driver columns, by column of the file.
    drivers: Vec<f64>,
    run: i64,
    pose: [f64; 10],
}

impl Row {
    fn not_a_number(axes: usize, run: i64) -> Row {
        Row { positions: vec![f64::NAN; axes], time_s: f64::NAN, drivers: Vec::new(), run, pose: [f64::NAN; 10] }
    }
}

/// Reads the next row that is no comment; `false` at the end.
fn next_record(reader: &mut csv::Reader<Bounded>, record: &mut StringRecord, path: &Path) -> Result<bool, Diagnostic> {
    loop {
        let found = reader.read_record(record).map_err(|cause| unreadable(path, &cause))?;
        if !found || !record.get(0).is_some_and(is_comment) {
            return Ok(found);
        }
    }
}

fn meaning(machine: &Machine, name: &str, first: bool) -> Meaning {
    let name = if first { name.trim_start_matches('\u{feff}') } else { name };
    if let Some(role) = Role::of_machine(name, machine) {
        return Meaning::Of(role);
    }
    let (stem, unit) = match name.rsplit_once('_') {
        Some((stem, unit)) if POSE[..3].contains(&stem) => (stem, Unit::of_column(unit, false)),
        _ => (name, Some(Unit::One).filter(|_| POSE[3..].contains(&name))),
    };
    match (POSE.iter().position(|part| *part == stem), unit) {
        (Some(part), Some(unit)) => Meaning::Pose(part, unit),
        _ => Meaning::Other,
    }
}

fn unreadable(path: &Path, cause: &csv::Error) -> Diagnostic {
    let line = cause.position().map(|place| place.line() as usize);
    Diagnostic::input(
        line.map_or_else(|| Location::file(path), |line| Location::line(path, line)),
        format!("the file of commands cannot be read: {cause}"),
        "a CSV in UTF-8 with a header line is expected",
    )
}
