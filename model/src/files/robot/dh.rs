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

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

use super::chain::{Chain, Joint};
use crate::axis::AxisKind;
use crate::document::source::Source;
use crate::error::{Location, ModelError};
use crate::files::import::unit;

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

/// Lengths of a table whose largest is below this are in m.
const LARGEST_M: f64 = 10.0;
/// Tolerance of an angle that is a multiple of a quarter turn, rad.
const QUARTER: f64 = 1e-3;
/// The columns of a table.
const COLUMNS: [(&str, &[&str]); 10] = [
    ("joint", &["joint", "axis", "link", "i", "name", "no", "nr", "j"]),
    ("type", &["type", "kind", "sigma"]),
    ("a", &["a", "r", "alength", "linklength"]),
    ("alpha", &["alpha", "α", "twist"]),
    ("beta", &["beta", "β"]),
    ("d", &["d", "linkoffset"]),
    ("theta", &["theta", "θ"]),
    ("offset", &["offset", "thetaoffset", "qoffset"]),
    ("lower", &["lower", "min", "qmin"]),
    ("upper", &["upper", "max", "qmax"]),
];

/// Reads a table.
///
/// # Errors
/// If a column is missing or a cell is no value, with the line and what to do.
pub fn read(source: &Source, convention: Convention) -> Result<Table, ModelError> {
    let fault = |line: usize, message: String, help: &str| ModelError::Input {
        location: Location::line(&source.file, line),
        message,
        help: Some(help.into()),
    };
    let lines: Vec<(usize, &str)> = (source.text.lines().enumerate())
        .map(|(line, text)| (line + 1, text))
        .filter(|(_, text)| !text.trim().is_empty() && !text.trim_start().starts_with('#'))
        .collect();
    const NAMES: &str = "the first line names the columns: joint,a_mm,alpha_deg,d_mm,theta_deg";
    let Some(((header_line, header), rows)) = lines.split_first() else {
        return Err(fault(1, "an empty table".into(), NAMES));
    };
    let separator = [';', '\t', ','].into_iter().find(|separator| header.contains(*separator)).unwrap_or(',');
    let cells =
        |text: &str| text.split(separator).map(|cell| cell.trim().trim_matches('"').to_string()).collect::<Vec<_>>();
    let names = cells(header);
    let mut columns = Columns { places: Vec::new(), angles_are_rad: false, lengths_are_m: false };
    for (place, name) in names.iter().enumerate() {
        let named = unit::split(name);
        let plain: String = named.base.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
        let known = COLUMNS.iter().find(|(_, words)| words.contains(&plain.trim_end_matches(char::is_numeric)));
        let Some((own, _)) = known else {
            return Err(fault(*header_line, format!("column `{name}` is no parameter"), NAMES));
        };
        columns.places.push((own, place, named.unit));
    }
    for own in ["a", "alpha", "d"] {
        if columns.place(own).is_none() {
            return Err(fault(*header_line, format!("no column `{own}`"), NAMES));
        }
    }
    let mut table = Table { convention, rows: Vec::new(), assumed: Vec::new() };
    let mut read: Vec<(DhRow, [Value; 7])> = Vec::new();
    for (line, text) in rows {
        let cells = cells(text);
        if cells.len() != names.len() {
            let message = format!("a row of {} cells under {} names", cells.len(), names.len());
            return Err(fault(*line, message, "complete the row"));
        }
        let cell = |own: &str| columns.place(own).map_or("", |place| cells[place].as_str());
        let value = |own: &str| {
            let plain = if separator == ',' { cell(own).to_string() } else { cell(own).replace(',', ".") };
            Value::parse(&plain).ok_or_else(|| {
                let help = "write a number, or an expression such as pi/2 or q2 - 90";
                fault(*line, format!("`{}` in column `{own}` is no value", cell(own)), help)
            })
        };
        let values = [
            value("a")?,
            value("alpha")?,
            value("beta")?,
            value("d")?,
            value("theta")?,
            value("lower")?,
            value("upper")?,
        ];
        let offset = value("offset")?;
        let kind = match cell("type").to_lowercase().as_str() {
            "" if values[3].moves => Some(AxisKind::Linear),
            "" | "r" | "revolute" | "rotary" | "rotation" | "0" => Some(AxisKind::Rotary),
            "p" | "prismatic" | "linear" | "translation" | "1" => Some(AxisKind::Linear),
            "f" | "fixed" | "-" => None,
            other => {
                return Err(fault(
                    *line,
                    format!("`{other}` is no type of a joint"),
                    "write rotary, prismatic or fixed",
                ));
            }
        };
        let mut values = values;
        let moved = &mut values[if kind == Some(AxisKind::Linear) { 3 } else { 4 }];
        moved.number += offset.number;
        moved.is_rad |= offset.is_rad;
        let number = read.iter().filter(|(row, _)| row.kind.is_some()).count() + 1;
        let name =
            Some(cell("joint")).filter(|name| !name.is_empty()).map_or_else(|| number.to_string(), str::to_string);
        read.push((DhRow { name, kind, ..DhRow::default() }, values));
    }
    columns.decide(&read, &mut table.assumed);
    for (mut row, [a, alpha, beta, d, theta, lower, upper]) in read {
        (row.a, row.d) = (columns.mm("a", a), columns.mm("d", d));
        (row.alpha, row.beta) = (columns.rad("alpha", alpha), columns.rad("beta", beta));
        row.theta = columns.rad(columns.theta(), theta);
        let limit = |own: &str, value: Value| match row.kind {
            Some(AxisKind::Linear) => columns.mm(own, value),
            _ => columns.rad(own, value),
        };
        row.travel = Some([limit("lower", lower), limit("upper", upper)]).filter(|[lower, upper]| lower < upper);
        table.rows.push(row);
    }
    if !table.rows.iter().any(|row| row.kind.is_some()) {
        return Err(fault(*header_line, "a table without a joint".into(), "add a row for each joint"));
    }
    Ok(table)
}

/// A cell: a number, whether a multiple of π, and whether the joint moves it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Value {
    number: f64,
    is_rad: bool,
    moves: bool,
}

impl Value {
    /// `1.5`, `-pi/2`, `q2`, `θ2 - 90`, `d3 + 0.1`; an empty cell is 0.
    fn parse(text: &str) -> Option<Value> {
        let plain: String =
            text.to_lowercase().replace('π', "pi").replace(['−', '–'], "-").split_whitespace().collect();
        let plain = plain.trim_end_matches(['°', '*']);
        let mut value = Value::default();
        let mut rest = plain.trim_start_matches('+');
        for variable in ["theta", "θ", "q", "d", "var"] {
            if let Some(after) = rest.strip_prefix(variable) {
                rest = after
                    .trim_start_matches(['_', '{', '}'])
                    .trim_start_matches(|c: char| c.is_ascii_digit() || c == '}');
                value.moves = true;
                break;
            }
        }
        while !rest.is_empty() {
            let sign = if rest.starts_with('-') { -1.0 } else { 1.0 };
            let term = rest.trim_start_matches(['+', '-']);
            if rest.len() - term.len() > 1 || term.is_empty() {
                return None;
            }
            // An exponent has a sign of its own.
            let is_end = |(k, c): &(usize, char)| *k > 0 && "+-".contains(*c) && !term[..*k].ends_with('e');
            let end = term.char_indices().find(is_end).map_or(term.len(), |(k, _)| k);
            let (number, is_rad) = term_of(&term[..end])?;
            value.number += sign * number;
            value.is_rad |= is_rad;
            rest = &term[end..];
        }
        Some(value)
    }
}

/// `90`, `pi`, `pi/2`, `0.5*pi`, `3pi/4`.
fn term_of(text: &str) -> Option<(f64, bool)> {
    let Some((before, after)) = text.split_once("pi") else { return Some((text.parse().ok()?, false)) };
    let factor = match before.trim_end_matches('*') {
        "" => 1.0,
        factor => factor.parse().ok()?,
    };
    let divisor = match after.strip_prefix('/') {
        Some(divisor) => divisor.parse().ok()?,
        None if after.is_empty() => 1.0,
        None => return None,
    };
    Some((factor * PI / divisor, true))
}

/// Which columns a table has, and the units of those that state none.
struct Columns {
    places: Vec<(&'static str, usize, Option<unit::Unit>)>,
    angles_are_rad: bool,
    lengths_are_m: bool,
}

impl Columns {
    fn place(&self, own: &str) -> Option<usize> {
        self.places.iter().find(|(name, ..)| *name == own).map(|(_, place, _)| *place)
    }

    fn unit(&self, own: &str) -> Option<unit::Unit> {
        self.places.iter().find(|(name, ..)| *name == own).and_then(|(.., unit)| *unit)
    }

    /// The column of the joint angle.
    fn theta(&self) -> &'static str {
        if self.place("theta").is_some() { "theta" } else { "offset" }
    }

    /// Decides the units that no name states, and says so.
    fn decide(&mut self, rows: &[(DhRow, [Value; 7])], assumed: &mut Vec<String>) {
        // Angles of a table are quarter turns, nearly all of them.
        let plain: Vec<f64> = (rows.iter())
            .flat_map(|(_, values)| [values[1], values[4]])
            .filter(|value| !value.is_rad && value.number != 0.0)
            .map(|value| value.number.abs())
            .collect();
        let is_quarter = |angle: &f64| ((angle / FRAC_PI_2).round() * FRAC_PI_2 - angle).abs() < QUARTER;
        let lengths = rows.iter().flat_map(|(_, values)| [values[0].number.abs(), values[3].number.abs()]);
        let largest = lengths.fold(0.0, f64::max);
        self.lengths_are_m = largest < LARGEST_M;
        self.angles_are_rad = !plain.is_empty() && plain.iter().all(|angle| *angle <= TAU && is_quarter(angle));
        let is_open = |own: &str| self.place(own).is_some() && self.unit(own).is_none();
        if !plain.is_empty() && (is_open("alpha") || is_open(self.theta())) {
            let unit = if self.angles_are_rad { "rad" } else { "deg" };
            assumed.push(format!("the unit of the angles is not stated: {unit}"));
        }
        if largest > 0.0 && (is_open("a") || is_open("d")) {
            let unit = if self.lengths_are_m { "m" } else { "mm" };
            assumed.push(format!("the unit of the lengths is not stated: {unit}"));
        }
    }

    /// An angle of a column, rad.
    fn rad(&self, own: &str, value: Value) -> f64 {
        let is_rad = value.is_rad || self.unit(own).map_or(self.angles_are_rad, |unit| unit.own == "rad");
        if is_rad { value.number } else { value.number.to_radians() }
    }

    /// A length of a column, mm.
    fn mm(&self, own: &str, value: Value) -> f64 {
        value.number
            * match self.unit(own) {
                Some(unit) if unit.own == "m" => 1e3,
                Some(unit) if unit.own == "in" => 25.4,
                Some(unit) => unit.factor,
                None if self.lengths_are_m => 1e3,
                None => 1.0,
            }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_is_a_number_or_an_expression() {
        let of = |text: &str| Value::parse(text).map(|value| (value.number, value.is_rad, value.moves));
        assert_eq!(of(""), Some((0.0, false, false)));
        assert_eq!(of("-612.5"), Some((-612.5, false, false)));
        assert_eq!(of("pi/2"), Some((FRAC_PI_2, true, false)));
        assert_eq!(of("-π/2"), Some((-FRAC_PI_2, true, false)));
        assert_eq!(of("q2 - 90"), Some((-90.0, false, true)));
        assert_eq!(of("θ3 + 0.5*pi"), Some((FRAC_PI_2, true, true)));
        assert_eq!(of("1e-3"), Some((1e-3, false, false)));
        assert_eq!(of("d3"), Some((0.0, false, true)));
        assert_eq!(of("ninety"), None);
    }
}
