//! Corrected commands: axis positions at which the machine with its errors stands where the machine without errors
//! stands at the commanded positions.
//!
//! ```text
//! T(q′, E(q′)) = T(q, 0),    T = T_w⁻¹ T_t, the tool in the table frame
//! q′ ← q′ − J⁺ r(q′)
//! ```
//!
//! `r` is the deviation of position and orientation, `J` its derivative by the axes, from dual numbers through the
//! chain. `J⁺` is that of the machine without errors at the commanded position. The slopes of the errors, a few parts in
//! 10⁵ of the travel, follow from the steps themselves (Broyden). The errors are evaluated again at every `q′`.
//!
//! The deviation and its Jacobian are those of [`abbe_model::pose`]; `nearest` corrects rows near a singularity;
//! [`stream`] corrects files of commands.

mod nearest;
pub mod stream;

use abbe_identify::error;
use abbe_model::Diagnostic;
use abbe_model::chain::{AxisPosition, BodyErrors, Machine};
use abbe_model::sensitivity::SlotValues;
use abbe_model::session::readings::Readings;
use nalgebra::{SVector, Vector6};

use abbe_identify::model_file::errors::MachineErrors;
use abbe_model::pose::jacobian::{Inverse, MAX_AXES, lever_mm};
use abbe_model::pose::{Aim, Pose, TOLERANCE_MM, TOLERANCE_RAD, size};

/// Maximum number of iterations.
const MAX_STEPS: usize = 30;
/// Remaining position error at which the iteration ends, mm.
const CONVERGENCE_MM: f64 = 1e-10;
/// Remaining angular error at which the iteration ends, rad.
const CONVERGENCE_RAD: f64 = 1e-12;
/// Ratio of the largest to the smallest singular value of the Jacobian from which a position is near a singularity.
/// Angles count as arcs at a radius of 1 m.
pub const NEAR_SINGULAR: f64 = 1e3;
/// Largest correction of an axis, mm or mm at a radius of 1 m (5.7°). A larger one is no correction of geometric errors.
const LARGEST_CORRECTION_MM: f64 = 100.0;
/// Share of the deviation at the command up to which a command that does not remove it is better.
const BETTER: f64 = 0.9;
/// Distance from the command at which the iteration ends, mm or mm at a radius of 1 m: it may pass the limit on its way.
const LARGEST_DISTANCE_MM: f64 = 1000.0;

/// What became of a commanded position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Corrected.
    Corrected,
    /// The position is corrected by the linear axes, the orientation is not: near a singularity, where small rotations
    /// of the tool need large motions of the rotary axes.
    PositionOnly,
    /// Corrected near a singularity by a machine without linear axes that could correct the position alone.
    NearSingular,
    /// No command near it removes the error: a singularity, or errors too large. This command leaves less of it.
    Reduced,
    /// The same, and no command near it leaves less. The command is unchanged.
    NotCorrectable,
    /// The corrected command lies beyond the travel of an axis.
    BeyondTravel,
    /// A position or a column of the row is not a number. The command is unchanged.
    NotANumber,
    /// No axis positions reach the pose.
    NotReachable,
}

impl State {
    /// The state as a word of the output.
    pub fn word(self) -> &'static str {
        match self {
            State::Corrected => "corrected",
            State::PositionOnly => "position-only",
            State::NearSingular => "near-singular",
            State::Reduced => "reduced",
            State::NotCorrectable => "not-correctable",
            State::BeyondTravel => "beyond-travel",
            State::NotANumber => "not-a-number",
            State::NotReachable => "not-reachable",
        }
    }
}

/// A corrected command.
#[derive(Clone, Debug, PartialEq)]
pub struct Corrected {
    /// Positions to command, by axis of the machine, mm or rad.
    pub positions: Vec<f64>,
    /// Distance of the tool point from its nominal position at that command, mm.
    pub remaining_mm: f64,
    /// Angle between the tool and its nominal orientation at that command, rad, whether the machine corrects it or not;
    /// without the rotation about the tool's axis where that is free.
    pub remaining_rad: f64,
    /// Ratio of the largest to the smallest singular value of the Jacobian; angles as arcs at a radius of 1 m.
    pub condition: f64,
    /// What became of the command.
    pub state: State,
}

/// A machine with errors, and the point of the tool that is to be where it belongs.
#[derive(Clone, Copy)]
pub struct Correction<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Its errors.
    pub errors: &'a dyn MachineErrors,
    /// The tool point in the tool frame, mm.
    pub tool_mm: [f64; 3],
    /// What the axes correct.
    pub aim: Aim,
}

/// The errors of a block of rows by slot, ready for a row at a time.
struct Rows<'v> {
    constant: &'v [f64],
    varying: Vec<Option<&'v [f64]>>,
}

impl<'v> Rows<'v> {
    fn of(values: &'v SlotValues, slots: usize) -> Rows<'v> {
        let mut varying = vec![None; slots];
        for (slot, column) in &values.varying {
            if let Some(place) = varying.get_mut(*slot) {
                *place = Some(column.as_slice());
            }
        }
        Rows { constant: &values.constant, varying }
    }

    fn bodies(&self, machine: &Machine, row: usize) -> Vec<BodyErrors<f64>> {
        machine.body_errors(
            |slot| self.constant[slot] != 0.0 || self.varying[slot].is_some(),
            |slot| self.constant[slot] + self.varying[slot].map_or(0.0, |column| column[row]),
        )
    }
}

impl Correction<'_> {
    /// The errors of the tool's pose at each row, in the table frame: mm and rad, six per row. Positions are given as
    /// readings without observed values, because errors may depend on time, temperature and direction of travel.
    ///
    /// # Errors
    /// If the rows lack a column that an error depends on.
    pub fn pose_errors(&self, commanded: &Readings) -> Result<Vec<[f64; 6]>, Diagnostic> {
        let values = self.errors.along(commanded)?(commanded)?;
        let rows = Rows::of(&values, self.machine.error_slots());
        let mut state = Vec::new();
        let all = Aim::Pose;
        Ok((0..commanded.rows())
            .map(|row| {
                commanded.state(self.machine, row, &mut state);
                let nominal = Pose::nominal(self.machine, &state, self.tool_mm);
                let actual = Pose::of(self.machine, &state, &rows.bodies(self.machine, row), self.tool_mm);
                all.deviation(&actual, &nominal).into()
            })
            .collect())
    }

    /// The corrected command of each row.
    ///
    /// # Errors
    /// If the rows lack a column that an error depends on, or the machine has too many axes.
    pub fn correct(&self, commanded: &Readings) -> Result<Vec<Corrected>, Diagnostic> {
        let machine = self.machine;
        let axes = self.aim.axes(machine);
        if axes.len() > MAX_AXES {
            let (name, range) = ("compensation".to_string(), [1.0, MAX_AXES as f64]);
            return Err(error::out_of_range(name, axes.len() as f64, range, "axes"));
        }
        let errors = self.errors.along(commanded)?;
        let linear = Aim::Position.axes(machine);
        let mut rows: Vec<Row> = Vec::with_capacity(commanded.rows());
        let mut state: Vec<AxisPosition<f64>> = Vec::new();
        for row in 0..commanded.rows() {
            commanded.state(machine, row, &mut state);
            let number = commanded.positions.iter().all(|column| column[row].is_finite());
            let mut inverse = Inverse::at(machine, &state, self.tool_mm, self.aim, &axes);
            let mut aim = self.aim;
            if inverse.condition > NEAR_SINGULAR && aim != Aim::Position {
                let mut position = Inverse::at(machine, &state, self.tool_mm, Aim::Position, &linear);
                if position.condition <= NEAR_SINGULAR {
                    position.condition = inverse.condition;
                    (inverse, aim) = (position, Aim::Position);
                }
            }
            let singular = aim == self.aim && inverse.is_singular();
            rows.push(Row {
                wanted: Pose::nominal(machine, &state, self.tool_mm),
                aim,
                state: if !number || singular { Progress::Failed } else { Progress::Open },
                reduced: false,
                remaining: [f64::INFINITY; 2],
                number,
                inverse,
                step: SVector::zeros(),
                deviation: Vector6::zeros(),
            });
        }
        let mut positions = commanded.clone();
        let mut evaluated = None;
        for _ in 0..MAX_STEPS {
            let values = errors(&positions)?;
            let block = Rows::of(&values, machine.error_slots());
            let mut open = false;
            for (number, row) in rows.iter_mut().enumerate() {
                if row.state != Progress::Open {
                    continue;
                }
                positions.state(machine, number, &mut state);
                let actual = Pose::of(machine, &state, &block.bodies(machine, number), self.tool_mm);
                let deviation = row.aim.deviation(&actual, &row.wanted);
                let axes = if row.aim == self.aim { &axes } else { &linear };
                row.advance(deviation, axes, machine, number, commanded, &mut positions);
                open |= row.state == Progress::Open;
            }
            evaluated = Some(values);
            if !open {
                break;
            }
        }
        drop(evaluated);
        self.results(commanded, positions, rows, &*errors)
    }

    /// The result of each row. Rows without a correction keep their command, and state the error that remains there.
    fn results(
        &self,
        commanded: &Readings,
        mut positions: Readings,
        mut rows: Vec<Row>,
        errors: &dyn Fn(&Readings) -> Result<SlotValues, Diagnostic>,
    ) -> Result<Vec<Corrected>, Diagnostic> {
        let machine = self.machine;
        let failed = |row: &Row| {
            let [mm, rad] = row.remaining;
            row.state == Progress::Failed || mm.is_nan() || mm > TOLERANCE_MM || rad > TOLERANCE_RAD
        };
        let mut astray = Vec::new();
        for (number, row) in rows.iter_mut().enumerate() {
            let columns = || machine.axes.iter().zip(positions.positions.iter().zip(&commanded.positions));
            let too_long = columns().any(|(axis, (column, command))| {
                (column[number] - command[number]).abs() * lever_mm(axis.kind) > LARGEST_CORRECTION_MM
            });
            if too_long || failed(row) {
                row.state = Progress::Failed;
                for (column, command) in positions.positions.iter_mut().zip(&commanded.positions) {
                    column[number] = command[number];
                }
                if row.number && row.aim == self.aim {
                    astray.push(number);
                }
            }
        }
        if !astray.is_empty() {
            let lengths = nearest::settle(self, commanded, &mut positions, (&mut rows, &astray), errors)?;
            for (number, [before, after]) in astray.iter().zip(lengths) {
                let row = &mut rows[*number];
                row.state = Progress::Done;
                row.reduced = failed(row) && after < BETTER * before;
                if failed(row) && !row.reduced {
                    row.state = Progress::Failed;
                    for (column, command) in positions.positions.iter_mut().zip(&commanded.positions) {
                        column[*number] = command[*number];
                    }
                }
            }
        }
        // The orientation that the machine leaves as it is counts too.
        let reported = if self.aim == Aim::Position { Aim::Pose } else { self.aim };
        let partly = |row: &Row| failed(row) || row.aim != reported;
        let values = rows.iter().any(partly).then(|| errors(&positions)).transpose()?;
        let block = values.as_ref().map(|values| Rows::of(values, machine.error_slots()));
        let mut state = Vec::new();
        Ok(rows
            .into_iter()
            .enumerate()
            .map(|(number, row)| {
                let own: Vec<f64> = positions.positions.iter().map(|column| column[number]).collect();
                let beyond = machine.axes.iter().zip(&own).any(|(axis, q)| {
                    // Half a nanometre beyond an end is rounding.
                    axis.travel.is_some_and(|[low, high]| *q < low - 5e-7 || *q > high + 5e-7)
                });
                let corrected = !failed(&row);
                let [mut remaining_mm, mut remaining_rad] = row.remaining;
                let whole = corrected && row.aim == reported;
                if let (false, true, Some(block)) = (whole, row.number, &block) {
                    positions.state(machine, number, &mut state);
                    let actual = Pose::of(machine, &state, &block.bodies(machine, number), self.tool_mm);
                    [remaining_mm, remaining_rad] = size(&reported.deviation(&actual, &row.wanted));
                }
                let condition = row.inverse.condition;
                let state = match () {
                    () if !row.number => State::NotANumber,
                    () if row.reduced => State::Reduced,
                    () if !corrected => State::NotCorrectable,
                    () if beyond => State::BeyondTravel,
                    () if row.aim != self.aim => State::PositionOnly,
                    () if condition > NEAR_SINGULAR => State::NearSingular,
                    () => State::Corrected,
                };
                Corrected { positions: own, remaining_mm, remaining_rad, condition, state }
            })
            .collect())
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Progress {
    Open,
    Done,
    Failed,
}

/// One row in the iteration.
struct Row {
    wanted: Pose,
    /// What is corrected: that of the machine, or near a singularity the position alone.
    aim: Aim,
    inverse: Inverse,
    /// The last step of the axes, mm and mm of arc, and the deviation before it.
    step: SVector<f64, MAX_AXES>,
    deviation: Vector6<f64>,
    remaining: [f64; 2],
    state: Progress,
    number: bool,
    /// Whether its command leaves less of the deviation, although not nothing.
    reduced: bool,
}

impl Row {
    /// Ends the iteration of the row, or makes one step.
    fn advance(
        &mut self,
        deviation: Vector6<f64>,
        axes: &[usize],
        machine: &Machine,
        number: usize,
        commanded: &Readings,
        positions: &mut Readings,
    ) {
        let before = self.remaining;
        self.remaining = size(&deviation);
        let [mm, rad] = self.remaining;
        if mm <= CONVERGENCE_MM && rad <= CONVERGENCE_RAD {
            self.state = Progress::Done;
            return;
        }
        // Rounding ends the progress of machines with large coordinates above the limits.
        if mm <= TOLERANCE_MM && rad <= TOLERANCE_RAD && mm >= 0.5 * before[0] && rad >= 0.5 * before[1] {
            self.state = Progress::Done;
            return;
        }
        if before[0].is_finite() {
            self.inverse.observe(&self.step, &(deviation - self.deviation));
        }
        self.step = -self.inverse.step(&deviation);
        self.deviation = deviation;
        for (axis, change) in axes.iter().zip(self.step.iter()) {
            let column = &mut positions.positions[*axis];
            let lever_mm = lever_mm(machine.axes[*axis].kind);
            column[number] += change / lever_mm;
            let arc = (column[number] - commanded.positions[*axis][number]).abs() * lever_mm;
            if arc.is_nan() || arc > LARGEST_DISTANCE_MM {
                self.state = Progress::Failed;
            }
        }
    }
}

#[cfg(test)]
mod tests;
