//! `abbe fit --compensation`: estimated errors as compensation tables of controls, as far as their formats are publicly
//! documented.
//!
//! - **LinuxCNC** `COMP_FILE` of type 0 (INI Configuration, `[JOINT_n]`): nominal, actual forward, actual reverse; the
//!   control adds nominal less actual. It reads three numbers per line and ignores the rest (`usrmotLoadComp` in
//!   `usrmotintf.cc`). The uncertainty follows them.
//! - **Heidenhain** `.COM` (Technical Manual MANUALplus 620, 6.10.3): columns AXISPOS, BACKLASH, and one for each axis;
//!   points of the error curve (Technical Manual TNC 406/306, 4-21), positive where the travel is too long (TNC 407,
//!   1.6.3). The frame of the file is not publicly documented.
//! - **Beckhoff** TF5280 (and ISG kernel) ISG CSV format: the errors by their names of ISO 230, in mm and rad over mm
//!   and degrees.

use std::fmt::Write;
use std::path::PathBuf;

use abbe::identify::compensation::{self, Compensation, ErrorCurve};
use abbe::identify::fit::Fit;
use abbe::identify::problem::Problem;
use abbe::model::axis::AxisKind;
use abbe::model::chain::Machine;
use clap::{Args, ValueEnum};

use super::failure::Failure;
use super::folder::{self, NewFile};
use super::message::{Kind, tell};

mod uncertainty;
mod words;

pub use words::words;

/// Maximum number of points of a table: LinuxCNC reads 256 triplets per joint, Heidenhain 256 points per table.
const MAX_POINTS: usize = 256;

/// The control of a table.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Control {
    /// LinuxCNC, COMP_FILE of type 0.
    Linuxcnc,
    /// Heidenhain, columns of a .COM table.
    Heidenhain,
    /// Beckhoff TwinCAT CNC TF5280, ISG CSV format.
    Beckhoff,
}

/// Arguments of commands that estimate errors.
#[derive(Args)]
pub struct CompensationArguments {
    /// Write compensation tables of the estimated error motions into a new folder.
    ///
    /// Example: --compensation tables --control linuxcnc
    #[arg(long, value_name = "DIR", requires = "control")]
    compensation: Option<PathBuf>,
    /// The control that reads the tables.
    ///
    /// Example: --compensation tables --control beckhoff
    #[arg(long, value_enum, requires = "compensation")]
    control: Option<Control>,
    /// Number of points of a table, over the travel of the axis in the readings.
    ///
    /// Example: --compensation tables --control heidenhain --points 73
    #[arg(long, value_name = "N", default_value_t = 37, requires = "compensation")]
    points: usize,
}

impl CompensationArguments {
    /// Whether tables are requested.
    pub fn wanted(&self) -> bool {
        self.compensation.is_some()
    }

    /// Checks before the fit that the tables can be written.
    pub fn check(&self) -> Result<(), Failure> {
        let Some(folder) = &self.compensation else {
            return Ok(());
        };
        if !(2..=MAX_POINTS).contains(&self.points) {
            return Err(Failure::Other(format!(
                "`--points {}`: a number from 2 to {MAX_POINTS} is expected, the maximum of LinuxCNC and Heidenhain",
                self.points
            )));
        }
        folder::check(folder, None).map(|_| ())
    }

    /// Writes the tables if they are requested.
    pub fn run(&self, problem: &Problem, fit: &Fit, tables: bool) -> Result<(), Failure> {
        let (Some(folder), Some(control)) = (&self.compensation, self.control) else {
            return Ok(());
        };
        let compensation = compensation::of_fit(problem, fit);
        write(&problem.session.machine, &compensation, control, self.points, folder, tables)
    }
}

/// Writes tables of the estimated errors into a folder and lists the errors that they do not contain.
fn write(
    machine: &Machine,
    compensation: &Compensation,
    control: Control,
    points: usize,
    folder: &std::path::Path,
    tables: bool,
) -> Result<(), Failure> {
    let mut left_out = compensation.left_out.clone();
    if control != Control::Beckhoff {
        left_out.extend(locations(compensation));
    }
    let files = match control {
        Control::Linuxcnc => linuxcnc(machine, compensation, points, &mut left_out),
        Control::Heidenhain => heidenhain(machine, compensation, points, &mut left_out),
        Control::Beckhoff => beckhoff(machine, compensation, points, &mut left_out),
    };
    if files.is_empty() {
        let all = left_out.iter().map(|line| format!("\n  {line}")).collect::<String>();
        return Err(Failure::Other(format!(
            "no error can be compensated in this format: declare error motions as [[effect]], as `abbe trace --write` does, and fit again{all}"
        )));
    }
    let mut files = files;
    files.push(uncertainty::table(machine, compensation, points)?);
    folder::write(folder, &files, false, |_| Ok(()))?;
    if !tables {
        for line in &left_out {
            tell(Kind::Warning, &format!("not in the compensation tables: {line}"));
        }
        return Ok(());
    }
    say!("");
    for (name, _) in &files {
        say!("{}", folder.join(name).display());
    }
    match control {
        Control::Linuxcnc => {
            say!(
                "  in [JOINT_n] of the INI file: COMP_FILE = the file, COMP_FILE_TYPE = 0; the control then ignores BACKLASH"
            );
        }
        Control::Heidenhain => {
            say!(
                "  columns of a .COM table; the frame of the file is not publicly documented: enter or import the columns in the table editor"
            );
            say!(
                "  values are points of the error curve, positive where the travel is too long; check the sign on one axis first"
            );
        }
        Control::Beckhoff => {
            say!(
                "  file_format[0] ISG_CSV; values are errors (actual less nominal), which the control subtracts; `negate` reverses the sign"
            );
        }
    }
    say!("  standard uncertainty (k = 1) of each point: {}", uncertainty::FILE);
    for line in &left_out {
        say!("  not in the tables: {line}");
    }
    Ok(())
}

/// Equidistant positions that all of these curves cover, internal units.
fn positions<'c>(curves: impl IntoIterator<Item = &'c ErrorCurve>, points: usize) -> impl Iterator<Item = f64> {
    let ranges = curves.into_iter().map(|curve| &curve.range);
    let (from, to) =
        ranges.fold((f64::NEG_INFINITY, f64::INFINITY), |(from, to), range| (from.max(range.start), to.min(range.end)));
    // Curves without a common position have no table.
    let points = if from < to { points } else { 0 };
    (0..points).map(move |k| from + (to - from) * k as f64 / (points - 1) as f64)
}

/// A position in the unit of files: mm or degrees.
fn in_file_unit(kind: AxisKind, value: f64) -> f64 {
    match kind {
        AxisKind::Linear => value,
        AxisKind::Rotary => value.to_degrees(),
    }
}

/// The axis that moves in the freedom of an error, and the change of its position that equals an error of 1 in R (tool
/// against workpiece, rotary axes at zero).
fn as_position(machine: &Machine, curve: &ErrorCurve) -> Option<(usize, f64)> {
    let side = |axis: usize| if axis < machine.workpiece_side { -1.0 } else { 1.0 };
    let freedom = curve.error.freedom;
    let moves = |axis: usize| machine.axes[axis].own_freedom() == freedom && machine.axes[axis].principal().is_some();
    // The axis of the error before another axis with the same freedom.
    let axis = std::iter::once(curve.axis)
        .chain((0..machine.axes.len()).filter(|_| !freedom.is_angle()))
        .find(|axis| moves(*axis))?;
    let (_, sign) = machine.axes[axis].principal()?;
    Some((axis, side(curve.axis) / (side(axis) * sign)))
}

fn linuxcnc(machine: &Machine, compensation: &Compensation, points: usize, left_out: &mut Vec<String>) -> Vec<NewFile> {
    let mut files = Vec::new();
    for curve in &compensation.curves {
        let Some((axis, factor)) = as_position(machine, curve).filter(|(axis, _)| *axis == curve.axis) else {
            left_out.push(format!("{}: COMP_FILE compensates the positioning of a joint only", curve.error));
            continue;
        };
        let kind = machine.axes[axis].kind;
        let mut text = String::new();
        for q in positions([curve], points) {
            let actual = |direction: f64| in_file_unit(kind, q + factor * curve.at(q, direction));
            let u = curve.u_at(q, 1.0).max(curve.u_at(q, -1.0));
            let _ = writeln!(
                text,
                "{:.6} {:.6} {:.6} # u {:.6}",
                in_file_unit(kind, q),
                actual(1.0),
                actual(-1.0),
                in_file_unit(kind, u)
            );
        }
        files.push((format!("{}.comp", machine.axes[axis].name), text));
    }
    files
}

fn heidenhain(
    machine: &Machine,
    compensation: &Compensation,
    points: usize,
    left_out: &mut Vec<String>,
) -> Vec<NewFile> {
    let mut files = Vec::new();
    for axis in 0..machine.axes.len() {
        let mut columns = Vec::new();
        for curve in compensation.curves.iter().filter(|curve| curve.axis == axis) {
            match as_position(machine, curve) {
                Some((column, factor)) => columns.push((curve, column, factor)),
                None => left_out
                    .push(format!("{}: a column of a .COM table compensates the position of an axis", curve.error)),
            }
        }
        if columns.is_empty() {
            continue;
        }
        let kind = machine.axes[axis].kind;
        let own = columns.iter().find(|(_, column, _)| *column == axis);
        let backlash = own.filter(|(curve, ..)| curve.is_directional());
        for (curve, column, _) in &columns {
            if *column != axis && curve.is_directional() {
                left_out.push(without_direction(curve));
            }
        }
        let mut text = format!("{:>12}", "AXISPOS");
        if backlash.is_some() {
            let _ = write!(text, " {:>12}", "BACKLASH");
        }
        for (_, column, _) in &columns {
            let _ = write!(text, " {:>12}", machine.axes[*column].name);
        }
        text.push('\n');
        for q in positions(columns.iter().map(|(curve, ..)| *curve), points) {
            let _ = write!(text, "{:>12.5}", in_file_unit(kind, q));
            if let Some((curve, _, factor)) = backlash {
                let _ = write!(text, " {:>12.6}", in_file_unit(kind, factor * curve.at(q, -1.0)));
            }
            for (curve, column, factor) in &columns {
                let value = if *column == axis { curve.at(q, 1.0) } else { curve.mean_at(q) };
                let _ = write!(text, " {:>12.6}", in_file_unit(machine.axes[*column].kind, factor * value));
            }
            text.push('\n');
        }
        files.push((format!("{}.COM", machine.axes[axis].name), text));
    }
    files
}

fn beckhoff(machine: &Machine, compensation: &Compensation, points: usize, left_out: &mut Vec<String>) -> Vec<NewFile> {
    let letter = |name: &str| matches!(name, "X" | "Y" | "Z" | "A" | "B" | "C");
    let mut blocks = Vec::new();
    let named: Vec<_> = compensation
        .locations
        .iter()
        .filter(|(name, _)| {
            let is_known = letter(&name.axis);
            if !is_known {
                left_out.push(format!("{name}: the format has axes X, Y, Z, A, B, C only"));
            }
            is_known
        })
        .collect();
    if !named.is_empty() {
        let names: Vec<String> = named.iter().map(|(name, _)| format!("{name}")[1..].to_string()).collect();
        let values: Vec<String> = named.iter().map(|(_, value)| format!("{value:.9}")).collect();
        blocks.push(format!("// Position errors, mm and rad\n{}\n", table(&[names, values])));
    }
    for (index, axis) in machine.axes.iter().enumerate() {
        let curves: Vec<&ErrorCurve> = compensation.curves.iter().filter(|curve| curve.axis == index).collect();
        if curves.is_empty() {
            continue;
        }
        if !letter(&axis.name) {
            left_out.push(format!("error motions of {}: the format has axes X, Y, Z, A, B, C only", axis.name));
            continue;
        }
        for curve in curves.iter().filter(|curve| curve.is_directional()) {
            left_out.push(without_direction(curve));
        }
        let mut rows = vec![
            std::iter::once(axis.name.clone())
                .chain(curves.iter().map(|curve| curve.error.to_string()))
                .collect::<Vec<_>>(),
        ];
        for q in positions(curves.iter().copied(), points) {
            let position = format!("{:.5}", in_file_unit(axis.kind, q));
            rows.push(
                std::iter::once(position)
                    .chain(curves.iter().map(|curve| format!("{:.9}", curve.mean_at(q))))
                    .collect(),
            );
        }
        blocks.push(format!(
            "// Component errors of {}, mm and rad\n{}\n{}\n",
            axis.name,
            table(&rows),
            uncertainty::comments(axis.kind, &curves, points)
        ));
    }
    if blocks.is_empty() {
        return Vec::new();
    }
    vec![("volcomp.csv".to_string(), blocks.join("#\n"))]
}

/// Location errors, for formats without location errors.
fn locations(compensation: &Compensation) -> impl Iterator<Item = String> + '_ {
    let locations = compensation.locations.iter();
    locations.map(|(name, _)| {
        format!("{name}: a location error belongs in the kinematics of the control, not in this table")
    })
}

/// A curve whose table contains only the mean of both directions.
fn without_direction(curve: &ErrorCurve) -> String {
    format!("{}: the difference between the directions; the table contains the mean of both", curve.error)
}

/// Cells aligned by spaces, as in the examples of the manual.
fn table(rows: &[Vec<String>]) -> String {
    let lines = rows.iter().map(|row| {
        let cells: Vec<String> = row.iter().map(|cell| format!("{cell:<14}")).collect();
        cells.join(" ").trim_end().to_string()
    });
    lines.collect::<Vec<_>>().join("\n")
}
