//! Tables of Denavit–Hartenberg parameters: one row for each joint.
//!
//! ```text
//! standard (Denavit & Hartenberg, J. Appl. Mech. 22 (1955) 215):  T = Π Rz(θ + q)·Tz(d)·Tx(a)·Rx(α)
//! modified (Craig, Introduction to Robotics, 1989, ch. 3):        T = Π Tx(a)·Rx(α)·Rz(θ + q)·Tz(d)
//! ```
//!
//! The table is a CSV file with a line of names: `a`, `alpha`, `d`, `theta` (the offset of the joint angle), and if needed
//! `joint`, `type` (rotary, prismatic, fixed), `lower`, `upper`, `beta` (the angle of Hayati behind `alpha`). A name may have a
//! unit: `a_mm`, `alpha [rad]`. A cell may be an expression: `pi/2`, `q2 - 90`, and `q3` as `d` of a prismatic joint.

mod cell;
mod columns;
mod row;

use abbe_model::axis::AxisKind;
use abbe_model::code::MAX_AXES;
use abbe_model::diagnostic::{Diagnostic, Location};
use abbe_model::instrument::Fault;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

use self::columns::{Columns, NAMES};
use self::row::RowRead;
use super::chain::{Chain, Joint};
use crate::source::Source;
use crate::table::comment::is_comment;

/// The order of the four motions of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Convention {
    /// `Rz(θ)·Tz(d)·Tx(a)·Rx(α)`.
    Standard,
    /// `Tx(a)·Rx(α)·Rz(θ)·Tz(d)`.
    Modified,
}

impl Convention {
    /// Both, by their words.
    pub const WORDS: [(&'static str, Convention); 2] =
        [("standard", Convention::Standard), ("modified", Convention::Modified)];

    /// The convention of a word.
    pub fn of_word(word: &str) -> Option<Convention> {
        Convention::WORDS.iter().find(|(own, _)| *own == word).map(|(_, convention)| *convention)
    }
}

/// A row of a table, mm and rad.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DhRow {
    /// The name of the joint.
    pub name: String,
    /// What moves; `None` for a fixed row.
    pub kind: Option<AxisKind>,
    /// Length along X.
    pub a: f64,
    /// Angle about X.
    pub alpha: f64,
    /// Hayati's angle about Y.
    pub beta: f64,
    /// Offset of the joint angle, or the angle of a prismatic joint.
    pub theta: f64,
    /// Length along Z, or the offset of a prismatic joint.
    pub d: f64,
    /// Least and greatest position, mm or rad.
    pub travel: Option<[f64; 2]>,
}

/// A table with its convention.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The convention.
    pub convention: Convention,
    /// The rows from the base.
    pub rows: Vec<DhRow>,
    /// What the file left open, and how it was read.
    pub assumed: Vec<String>,
}

/// Reads a table.
///
/// # Errors
/// If a column is missing, stands twice or has the unit of something else; if a cell is no value, or the joint moves a
/// parameter that no joint moves: with the line and what to do.
pub fn read(source: &Source, convention: Convention) -> Result<Table, Diagnostic> {
    let lines: Vec<(usize, &str)> = (source.text.lines().enumerate())
        .map(|(line, text)| (line + 1, text))
        .filter(|(_, text)| !text.trim().is_empty() && !is_comment(text))
        .collect();
    let at = |line: usize| {
        move |(message, help): Fault| Diagnostic::input(Location::line(&source.file, line), message, help)
    };
    let Some(((header_line, header), rows)) = lines.split_first() else {
        return Err(at(1)(("an empty table".into(), NAMES.into())));
    };
    let separator = [';', '\t', ','].into_iter().find(|separator| header.contains(*separator)).unwrap_or(',');
    let cells =
        |text: &str| text.split(separator).map(|cell| cell.trim().trim_matches('"').to_string()).collect::<Vec<_>>();
    let names = cells(header);
    let mut columns = Columns::of(&names).map_err(at(*header_line))?;
    let mut read: Vec<RowRead> = Vec::new();
    let mut joints = 0;
    for (line, text) in rows {
        let cells = cells(text);
        if cells.len() != names.len() {
            let message = format!("a row of {} cells under {} names", cells.len(), names.len());
            return Err(at(*line)((message, "complete the row".into())));
        }
        let row = RowRead::of(|own| columns.place(own), &cells, separator != ',', joints + 1, *line);
        read.push(row.map_err(at(*line))?);
        joints += usize::from(read.last().is_some_and(|row| row.kind.is_some()));
        if joints > MAX_AXES {
            let message = format!("more than {MAX_AXES} joints, which is the limit of axes");
            return Err(at(*line)((message, "a table has one row for each joint of a serial chain".into())));
        }
    }
    let mut table = Table { convention, rows: Vec::new(), assumed: columns.decide(&read) };
    if !columns.unread.is_empty() {
        let (file, unread) = (source.file.display(), columns.unread.join(", "));
        table.assumed.push(format!("{file}:{header_line}: columns that are not read: {unread}"));
    }
    // A variable has no number. Beside numbers of other joints it may be one that was forgotten.
    let numbered = |own: &str| read.iter().any(|row| row.kind.is_some() && row.is_filled(own) && !row.value(own).moves);
    for row in &read {
        let mut blank = row.blank(|own| columns.place(own));
        let variable = if row.kind == Some(AxisKind::Linear) { "d" } else { "theta" };
        if row.kind.is_some() && columns.place(variable).is_some() && !row.is_filled(variable) && numbered(variable) {
            blank.push(variable);
        }
        if !blank.is_empty() {
            let (blank, file) = (blank.join("`, `"), source.file.display());
            table.assumed.push(format!("{file}:{}: `{blank}` of joint `{}` is empty: 0", row.line, row.name));
        }
    }
    for row in &read {
        table.rows.push(columns.row(row, &mut table.assumed).map_err(at(row.line))?);
    }
    if !table.rows.iter().any(|row| row.kind.is_some()) {
        return Err(at(*header_line)(("a table without a joint".into(), "add a row for each joint".into())));
    }
    Ok(table)
}

impl Table {
    /// The frames of the rows with all joints at zero: for each row that of its joint, and the flange.
    pub fn frames(&self) -> (Vec<Isometry3<f64>>, Isometry3<f64>) {
        let turn = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
        let along = |x: f64, z: f64| Translation3::new(x, 0.0, z);
        let mut frame = Isometry3::identity();
        let mut frames = Vec::with_capacity(self.rows.len());
        for row in &self.rows {
            let about_x =
                Isometry3::from_parts(along(row.a, 0.0), turn(Vector3::x(), row.alpha) * turn(Vector3::y(), row.beta));
            let about_z = Isometry3::from_parts(along(0.0, row.d), turn(Vector3::z(), row.theta));
            match self.convention {
                Convention::Standard => {
                    frames.push(frame);
                    frame = frame * about_z * about_x;
                }
                Convention::Modified => {
                    frame *= about_x;
                    frames.push(frame);
                    frame *= about_z;
                }
            }
        }
        (frames, frame)
    }

    /// The chain of the table.
    pub fn chain(&self, name: &str) -> Chain {
        let (frames, end) = self.frames();
        let joints = self.rows.iter().zip(frames).filter_map(|(row, pose)| {
            let (name, travel) = (row.name.clone(), row.travel);
            Some(Joint { name, kind: row.kind?, pose, direction: Vector3::z(), travel })
        });
        Chain {
            name: name.to_string(),
            base: "frame 0".into(),
            flange: format!("frame {}", self.rows.len()),
            joints: joints.collect(),
            end,
            assumed: self.assumed.clone(),
        }
    }
}
