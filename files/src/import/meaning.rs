//! What each column of a foreign table holds, by its name, its unit and its values.

use abbe_model::axis::AxisKind;
use abbe_model::calendar::{DateOrder, clock};
use abbe_model::driver::column as driver;
use abbe_model::instrument::column::{Column, Quantity};
use abbe_model::instrument::{Fault, InstrumentKind};
use abbe_model::unit::{Dimension, Unit};
use schemars::JsonSchema;
use serde::Serialize;

use super::Expected;
use super::grid::{Grid, number_with_unit};
use super::unit;
use super::words::{self, AxisWord, Direction};
use crate::spelling::most_similar;
use crate::table::columns::listed;

/// A column of a foreign file.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "ImportedColumn")]
pub struct ColumnFound {
    /// Its number, from 1.
    pub number: usize,
    /// Its name in the file; empty if it has none.
    pub name: String,
    /// What it holds, with the unit, such as `c_deg`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own: Option<String>,
    /// Whether the file states the unit.
    pub unit_is_stated: bool,
    /// `forward` or `backward`, if columns hold one direction each.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<&'static str>,
}

/// Our column of a tracker's vertical angle.
const ELEVATION: &str = "elevation";

/// What a column holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Meaning {
    Axis(usize),
    /// Our column of readings without its unit, and whether it is an angle. A component of a quaternion has no unit.
    Reading(&'static str, bool),
    Socket,
    Time,
    /// Time of day.
    Clock,
    Run,
    Temperature,
    Polar,
    /// A driver column by our name, which the user states.
    Driver(String),
}

/// A column that is used.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// Its index.
    pub column: usize,
    pub meaning: Meaning,
    /// The unit that the file or the user states.
    pub unit: Option<Unit>,
    /// Whether the cells alone state the unit, so that each of them has one.
    pub has_unit_in_cells: bool,
    /// Whether it is an angle from the zenith, which is read as an elevation.
    pub is_from_zenith: bool,
    /// Whether the user says what it holds.
    pub is_hinted: bool,
    pub direction: Option<Direction>,
}

impl Found {
    /// Whether it holds readings.
    pub fn is_reading(&self) -> bool {
        matches!(self.meaning, Meaning::Reading(..) | Meaning::Socket)
    }
}

/// The columns that are used, each meaning once in each direction. `found` are those of which the user says what they hold:
/// that stands, whatever the file calls them.
pub(super) fn of(grid: &Grid, expected: &Expected<'_>, mut found: Vec<Found>) -> Result<Vec<Found>, Fault> {
    let hinted: Vec<usize> = found.iter().map(|one| one.column).collect();
    let joints_from = first_joint(grid, expected);
    for column in (0..grid.width()).filter(|column| !hinted.contains(column)) {
        if let Some(one) = by_name(grid, column, expected, joints_from) {
            found.push(one);
        }
    }
    // The measured coordinates of a machine with the same letters.
    measured_coordinates(grid, &mut found, expected);
    only_pairs(&mut found);
    let mut kept: Vec<Found> = Vec::new();
    // An actual position stands for a commanded one.
    found.sort_by_key(|one| (!one.is_hinted, is_command(grid, one.column), one.column));
    for one in found {
        if !kept.iter().any(|other| other.meaning == one.meaning && other.direction == one.direction) {
            kept.push(one);
        }
    }
    kept.sort_by_key(|one| one.column);
    missing(grid, &kept, expected)?;
    Ok(kept)
}

/// The names of a column: the last line, then all lines together.
pub(super) fn names_of(grid: &Grid, column: usize) -> Vec<String> {
    let lines = &grid.names[column];
    let mut names: Vec<String> = lines.last().cloned().into_iter().collect();
    if lines.len() > 1 {
        names.push(lines.join(" "));
        names.push(lines[0].clone());
    }
    names
}

/// The number of the first joint, 0 or 1.
fn first_joint(grid: &Grid, expected: &Expected<'_>) -> usize {
    let is_zero = |column: usize| {
        let names = names_of(grid, column);
        names.iter().any(|name| axis_word(name, expected) == Some(AxisWord::Number(0)))
    };
    usize::from(!(0..grid.width()).any(is_zero))
}

fn axis_word(name: &str, expected: &Expected<'_>) -> Option<AxisWord> {
    let whole = words::axis(&words::direction(name, &words::words(name)).1, expected.machine);
    let base = unit::split(name).base;
    whole.or_else(|| words::axis(&words::direction(base, &words::words(base)).1, expected.machine))
}

/// What the name of a column says.
fn by_name(grid: &Grid, column: usize, expected: &Expected<'_>, joints_from: usize) -> Option<Found> {
    let of_line = grid.units.get(column).and_then(|unit| Unit::of_word(unit));
    let of_cells = unit_of_cells(grid, column);
    let of = |text: &str, unit: Option<Unit>| {
        let of_name = of_line.or(unit);
        let unit = of_name.or(of_cells);
        let all = words::words(text);
        let (direction, plain) = words::direction(text, &all);
        [(&plain, direction), (&all, None)].into_iter().find_map(|(words, direction)| {
            let meaning = meaning(words, unit, grid, column, expected, joints_from)?;
            let is_from_zenith = meaning == Meaning::Reading(ELEVATION, true) && words::is_one_of(words, words::ZENITH);
            let has_unit_in_cells = of_name.is_none() && of_cells.is_some();
            Some(Found { column, meaning, unit, has_unit_in_cells, is_from_zenith, is_hinted: false, direction })
        })
    };
    names_of(grid, column).iter().find_map(|name| {
        let named = unit::split(name);
        let of_base = of(named.base, named.unit);
        if !named.weak {
            return of_base;
        }
        // A last letter is a part of the name, unless the name says the same without it: `C` of `pos C`, `K` of `temp K`.
        match (of(name, None), of_base) {
            (Some(whole), Some(base)) if whole.meaning == base.meaning => Some(base),
            (whole, base) => whole.or(base),
        }
    })
}

/// The unit behind the numbers of a column: that of the first cell with one.
pub(super) fn unit_of_cells(grid: &Grid, column: usize) -> Option<Unit> {
    let cells = grid.rows.iter().filter_map(|row| row.cells.get(column));
    let ends_with_letter = |cell: &&String| cell.chars().next_back().is_some_and(|last| !last.is_ascii_digit());
    cells.filter(ends_with_letter).find_map(|cell| {
        let (_, found) = number_with_unit(cell, grid.decimal)?;
        (!found.is_empty()).then(|| Unit::of_word(found)).flatten()
    })
}

/// Whether the cells of a column are numbers or times of day; `None` if they are neither.
pub(super) fn time(grid: &Grid, column: usize) -> Option<Meaning> {
    let cell = grid.rows.iter().map(|row| row.cells[column].as_str()).find(|cell| !cell.is_empty())?;
    if number_with_unit(cell, grid.decimal).is_some() {
        return Some(Meaning::Time);
    }
    let is_clock = [DateOrder::DayFirst, DateOrder::MonthFirst]
        .into_iter()
        .any(|order| clock(cell, order).is_some_and(|moment| moment.second.is_some()));
    is_clock.then_some(Meaning::Clock)
}

/// Our column of readings.
pub(super) fn reading(column: &Column) -> Meaning {
    match column.quantity {
        Quantity::Socket => Meaning::Socket,
        _ => Meaning::Reading(column.stem, column.is_angle()),
    }
}

fn meaning(
    words: &[String],
    unit: Option<Unit>,
    grid: &Grid,
    column: usize,
    expected: &Expected<'_>,
    joints_from: usize,
) -> Option<Meaning> {
    let machine = expected.machine;
    if words.is_empty() {
        return None;
    }
    let is_length = unit.is_none_or(Unit::is_length);
    let is_angle = unit.is_none_or(Unit::is_angle);
    let fits = |axis: usize| match machine.axes[axis].kind {
        AxisKind::Linear => is_length,
        AxisKind::Rotary => is_angle,
    };
    if let Some(axis) = words::axis(words, machine)
        && !words::is_measured(words)
    {
        let axis = match axis {
            AxisWord::Axis(axis) => Some(axis),
            AxisWord::Number(number) => joint(machine, number, joints_from),
            AxisWord::Unnamed if expected.circle.is_some() && is_angle => return Some(Meaning::Polar),
            AxisWord::Unnamed => expected.moved,
        };
        if let Some(axis) = axis.filter(|axis| fits(*axis)) {
            return Some(Meaning::Axis(axis));
        }
    }
    let is_of = |dimension: Dimension| unit.is_some_and(|unit| unit.dimension() == dimension);
    if words::is_one_of(words, words::TIME) && unit.is_none() || is_of(Dimension::Time) {
        return time(grid, column);
    }
    if words::is_one_of(words, words::TEMPERATURE) && unit.is_none() || is_of(Dimension::Temperature) {
        return Some(Meaning::Temperature);
    }
    if words::is_one_of(words, words::RUN) && (unit.is_none() || is_of(Dimension::Number)) {
        return Some(Meaning::Run);
    }
    for column in expected.station.columns() {
        let fits = match (column.unit == Unit::One, column.is_angle()) {
            (true, _) => unit.is_none() || is_of(Dimension::Number),
            (false, true) => is_angle,
            (false, false) => is_length,
        };
        if fits && words::is_reading(words, column.stem) {
            return Some(reading(column));
        }
    }
    if expected.kind() == InstrumentKind::Tracker && is_angle && words::is_one_of(words, words::ZENITH) {
        return Some(Meaning::Reading(ELEVATION, true));
    }
    let polar = expected.circle.is_some() && is_angle && words::is_one_of(words, words::POLAR);
    polar.then_some(Meaning::Polar)
}

/// The axis of a numbered joint: the one whose name has the number, or the one at its place in the chain.
fn joint(machine: &abbe_model::chain::Machine, number: usize, from: usize) -> Option<usize> {
    let ends = |name: &str| name.trim_start_matches(|c: char| !c.is_ascii_digit()).parse() == Ok(number);
    if from == 1
        && let Some(axis) = (0..machine.axes.len()).find(|k| ends(&machine.axes[*k].name))
    {
        return Some(axis);
    }
    number.checked_sub(from).filter(|place| *place < machine.axes.len())
}

/// A tracker on a machine with axes X, Y, Z: of two columns of one letter, the measured one is the reading.
fn measured_coordinates(grid: &Grid, found: &mut [Found], expected: &Expected<'_>) {
    let own = expected.station.columns();
    for (letter, stem) in [("x", "px"), ("y", "py"), ("z", "pz"), ("x", "dx"), ("y", "dy"), ("z", "dz")] {
        let Some(own) = own.iter().find(|column| column.stem == stem) else { continue };
        if found.iter().any(|one| one.meaning == Meaning::Reading(stem, own.is_angle())) {
            continue;
        }
        let Some(axis) = expected.machine.axes.iter().position(|axis| axis.name.to_lowercase() == letter) else {
            continue;
        };
        let twice: Vec<usize> = (0..found.len()).filter(|k| found[*k].meaning == Meaning::Axis(axis)).collect();
        if let [first, second] = twice[..] {
            let is_position = |place: usize| found[place].is_hinted || is_command(grid, found[place].column);
            let measured = if is_position(second) { first } else { second };
            found[measured].meaning = Meaning::Reading(own.stem, own.is_angle());
        }
    }
}

/// Whether a name says that a position was commanded.
fn is_command(grid: &Grid, column: usize) -> bool {
    const COMMAND: [&str; 11] =
        ["cmd", "command", "commanded", "soll", "sollwert", "set", "setpoint", "nominal", "nom", "programmed", "prog"];
    let names = grid.names[column].join(" ");
    words::words(&names).iter().any(|word| COMMAND.contains(&word.as_str()))
}

/// A direction counts if columns of one meaning have both.
fn only_pairs(found: &mut [Found]) {
    let has = |found: &[Found], direction: Direction| {
        found.iter().any(|one| matches!(one.meaning, Meaning::Reading(..)) && one.direction == Some(direction))
    };
    if !(has(found, Direction::Forward) && has(found, Direction::Backward)) {
        found.iter_mut().for_each(|one| one.direction = None);
    }
}

/// Refuses a table without the readings of the instrument or without an axis.
fn missing(grid: &Grid, found: &[Found], expected: &Expected<'_>) -> Result<(), Fault> {
    let names: Vec<String> = (0..grid.width()).map(|column| grid.name(column)).collect();
    let has_names = grid.names.iter().any(|names| !names.is_empty());
    let hint = |own: &str, words: &[&str], number: usize| {
        let file =
            if has_names { format!("its columns are {}", listed(&names)) } else { "it has no names of columns".into() };
        let near = misspelt(grid, found, words);
        let theirs = near.map_or_else(|| number.to_string(), |column| names[column].clone());
        let near = near.map_or(String::new(), |column| format!("did you mean column `{}`? ", names[column]));
        format!(
            "{near}{file}; say what a column holds, such as {own}={theirs} (our name, then the name or the number in the file)"
        )
    };
    let has = |meaning: &dyn Fn(&Meaning) -> bool| found.iter().any(|one| meaning(&one.meaning));
    if !has(&|meaning| matches!(meaning, Meaning::Axis(_) | Meaning::Polar)) {
        let axes: Vec<&str> = expected.machine.axes.iter().map(|axis| axis.name.as_str()).collect();
        let what = format!("no column holds the position of an axis ({})", axes.join(", "));
        return Err((
            what,
            hint(&expected.machine.axes.first().map_or(String::new(), |axis| axis.column("")), &axes, 1),
        ));
    }
    let own = expected.station.columns();
    let lacks = expected.station.missing(&|quantity| {
        let of_column = |stem: &str| own.iter().any(|column| column.stem == stem && column.quantity == quantity);
        has(&|meaning| match meaning {
            Meaning::Reading(stem, _) => of_column(stem),
            Meaning::Socket => quantity == Quantity::Socket,
            _ => false,
        })
    });
    match lacks {
        Some((what, help)) if expected.kind() != InstrumentKind::Socket => {
            let lacking = own.iter().find(|column| !has(&|meaning| *meaning == reading(column)));
            let example = lacking.map_or(String::new(), |column| column.name(column.unit));
            let words: Vec<&str> = own.iter().flat_map(|column| words::of_reading(column.stem)).collect();
            Err((format!("no column {what}: {help}"), hint(&example, &words, 2)))
        }
        _ => Ok(()),
    }
}

/// The column that is not used whose name is most like one of these words, if one is like it.
fn misspelt(grid: &Grid, found: &[Found], known: &[&str]) -> Option<usize> {
    let long: Vec<&str> = known.iter().copied().filter(|word| word.chars().count() > 2).collect();
    let is_near = |column: &usize| {
        names_of(grid, *column).iter().any(|name| most_similar(unit::split(name).base, &long).is_some())
    };
    (0..grid.width()).filter(|column| !found.iter().any(|one| one.column == *column)).find(is_near)
}

impl Meaning {
    /// Our name without the unit.
    pub fn stem(&self) -> &str {
        match self {
            Meaning::Axis(_) => "",
            Meaning::Reading(stem, _) => stem,
            Meaning::Socket => "socket",
            Meaning::Time | Meaning::Clock => "time",
            Meaning::Run => "run",
            Meaning::Temperature => driver::TEMPERATURE,
            Meaning::Polar => "polar",
            Meaning::Driver(own) => own,
        }
    }
}
