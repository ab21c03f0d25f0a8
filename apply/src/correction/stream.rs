//! Files of commands, corrected block by block: the memory does not depend on the length of the file.

use std::io::Write;

use abbe_files::commands::{Block, CommandFile, PoseColumns};
use abbe_identify::error;
use abbe_identify::numerics::parallel;
use abbe_model::Diagnostic;
use abbe_model::pose::{Aim, Pose, reach};
use abbe_model::session::readings::Readings;
use abbe_model::unit::{ARCSEC_PER_RAD, UM_PER_MM};
use csv::StringRecord;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

use super::{Correction, State};
use crate::error::unrepresentable;

/// Rows of a block.
const BLOCK_ROWS: usize = 2048;
/// Blocks in memory.
const BLOCKS: usize = 16;
/// Number of rows whose states are listed.
const LISTED: usize = 20;

/// What is written for each row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// The corrected command.
    Command,
    /// The error of the tool's pose at the command.
    Error,
}

impl Output {
    /// The columns that are added to those of the file.
    fn columns(self) -> &'static [&'static str] {
        match self {
            Output::Command => &["remaining_um", "remaining_arcsec", "condition", "state"],
            Output::Error => &["dx_um", "dy_um", "dz_um", "da_arcsec", "db_arcsec", "dc_arcsec", "state"],
        }
    }
}

/// What became of the rows of a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Summary {
    /// Number of rows.
    pub rows: usize,
    /// Number of rows by state, in the order of their first occurrence.
    pub states: Vec<StateCount>,
    /// Largest error of the position before, µm.
    pub largest_error_um: f64,
    /// Largest error of the orientation before, arcsec.
    pub largest_error_arcsec: f64,
    /// Largest remaining error of the position over all rows that have a command; `null` for errors.
    pub largest_remaining_um: Option<f64>,
    /// The same of the orientation, arcsec; `null` for errors.
    pub largest_remaining_arcsec: Option<f64>,
    /// The tool point that the correction presumes, in the tool frame, mm.
    pub tool_mm: [f64; 3],
    /// The first rows that are not simply corrected.
    pub marked: Vec<MarkedRow>,
}

/// Number of rows in a state.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct StateCount {
    /// The state.
    pub state: &'static str,
    /// Number of rows.
    pub rows: usize,
}

/// A row that is not simply corrected.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MarkedRow {
    /// Its line in the file, from 1.
    pub line: u64,
    /// Its state.
    pub state: &'static str,
    /// The fault of a row that is not a number; otherwise empty.
    pub fault: String,
}

/// Corrects a file, or states its errors, and writes the rows in their order: their cells, with the positions of the
/// axes replaced, and columns for what remains. Axes without a column get one.
///
/// # Errors
/// If the file cannot be read, lacks a column that an error depends on, has a column of the output, or states what the
/// machine cannot correct, or if a row cannot be written.
pub fn run(
    correction: &Correction<'_>,
    file: &mut CommandFile,
    output: Output,
    start: &[f64],
    to: &mut dyn Write,
) -> Result<Summary, Diagnostic> {
    check(correction, file.poses())?;
    if let Some(effect) = correction.errors.with_history() {
        return Err(unrepresentable(
            "the compensation",
            format!("the effect {effect}"),
            "it follows its driver with a lag, which depends on all commands before; save a model in which it follows the \
             driver without delay",
        ));
    }
    let layout = Layout::of(correction, file, output);
    if let Some(name) = output.columns().iter().find(|name| file.header().iter().any(|own| own == **name)) {
        return Err(error::not_applicable(
            format!("the commands have a column `{name}`, which the output adds"),
            "the file may be corrected already",
            "remove the column or give it another name",
        ));
    }
    write(to, layout.header(file).as_bytes())?;
    let mut summary = Summary { tool_mm: correction.tool_mm, ..Summary::default() };
    let mut last = start.to_vec();
    let mut waiting: Option<(Block, Vec<bool>)> = None;
    loop {
        let mut blocks: Vec<(Block, Vec<bool>)> = waiting.take().into_iter().collect();
        let mut ended = false;
        while blocks.len() <= BLOCKS && !ended {
            let Some(mut block) = file.next_block(correction.machine, BLOCK_ROWS)? else {
                ended = true;
                continue;
            };
            let unreachable = reach_poses(correction, file, &mut block, &mut last);
            if let Some((before, _)) = blocks.last_mut() {
                before.rows.continue_with(&block.rows);
            }
            blocks.push((block, unreachable));
        }
        // The speed at the last row of a block depends on the row after it.
        waiting = if ended { None } else { blocks.pop() };
        if blocks.is_empty() {
            return Ok(summary);
        }
        let done = parallel::map(blocks.len(), &|number| {
            let (block, unreachable) = &blocks[number];
            layout.block(correction, file, block, unreachable)
        });
        for (result, (block, _)) in done.into_iter().zip(&blocks) {
            let (text, rows) = result?;
            write(to, &text)?;
            summary.add(block, &rows, output);
        }
    }
}

fn write(to: &mut dyn Write, bytes: &[u8]) -> Result<(), Diagnostic> {
    to.write_all(bytes).map_err(|cause| error::not_written("the output", cause))
}

fn check(correction: &Correction<'_>, poses: PoseColumns) -> Result<(), Diagnostic> {
    let fits = match correction.aim {
        _ if poses == PoseColumns::None => true,
        Aim::Position => poses == PoseColumns::Point,
        Aim::PositionAndAxis => poses != PoseColumns::Point,
        Aim::Pose => poses == PoseColumns::PointAndQuaternion,
    };
    if fits {
        return Ok(());
    }
    let needs = match correction.aim {
        Aim::Position => "px_mm, py_mm, pz_mm alone",
        Aim::PositionAndAxis => "px_mm, py_mm, pz_mm and the direction of the tool's Z, i, j, k",
        Aim::Pose => "px_mm, py_mm, pz_mm and a quaternion, qw, qx, qy, qz",
    };
    let format = "the columns of the commands";
    Err(unrepresentable(format, "poses of this machine's tool", format!("these are stated by {needs}")))
}

/// Replaces the poses of a block by axis positions. Returns whether each row is out of reach; nothing for a file of
/// axis positions.
fn reach_poses(
    correction: &Correction<'_>,
    file: &mut CommandFile,
    block: &mut Block,
    last: &mut Vec<f64>,
) -> Vec<bool> {
    let machine = correction.machine;
    if file.poses() == PoseColumns::None {
        return Vec::new();
    }
    let mut unreachable = vec![false; block.cells.len()];
    for (row, stated) in block.poses.iter().enumerate() {
        let faulty = block.faults.iter().any(|(fault, _)| *fault == row);
        let found = pose(stated, file.poses())
            .filter(|_| !faulty)
            .and_then(|pose| reach::axis_positions(machine, correction.tool_mm, correction.aim, &pose, last));
        unreachable[row] = found.is_none() && !faulty;
        if let Some(found) = found {
            *last = found;
        }
        for (column, position) in block.rows.positions.iter_mut().zip(last.iter()) {
            column[row] = *position;
        }
    }
    file.follow(&mut block.rows, machine);
    unreachable
}

/// The pose that a row states; `None` if its direction or quaternion has no length.
fn pose(stated: &[f64; 10], columns: PoseColumns) -> Option<Pose> {
    let point_mm = Vector3::new(stated[0], stated[1], stated[2]);
    let directions = match columns {
        PoseColumns::PointAndAxis => {
            let axis = Vector3::new(stated[3], stated[4], stated[5]).try_normalize(1e-9)?;
            // Only the tool's Z is wanted: the other two directions are any that complete it.
            let across = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
            let first = across.cross(&axis).normalize();
            Matrix3::from_columns(&[first, axis.cross(&first), axis])
        }
        PoseColumns::PointAndQuaternion => {
            let quaternion = Quaternion::new(stated[6], stated[7], stated[8], stated[9]);
            *UnitQuaternion::try_new(quaternion, 1e-9)?.to_rotation_matrix().matrix()
        }
        PoseColumns::Point | PoseColumns::None => Matrix3::identity(),
    };
    Some(Pose { point_mm, directions })
}

/// The columns of the output.
struct Layout {
    output: Output,
    /// The axis of each column of the file.
    columns: Vec<Option<usize>>,
    /// The axes that get a column.
    added: Vec<usize>,
}

/// A row's state, and its errors: before in µm and arcsec, remaining in µm and arcsec.
type RowResult = (State, [f64; 4]);

impl Layout {
    fn of(correction: &Correction<'_>, file: &CommandFile, output: Output) -> Layout {
        let columns = file.axis_columns();
        let poses = file.poses() != PoseColumns::None;
        let needed = |axis: &usize| match output {
            Output::Command => correction.aim.axes(correction.machine).contains(axis) || poses,
            Output::Error => poses,
        };
        let absent = |axis: &usize| !columns.contains(&Some(*axis));
        let added = (0..correction.machine.axes.len()).filter(|axis| needed(axis) && absent(axis)).collect();
        Layout { output, columns, added }
    }

    fn header(&self, file: &CommandFile) -> String {
        let mut names: Vec<String> = file.header().iter().map(quoted).collect();
        names.extend(self.added.iter().map(|axis| file.column_of(*axis)));
        names.extend(self.output.columns().iter().map(ToString::to_string));
        names.join(",") + "\n"
    }

    /// The text of a block, and the result of each row.
    fn block(
        &self,
        correction: &Correction<'_>,
        file: &CommandFile,
        block: &Block,
        unreachable: &[bool],
    ) -> Result<(Vec<u8>, Vec<RowResult>), Diagnostic> {
        let errors = correction.pose_errors(&block.rows)?;
        let state_of = |row: usize, state: State| match () {
            () if unreachable.get(row).copied().unwrap_or(false) => State::NotReachable,
            () if block.faults.iter().any(|(fault, _)| *fault == row) => State::NotANumber,
            () => state,
        };
        let mut text = Vec::with_capacity(block.cells.len() * 160);
        let mut results = Vec::with_capacity(block.cells.len());
        let before = |error: &[f64; 6]| {
            let length = |part: &[f64]| part.iter().map(|value| value * value).sum::<f64>().sqrt();
            [UM_PER_MM * length(&error[..3]), ARCSEC_PER_RAD * length(&error[3..])]
        };
        match self.output {
            Output::Error => {
                for (row, error) in errors.iter().enumerate() {
                    let number = error.iter().all(|value| value.is_finite());
                    let state = state_of(row, if number { State::Corrected } else { State::NotANumber });
                    let usable = state == State::Corrected;
                    self.cells(&mut text, file, &block.cells[row], &block.rows, row, usable, false);
                    for (part, value) in error.iter().enumerate() {
                        let scale = if part < 3 { UM_PER_MM } else { ARCSEC_PER_RAD };
                        let _ = if usable { write!(text, ",{:.6}", value * scale) } else { write!(text, ",") };
                    }
                    let _ = writeln!(text, ",{}", if usable { "evaluated" } else { state.word() });
                    let [um, arcsec] = before(error);
                    results.push((state, [um, arcsec, f64::NAN, f64::NAN]));
                }
            }
            Output::Command => {
                let corrected = correction.correct(&block.rows)?;
                let mut commands = block.rows.clone();
                for (row, found) in corrected.iter().enumerate() {
                    for (column, position) in commands.positions.iter_mut().zip(&found.positions) {
                        column[row] = *position;
                    }
                }
                for (row, (found, error)) in corrected.iter().zip(&errors).enumerate() {
                    let state = state_of(row, found.state);
                    let usable = !matches!(state, State::NotANumber | State::NotReachable);
                    let replaced = usable && state != State::NotCorrectable;
                    self.cells(&mut text, file, &block.cells[row], &commands, row, usable, replaced);
                    let [um, arcsec] = [UM_PER_MM * found.remaining_mm, ARCSEC_PER_RAD * found.remaining_rad];
                    let _ = match usable {
                        // A singular matrix has no condition.
                        true if !found.condition.is_finite() => {
                            writeln!(text, ",{um:.6},{arcsec:.6},,{}", state.word())
                        }
                        true => writeln!(text, ",{um:.6},{arcsec:.6},{:.4e},{}", found.condition, state.word()),
                        false => writeln!(text, ",,,,{}", state.word()),
                    };
                    let [before_um, before_arcsec] = before(error);
                    results.push((state, [before_um, before_arcsec, um, arcsec]));
                }
            }
        }
        Ok((text, results))
    }

    /// The cells of a row; with `replaced`, the axis positions are those of `rows`. Without `usable`, added columns are
    /// empty.
    #[expect(clippy::too_many_arguments, reason = "the parts of one row of a table")]
    fn cells(
        &self,
        text: &mut Vec<u8>,
        file: &CommandFile,
        cells: &StringRecord,
        rows: &Readings,
        row: usize,
        usable: bool,
        replaced: bool,
    ) {
        for (place, cell) in cells.iter().enumerate() {
            if place > 0 {
                text.push(b',');
            }
            match self.columns.get(place).copied().flatten().filter(|_| replaced) {
                Some(axis) => {
                    let _ = write!(text, "{:.10}", file.in_unit_of(place, rows.positions[axis][row]));
                }
                None => text.extend_from_slice(quoted(cell).as_bytes()),
            }
        }
        for axis in &self.added {
            let position = file.display(*axis, rows.positions[*axis][row]);
            let _ = if usable { write!(text, ",{position:.10}") } else { write!(text, ",") };
        }
    }
}

/// A cell, in quotes if it needs them.
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_string() }
}

impl Summary {
    /// Number of rows that have no command: no numbers, or not reachable.
    pub fn without_command(&self) -> usize {
        let none = [State::NotANumber, State::NotReachable].map(State::word);
        self.states.iter().filter(|count| none.contains(&count.state)).map(|count| count.rows).sum()
    }

    fn add(&mut self, block: &Block, rows: &[RowResult], output: Output) {
        self.rows += rows.len();
        for (row, (state, [before_um, before_arcsec, um, arcsec])) in rows.iter().enumerate() {
            let word = match (output, state) {
                (Output::Error, State::Corrected) => "evaluated",
                _ => state.word(),
            };
            match self.states.iter_mut().find(|count| count.state == word) {
                Some(count) => count.rows += 1,
                None => self.states.push(StateCount { state: word, rows: 1 }),
            }
            let usable = !matches!(state, State::NotANumber | State::NotReachable);
            if usable {
                self.largest_error_um = self.largest_error_um.max(*before_um);
                self.largest_error_arcsec = self.largest_error_arcsec.max(*before_arcsec);
            }
            if output == Output::Command && usable {
                let most = |so_far: Option<f64>, value: f64| Some(so_far.unwrap_or(0.0).max(value));
                self.largest_remaining_um = most(self.largest_remaining_um, *um);
                self.largest_remaining_arcsec = most(self.largest_remaining_arcsec, *arcsec);
            }
            if *state != State::Corrected && self.marked.len() < LISTED {
                let fault = block.faults.iter().find(|(fault, _)| *fault == row);
                let fault = fault.map_or_else(String::new, |(_, fault)| fault.clone());
                self.marked.push(MarkedRow { line: block.lines[row], state: word, fault });
            }
        }
    }
}

#[cfg(test)]
mod tests;
