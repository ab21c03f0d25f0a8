//! What the user says of columns. It stands, whatever the file calls them.

use abbe_model::axis::AxisKind;
use abbe_model::document::layout::ForeignColumn;
use abbe_model::document::value::Count;
use abbe_model::driver::column as driver;
use abbe_model::instrument::Fault;
use abbe_model::unit::{Dimension, Unit};

use super::Expected;
use super::grid::Grid;
use super::meaning::{Found, Meaning, names_of, reading, time, unit_of_cells};
use super::words;
use crate::axes;
use crate::spelling::suggestion;
use crate::table::columns::listed;

/// What the user says of a column: our name, which includes the unit, and the name or the number in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Hint {
    /// Our name, such as `c_deg`.
    pub own: String,
    /// The name or the number in the file.
    pub foreign: ForeignColumn,
}

impl Hint {
    /// `OWN=THEIRS`, such as `c_deg=3` or `length_mm=Messwert`.
    ///
    /// # Errors
    /// If it is not of this form.
    pub fn parse(text: &str) -> Result<Hint, Fault> {
        let parts = text.split_once('=').map(|(own, theirs)| (own.trim(), theirs.trim()));
        let Some((own, theirs)) = parts.filter(|(own, theirs)| !own.is_empty() && !theirs.is_empty()) else {
            let help =
                "write OWN=THEIRS: our name with its unit, and the name or the number in the file, such as c_deg=3";
            return Err((format!("`{text}` names no column"), help.into()));
        };
        let number = theirs.parse::<usize>().ok().filter(|number| (1..=MAX_COLUMNS).contains(number));
        let foreign = number
            .map_or_else(|| ForeignColumn::Name(theirs.to_string()), |number| ForeignColumn::Number(Count(number)));
        Ok(Hint { own: own.to_string(), foreign })
    }
}

/// Largest number of a column.
const MAX_COLUMNS: usize = 1_000_000;

/// The columns of which the user says what they hold.
///
/// # Errors
/// If there is no such column or no such name of ours, or two hints contradict each other.
pub(super) fn found(grid: &Grid, expected: &Expected<'_>) -> Result<Vec<Found>, Fault> {
    let mut found: Vec<Found> = Vec::new();
    for hint in expected.hints {
        let column = column_of(grid, hint)?;
        let (meaning, unit) = meaning(&hint.own, grid, column, expected)?;
        let direction = names_of(grid, column).iter().find_map(|name| words::direction(name, &words::words(name)).0);
        if let Some(other) = found.iter().position(|other| other.column == column) {
            return Err((
                format!("column {} is said to be `{}` and `{}`", column + 1, expected.hints[other].own, hint.own),
                "a column has one meaning: remove one of the two".into(),
            ));
        }
        let is_same = |other: &Found| other.meaning == meaning && other.direction == direction;
        if let Some(other) = found.iter().find(|other| is_same(other)) {
            return Err((
                format!("`{}` is said to be column {} and column {}", hint.own, other.column + 1, column + 1),
                "remove one of the two".into(),
            ));
        }
        let of_cells = unit_of_cells(grid, column).filter(|_| unit.is_none());
        let (unit, has_unit_in_cells) = (unit.or(of_cells), of_cells.is_some());
        found.push(Found {
            column,
            meaning,
            unit,
            has_unit_in_cells,
            is_from_zenith: false,
            is_hinted: true,
            direction,
        });
    }
    Ok(found)
}

/// The column of a hint.
fn column_of(grid: &Grid, hint: &Hint) -> Result<usize, Fault> {
    let is_of = |column: usize| match &hint.foreign {
        ForeignColumn::Number(number) => number.0 == column + 1,
        ForeignColumn::Name(name) => names_of(grid, column).iter().any(|own| own == name),
        // A hint names one column.
        ForeignColumn::Traversals(_) => false,
    };
    let columns: Vec<usize> = (0..grid.width()).filter(|column| is_of(*column)).collect();
    let known: Vec<String> = (0..grid.width()).map(|column| grid.name(column)).collect();
    let (named, near) = match &hint.foreign {
        ForeignColumn::Number(number) => (format!("column {}", number.0), String::new()),
        ForeignColumn::Name(name) => (format!("column `{name}`"), suggestion(name, &known)),
        ForeignColumn::Traversals(_) => ("several columns".to_string(), String::new()),
    };
    match columns[..] {
        [column] => Ok(column),
        [] => Err((
            format!("`{}` is said to be {named}, which the file does not have", hint.own),
            format!("{near}it has {}", listed(&known)),
        )),
        _ => Err((
            format!("`{}` is said to be {named}, and {} columns have this name", hint.own, columns.len()),
            "use the number of one of them, counted from 1".into(),
        )),
    }
}

/// What our name of a column says, with its unit.
fn meaning(own: &str, grid: &Grid, column: usize, expected: &Expected<'_>) -> Result<(Meaning, Option<Unit>), Fault> {
    let plain = own.to_lowercase();
    let columns = expected.station.columns();
    if plain == "run" {
        return Ok((Meaning::Run, None));
    }
    if own.starts_with(driver::PREFIX) {
        return match driver::of_files(own) {
            Some(_) => Ok((Meaning::Driver(own.to_string()), None)),
            None => Err((format!("`{own}` is no driver column"), driver::help_on_name())),
        };
    }
    if let Some(column) = columns.iter().find(|column| column.unit == Unit::One && column.stem == plain) {
        return Ok((reading(column), None));
    }
    let found = plain.rsplit_once('_').and_then(|(stem, word)| {
        let unit = Unit::of_word(word)?;
        let axis = axes::axis_index(expected.machine, stem);
        let of_axis = axis.map(|axis| match expected.machine.axes[axis].kind {
            AxisKind::Linear => (Meaning::Axis(axis), Dimension::Length),
            AxisKind::Rotary => (Meaning::Axis(axis), Dimension::Angle),
        });
        let of_reading = || {
            let column = columns.iter().find(|column| column.unit != Unit::One && column.stem == stem)?;
            Some((reading(column), if column.is_angle() { Dimension::Angle } else { Dimension::Length }))
        };
        let other = || match stem {
            "time" => Some((time(grid, column).unwrap_or(Meaning::Time), Dimension::Time)),
            "temperature" => Some((Meaning::Temperature, Dimension::Temperature)),
            "polar" => Some((Meaning::Polar, Dimension::Angle)),
            _ => None,
        };
        let (meaning, dimension) = of_axis.or_else(of_reading).or_else(other)?;
        Some((meaning, dimension, unit))
    });
    match found {
        Some((Meaning::Polar, ..)) if expected.circle.is_none() => Err((
            format!("`{own}` is a polar angle, and the path of the test is no circle of two linear axes"),
            "state the positions of the axes, or the path of the test".into(),
        )),
        Some((meaning, dimension, unit)) if unit.dimension() == dimension => Ok((meaning, Some(unit))),
        Some((_, dimension, unit)) => Err((
            format!("the unit of `{own}` is one of {}, and the column holds a {dimension}", unit.dimension()),
            format!("end our name with one of {dimension}"),
        )),
        None => {
            let known = known(expected);
            Err((
                format!("`{own}` is no column of a test with this instrument"),
                format!("{}known: {}; with the unit that the file has", suggestion(own, &known), listed(&known)),
            ))
        }
    }
}

/// Our names of columns.
fn known(expected: &Expected<'_>) -> Vec<String> {
    let axes = expected.machine.axes.iter().map(|axis| axis.column(""));
    let readings = expected.station.columns().iter().map(|column| column.name(column.unit));
    let others = ["time_s", "run", driver::TEMPERATURE].map(str::to_string);
    let polar = expected.circle.is_some().then(|| "polar_deg".to_string());
    axes.chain(readings).chain(others).chain(polar).chain([format!("{}NAME_unit", driver::PREFIX)]).collect()
}
