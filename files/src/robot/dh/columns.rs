//! The columns of a table of Denavit–Hartenberg parameters, with their units.

use std::f64::consts::{FRAC_PI_2, TAU};

use abbe_model::axis::AxisKind;
use abbe_model::instrument::Fault;
use abbe_model::unit::{Dimension, Unit};
use abbe_model::words::number;

use super::DhRow;
use super::row::RowRead;
use crate::import::unit;

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
/// Largest length of a table, mm: a kilometre.
const MAX_MM: f64 = 1e6;
/// Largest angle of a table, rad: a hundred turns.
const MAX_RAD: f64 = 100.0 * TAU;

/// What to do with a line of names that cannot be used.
pub(super) const NAMES: &str = "the first line names the columns: joint,a_mm,alpha_deg,d_mm,theta_deg";

/// Which columns a table has, and the units of those that state none.
pub(super) struct Columns {
    places: Vec<(&'static str, usize, Option<Unit>)>,
    /// The unit of angles, of limits of rotary joints, and of lengths, where no name states it.
    angle: Unit,
    limit: Unit,
    length: Unit,
    /// The columns of an exported table that are not of the chain: its uncertainties and its nominal values.
    pub unread: Vec<String>,
}

/// First characters of the columns that an exported table has beside its parameters.
const BESIDE: [&str; 2] = ["u_", "nominal_"];

impl Columns {
    /// The columns of a line of names.
    pub fn of(names: &[String]) -> Result<Columns, Fault> {
        let mut columns = Columns {
            places: Vec::new(),
            angle: Unit::Degree,
            limit: Unit::Degree,
            length: Unit::Millimetre,
            unread: Vec::new(),
        };
        for (place, name) in names.iter().enumerate() {
            if BESIDE.iter().any(|beside| name.starts_with(beside)) {
                columns.unread.push(name.clone());
                continue;
            }
            let named = unit::split(name);
            let plain: String = named.base.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
            let known = COLUMNS.iter().find(|(_, words)| words.contains(&plain.trim_end_matches(char::is_numeric)));
            let Some((own, _)) = known else {
                return Err((format!("column `{name}` is no parameter"), NAMES.into()));
            };
            if let Some(other) = columns.place(own) {
                return Err((
                    format!("columns `{}` and `{name}` are both `{own}`", names[other]),
                    "keep one of them".into(),
                ));
            }
            let expected = match *own {
                "a" | "d" => &[Dimension::Length][..],
                "alpha" | "beta" | "theta" => &[Dimension::Angle],
                "offset" | "lower" | "upper" => &[Dimension::Angle, Dimension::Length],
                _ => &[],
            };
            match named.unit {
                Some(Unit::Grad) => {
                    let help = "write deg for a degree, or gon for a hundredth of a right angle";
                    return Err((format!("column `{name}`: grad may be a degree or a gon"), help.into()));
                }
                Some(unit) if !expected.is_empty() && !expected.contains(&unit.dimension()) => {
                    let expected: Vec<String> = expected.iter().map(ToString::to_string).collect();
                    return Err((
                        format!("the unit of column `{name}` is one of {}", unit.dimension()),
                        format!("state one of {}", expected.join(" or ")),
                    ));
                }
                _ => {}
            }
            columns.places.push((own, place, named.unit.filter(|_| !expected.is_empty())));
        }
        match ["a", "alpha", "d"].into_iter().find(|own| columns.place(own).is_none()) {
            Some(own) => Err((format!("no column `{own}`"), NAMES.into())),
            None => Ok(columns),
        }
    }

    pub fn place(&self, own: &str) -> Option<usize> {
        self.places.iter().find(|(name, ..)| *name == own).map(|(_, place, _)| *place)
    }

    /// The unit that a name states.
    fn stated(&self, own: &str) -> Option<Unit> {
        self.places.iter().find(|(name, ..)| *name == own).and_then(|(.., unit)| *unit)
    }

    /// Decides the units that no name states, and says so: those of other columns, or those that the values allow.
    pub fn decide(&mut self, rows: &[RowRead]) -> Vec<String> {
        let open = |dimension: Dimension, owns: &[&'static str]| -> (Vec<&'static str>, Vec<f64>) {
            let mut names = Vec::new();
            let mut numbers = Vec::new();
            for own in owns.iter().filter(|own| self.stated(own).is_none()) {
                let of_dimension = rows.iter().filter(|row| row.dimension(own) == Some(dimension));
                let filled = of_dimension.map(|row| row.value(own).plain).filter(|number| *number != 0.0);
                let before = numbers.len();
                numbers.extend(filled.map(f64::abs));
                if numbers.len() > before {
                    names.push(*own);
                }
            }
            (names, numbers)
        };
        let stated = |dimension: Dimension, owns: &[&'static str]| {
            owns.iter().filter_map(|own| self.stated(own)).find(|unit| unit.dimension() == dimension)
        };
        const ANGLES: [&str; 4] = ["theta", "alpha", "beta", "offset"];
        let (angles, numbers) = open(Dimension::Angle, &ANGLES);
        // Angles of a table are quarter turns, nearly all of them.
        let is_quarter = |angle: &f64| ((angle / FRAC_PI_2).round() * FRAC_PI_2 - angle).abs() < QUARTER;
        let are_rad = !numbers.is_empty() && numbers.iter().all(|angle| *angle <= TAU && is_quarter(angle));
        let angle = stated(Dimension::Angle, &ANGLES).unwrap_or(if are_rad { Unit::Radian } else { Unit::Degree });
        let (limits, numbers) = open(Dimension::Angle, &["lower", "upper"]);
        let limit = if numbers.iter().all(|angle| *angle <= TAU) { Unit::Radian } else { Unit::Degree };
        let (lengths, numbers) = open(Dimension::Length, &["d", "a", "offset", "lower", "upper"]);
        let largest = numbers.iter().copied().fold(0.0, f64::max);
        let length = stated(Dimension::Length, &["d", "a"]).unwrap_or(if largest < LARGEST_M {
            Unit::Metre
        } else {
            Unit::Millimetre
        });
        let said =
            [("angles", angles, angle), ("limits of rotary joints", limits, limit), ("lengths", lengths, length)];
        (self.angle, self.limit, self.length) = (angle, limit, length);
        said.into_iter()
            .filter(|(_, columns, _)| !columns.is_empty())
            .map(|(what, _, unit)| format!("the unit of the {what} is not stated: {}", unit.key()))
            .collect()
    }

    /// A value in mm or rad.
    fn internal(&self, row: &RowRead, own: &str) -> Result<f64, Fault> {
        let (value, Some(dimension)) = (row.value(own), row.dimension(own)) else { return Ok(0.0) };
        let open = match (dimension, own) {
            (Dimension::Length, _) => self.length,
            (_, "lower" | "upper") => self.limit,
            _ => self.angle,
        };
        let unit = self.stated(own).unwrap_or(open);
        let wrong = value.of_pi != 0.0 && dimension == Dimension::Length
            || unit.dimension() != dimension && (value.plain != 0.0 || value.of_pi != 0.0);
        if wrong {
            return Err((
                format!("`{own}` of joint `{}` is no {dimension}, and the joint is {}", row.name, row.type_in_words()),
                format!("state a {dimension}, in a column with its unit"),
            ));
        }
        let found = if unit.dimension() == dimension { unit.to_internal(value.plain) + value.of_pi } else { 0.0 };
        let largest = if dimension == Dimension::Length { MAX_MM } else { MAX_RAD };
        if found.abs() > largest {
            return Err((
                format!("`{own}` of joint `{}` is {} {}", row.name, number(value.plain), unit.key()),
                "check its unit: no robot is that large".into(),
            ));
        }
        Ok(found)
    }

    /// A row in mm and rad. What of its limits is not used is added to `assumed`.
    pub fn row(&self, row: &RowRead, assumed: &mut Vec<String>) -> Result<DhRow, Fault> {
        let of = |own: &str| self.internal(row, own);
        let (mut theta, mut d) = (of("theta")?, of("d")?);
        match row.kind {
            Some(AxisKind::Linear) => d += of("offset")?,
            _ => theta += of("offset")?,
        }
        let travel = match (row.is_filled("lower"), row.is_filled("upper"), [of("lower")?, of("upper")?]) {
            _ if row.kind.is_none() => None,
            (true, true, [lower, upper]) if lower < upper => Some([lower, upper]),
            (true, true, [lower, upper]) if lower > upper => {
                let message = format!("the lower limit of joint `{}` is above the upper one", row.name);
                return Err((message, "exchange them, or correct the unit".into()));
            }
            (false, false, _) => None,
            (lower, upper, _) => {
                let what = if lower && upper { "equal limits" } else { "one limit only" };
                assumed.push(format!("joint `{}` states {what}: its travel is open", row.name));
                None
            }
        };
        Ok(DhRow {
            name: row.name.clone(),
            kind: row.kind,
            a: of("a")?,
            alpha: of("alpha")?,
            beta: of("beta")?,
            theta,
            d,
            travel,
        })
    }
}
