//! What each column of a foreign table holds, by its name, its unit and its values.

use super::Expected;
use super::clock::clock_s;
use super::grid::{Grid, number_with_unit};
use super::hint::Hint;
use super::unit::{self, Unit};
use super::words::{self, AxisWord, Direction};
use crate::axis::AxisKind;
use crate::document::layout::ForeignColumn;
use crate::driver::column as driver;
use crate::files::table::columns::listed;
use crate::instrument::{Fault, InstrumentKind};

/// A column as it is understood.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnFound {
    /// Its number, from 1.
    pub number: usize,
    /// Its name in the file; empty if it has none.
    pub name: String,
    /// What it holds, with the unit: our column, or `polar_deg`. `None` for a column that is not used.
    pub own: Option<String>,
    /// Whether the file states the unit.
    pub unit_is_stated: bool,
    /// Forward or backward, if columns hold one direction each.
    pub direction: Option<&'static str>,
}

/// Our column of a tracker's vertical angle.
const ELEVATION: &str = "elevation";

/// What a column holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Meaning {
    Axis(usize),
    /// Our column of readings without its unit, and whether it is an angle.
    Reading(&'static str, bool),
    Socket,
    Time,
    /// Time of day.
    Clock,
    Run,
    Temperature,
    Polar,
    /// What the user says, with its unit.
    Hinted(String),
}

/// A column that is used.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// Its index.
    pub column: usize,
    pub meaning: Meaning,
    /// The unit that the file states.
    pub unit: Option<Unit>,
    pub direction: Option<Direction>,
}

impl Found {
    /// Whether it holds readings of an instrument as set up.
    pub fn is_of(&self, station: &crate::instrument::Station<f64>) -> bool {
        let is_own = |stem: &str| station.columns().iter().any(|column| column.stem == stem);
        match &self.meaning {
            Meaning::Reading(..) | Meaning::Socket => true,
            Meaning::Hinted(own) => is_own(own) || own.rsplit_once('_').is_some_and(|(stem, _)| is_own(stem)),
            _ => false,
        }
    }
}

/// The columns that are used, each meaning once in each direction.
pub(super) fn of(grid: &Grid, expected: &Expected<'_>) -> Result<Vec<Found>, Fault> {
    let mut found: Vec<Found> = Vec::new();
    for hint in expected.hints {
        found.push(hinted(grid, hint)?);
    }
    let joints_from = first_joint(grid, expected);
    for column in (0..grid.width()).filter(|column| !expected.hints.iter().any(|hint| is_of(grid, hint, *column))) {
        if let Some(one) = by_name(grid, column, expected, joints_from) {
            found.push(one);
        }
    }
    // The measured coordinates of a machine with the same letters.
    measured_coordinates(grid, &mut found, expected);
    only_pairs(&mut found);
    let mut kept: Vec<Found> = Vec::new();
    // An actual position stands for a commanded one.
    found.sort_by_key(|one| (is_command(grid, one.column), one.column));
    for one in found {
        if !kept.iter().any(|other| other.meaning == one.meaning && other.direction == one.direction) {
            kept.push(one);
        }
    }
    kept.sort_by_key(|one| one.column);
    missing(grid, &kept, expected)?;
    Ok(kept)
}

/// Whether a hint is of a column.
fn is_of(grid: &Grid, hint: &Hint, column: usize) -> bool {
    match &hint.foreign {
        ForeignColumn::Number(number) => number.0 == column + 1,
        ForeignColumn::Name(name) => names_of(grid, column).iter().any(|own| own == name),
        // A hint names one column.
        ForeignColumn::Traversals(_) => false,
    }
}

/// The names of a column: the last line, then all lines together.
fn names_of(grid: &Grid, column: usize) -> Vec<String> {
    let lines = &grid.names[column];
    let mut names: Vec<String> = lines.last().cloned().into_iter().collect();
    if lines.len() > 1 {
        names.push(lines.join(" "));
        names.push(lines[0].clone());
    }
    names
}

fn hinted(grid: &Grid, hint: &Hint) -> Result<Found, Fault> {
    let columns: Vec<usize> = (0..grid.width()).filter(|column| is_of(grid, hint, *column)).collect();
    let known: Vec<String> = (0..grid.width()).map(|column| grid.name(column)).collect();
    let named = match &hint.foreign {
        ForeignColumn::Number(number) => format!("column {}", number.0),
        ForeignColumn::Name(name) => format!("column `{name}`"),
        ForeignColumn::Traversals(_) => "several columns".to_string(),
    };
    match columns[..] {
        [column] => Ok(Found { column, meaning: Meaning::Hinted(hint.own.clone()), unit: None, direction: None }),
        [] => Err((
            format!("`{}` is {named}, which the file does not have", hint.own),
            format!("it has {}", listed(&known)),
        )),
        _ => Err((
            format!("`{}` is {named}, and {} columns have this name", hint.own, columns.len()),
            "use the number of one of them, counted from 1".into(),
        )),
    }
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
    let stated = unit_of(grid, column);
    for name in names_of(grid, column) {
        let named = unit::split(&name);
        // A last letter may be the unit of a name, or a part of it.
        let bases = if named.weak { [name.as_str(), named.base] } else { [named.base, named.base] };
        for base in bases {
            let unit = stated.or(named.unit.filter(|_| base == named.base));
            let all = words::words(base);
            let (direction, plain) = words::direction(base, &all);
            for (words, direction) in [(&plain, direction), (&all, None)] {
                if let Some(meaning) = meaning(words, unit, grid, column, expected, joints_from) {
                    let is_zenith =
                        meaning == Meaning::Reading(ELEVATION, true) && words::is_one_of(words, &words::ZENITH);
                    let unit = if is_zenith { Some(unit.unwrap_or(Unit::of_own("deg")).above_horizon()) } else { unit };
                    return Some(Found { column, meaning, unit, direction });
                }
            }
        }
    }
    None
}

/// The unit that the file states of a column: on a line of units, or behind the numbers of the first row.
fn unit_of(grid: &Grid, column: usize) -> Option<Unit> {
    let of_line = grid.units.get(column).and_then(|unit| unit::of(unit));
    let of_cell = || {
        let (_, found) = number_with_unit(grid.rows.first()?.cells.get(column)?, grid.decimal)?;
        (!found.is_empty()).then(|| unit::of(found)).flatten()
    };
    of_line.or_else(of_cell)
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
    let own = expected.station.columns();
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
    let is_time = unit.is_some_and(|unit| unit.own == "s");
    if words::is_one_of(words, &words::TIME) && unit.is_none_or(|unit| unit.own == "s") || is_time {
        let is_clock = grid.rows.first().is_some_and(|row| clock_s(&row.cells[column]).is_some());
        let is_number =
            grid.rows.first().is_some_and(|row| number_with_unit(&row.cells[column], grid.decimal).is_some());
        return match (is_number, is_clock) {
            (true, _) => Some(Meaning::Time),
            (false, true) => Some(Meaning::Clock),
            _ => None,
        };
    }
    if words::is_one_of(words, &words::TEMPERATURE) || unit.is_some_and(|unit| unit.own == "c") {
        return Some(Meaning::Temperature);
    }
    if words::is_one_of(words, &words::RUN) && unit.is_none_or(|unit| unit.own == "1") {
        return Some(Meaning::Run);
    }
    for column in own {
        let fits = if column.is_angle() { is_angle } else { is_length };
        match column.unit.is_empty() {
            true if words::is_reading(words, column.stem) => return Some(Meaning::Socket),
            false if fits && words::is_reading(words, column.stem) => {
                return Some(Meaning::Reading(column.stem, column.is_angle()));
            }
            _ => {}
        }
    }
    if expected.kind() == InstrumentKind::Tracker && is_angle && words::is_one_of(words, &words::ZENITH) {
        return Some(Meaning::Reading(ELEVATION, true));
    }
    let polar = expected.circle.is_some() && is_angle && words::is_one_of(words, &words::POLAR);
    polar.then_some(Meaning::Polar)
}

/// The axis of a numbered joint: the one whose name has the number, or the one at its place in the chain.
fn joint(machine: &crate::chain::Machine, number: usize, from: usize) -> Option<usize> {
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
            let measured = if is_command(grid, found[second].column) { first } else { second };
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
    let hint = |example: &str| {
        let file =
            if has_names { format!("its columns are {}", listed(&names)) } else { "it has no names of columns".into() };
        format!(
            "{file}; say what a column holds, such as {example} (our name, then the name or the number in the file)"
        )
    };
    let has = |meaning: &dyn Fn(&Meaning) -> bool| found.iter().any(|one| meaning(&one.meaning));
    let is_hinted =
        |meaning: &Meaning, what: &dyn Fn(&str) -> bool| matches!(meaning, Meaning::Hinted(own) if what(own));
    let is_axis = |own: &str| crate::files::quantity::axis_position(expected.machine, own).is_some();
    if !has(&|meaning| {
        matches!(meaning, Meaning::Axis(_) | Meaning::Polar)
            || is_hinted(meaning, &|own| is_axis(own) || own.starts_with("polar_"))
    }) {
        let axes: Vec<&str> = expected.machine.axes.iter().map(|axis| axis.name.as_str()).collect();
        let what = format!("no column holds the position of an axis ({})", axes.join(", "));
        return Err((
            what,
            hint(&format!("{}=1", expected.machine.axes.first().map_or(String::new(), |axis| axis.column("")))),
        ));
    }
    let own = expected.station.columns();
    let lacks = expected.station.missing(&|quantity| {
        let of_column = |stem: &str| own.iter().any(|column| column.stem == stem && column.quantity == quantity);
        has(&|meaning| match meaning {
            Meaning::Reading(stem, _) => of_column(stem),
            Meaning::Socket => of_column("socket"),
            Meaning::Hinted(own) => of_column(own.rsplit_once('_').map_or(own.as_str(), |(stem, _)| stem)),
            _ => false,
        })
    });
    match lacks {
        Some((what, help)) if expected.kind() != InstrumentKind::Socket => {
            let example = own.first().map_or(String::new(), |column| format!("{}=2", column.name(column.unit)));
            Err((format!("no column {what}: {help}"), hint(&example)))
        }
        _ => Ok(()),
    }
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
            Meaning::Hinted(own) => own,
        }
    }
}
