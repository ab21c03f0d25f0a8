//! How a session reads a foreign table: as it is, or as a table with our columns where it cannot state the layout.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use abbe_model::document::layout::{Columns, ForeignColumn, Format};
use abbe_model::document::node::Named;
use abbe_model::document::value::Count;
use abbe_model::driver::column as driver;
use abbe_model::instrument::Fault;
use abbe_model::unit::Unit;

use super::grid::{Grid, number};
use super::meaning::{ColumnFound, Found, Meaning};
use super::open_units::{self, Choice, open};
use super::values::Values;
use super::words::Direction;
use super::{Expected, Reading, Table};
use crate::axes;

/// The ways to read a table, the most probable first. `name` is that of the file, for the head of a copy.
///
/// # Errors
/// If numbers are missing or contradict their column, or a unit cannot be told.
pub(super) fn readings(
    name: &str,
    grid: &Grid,
    found: &[Found],
    expected: &Expected<'_>,
) -> Result<Vec<Reading>, Fault> {
    let table = Table { grid, found, expected, values: Values::of(grid, found, expected)? };
    let mut choices: Vec<Vec<Choice>> = vec![Vec::new()];
    for options in open(&table)? {
        let before = std::mem::take(&mut choices);
        for option in options {
            choices.extend(before.iter().map(|chosen| chosen.iter().chain([&option]).cloned().collect::<Vec<_>>()));
        }
    }
    Ok(choices.iter().map(|chosen| reading(name, &table, chosen)).collect())
}

/// The table in one way.
fn reading(name: &str, table: &Table<'_>, chosen: &[Choice]) -> Reading {
    let Table { grid, found, expected, values } = table;
    let assumes: Vec<String> = chosen.iter().map(|choice| choice.text.clone()).collect();
    let scale_mm = chosen.iter().map(|choice| choice.scale_mm).product();
    let chosen: BTreeMap<usize, Unit> = chosen.iter().flat_map(|choice| choice.units.clone()).collect();
    let unit = |one: &Found| {
        let stated = one.unit.filter(|unit| *unit != Unit::Grad && !matches!(one.meaning, Meaning::Driver(_)));
        stated.or(chosen.get(&one.column).copied()).unwrap_or(Unit::One)
    };
    let columns: Vec<ColumnFound> = (0..grid.width())
        .map(|column| {
            let one = found.iter().find(|one| one.column == column);
            ColumnFound {
                number: column + 1,
                name: grid.names[column].join(" "),
                own: one.map(|one| own_name(one, unit(one), expected)),
                unit_is_stated: one.is_some_and(|one| !chosen.contains_key(&one.column)),
                direction: one.and_then(|one| one.direction).map(|direction| match direction {
                    Direction::Forward => "forward",
                    Direction::Backward => "backward",
                }),
            }
        })
        .collect();
    let mut because = values.unreadable.clone();
    because.extend(found.iter().filter_map(|one| {
        let theirs = grid.name(one.column);
        match one.meaning {
            Meaning::Polar => Some(format!("`{theirs}` is a polar angle in place of positions")),
            Meaning::Clock => Some(format!("`{theirs}` is a time of day")),
            _ if is_converted(one, unit(one)) => Some(format!("`{theirs}` has a unit that is converted")),
            _ => None,
        }
    }));
    if found.iter().any(|one| one.direction.is_some()) {
        because.push("forward and backward stand in columns of their own".into());
    }
    let unused: Vec<String> =
        columns.iter().filter(|column| column.own.is_none()).map(|column| grid.name(column.number - 1)).collect();
    let mut remarks = assumes.clone();
    remarks.extend(grid.lost_in_words().into_iter().chain(values.left_out.iter().cloned()));
    if !unused.is_empty() {
        remarks.push(format!("not read: {}", unused.join(", ")));
    }
    let copy = (!because.is_empty()).then(|| normalised(name, table, &unit, &because));
    let (format, own_columns) = if copy.is_none() { layout(grid, &columns) } else { Default::default() };
    Reading { assumes, scale_mm, columns, format, own_columns, copy, normalised: because, remarks }
}

/// Our name of a column, with its unit.
fn own_name(one: &Found, unit: Unit, expected: &Expected<'_>) -> String {
    match &one.meaning {
        Meaning::Axis(axis) => axis_name(*axis, unit.in_files(), expected),
        Meaning::Socket | Meaning::Run | Meaning::Temperature | Meaning::Driver(_) => one.meaning.stem().to_string(),
        Meaning::Time | Meaning::Clock => "time_s".into(),
        meaning if open_units::has_no_unit(meaning, expected) => meaning.stem().to_string(),
        meaning => format!("{}_{}", meaning.stem(), unit.in_files().key()),
    }
}

fn axis_name(axis: usize, unit: Unit, expected: &Expected<'_>) -> String {
    let name = &expected.machine.axes[axis].name;
    let lower = name.to_lowercase();
    let own = if axes::axis_index(expected.machine, &lower) == Some(axis) { &lower } else { name };
    format!("{own}_{}", unit.key())
}

/// Whether the values of a column are written in another unit or from another zero.
fn is_converted(one: &Found, unit: Unit) -> bool {
    one.is_from_zenith || unit.in_files() != unit
}

/// A value of a column as it is written. An angle from the zenith is written as an elevation.
fn converted(one: &Found, unit: Unit, value: f64) -> f64 {
    let written = unit.in_files();
    let value = unit.convert(value, written).unwrap_or(value);
    if one.is_from_zenith { written.to_display(FRAC_PI_2) - value } else { value }
}

/// `[format]` and `[columns]` of a table that a reader of tables accepts.
fn layout(grid: &Grid, columns: &[ColumnFound]) -> (Format, Columns) {
    let text = |text: char| text.to_string();
    let format = Format {
        separator: grid.separator.filter(|separator| *separator != ',').map(text),
        decimal: Some(grid.decimal).filter(|decimal| *decimal != '.').map(text),
        header: grid.header_line.is_none().then_some(false),
        encoding: (grid.encoding != "utf-8").then(|| grid.encoding.to_string()),
        skip_lines: Some(Count(grid.skipped_lines())).filter(|lines| lines.0 > 0),
        ..Format::default()
    };
    let mut own: Vec<(String, ForeignColumn)> = Vec::new();
    let mut drivers: Vec<(String, ForeignColumn)> = Vec::new();
    for column in columns {
        let Some(name) = &column.own else { continue };
        let foreign = match grid.header_line {
            Some(_) => ForeignColumn::Name(column.name.clone()),
            None => ForeignColumn::Number(Count(column.number)),
        };
        match name.strip_prefix(driver::PREFIX) {
            Some(name) => drivers.push((name.to_string(), foreign)),
            None => own.push((name.clone(), foreign)),
        }
    }
    (format, Columns { driver: Named(drivers), own: Named(own) })
}

/// The cell of a column in a row of the grid and a direction.
type Cell<'w> = Box<dyn Fn(usize, Option<Direction>) -> String + 'w>;

/// The table with our columns.
fn normalised(name: &str, table: &Table<'_>, unit: &dyn Fn(&Found) -> Unit, because: &[String]) -> String {
    let Table { grid, found, expected, values } = table;
    let directed = found.iter().any(|one| one.direction.is_some());
    let value = |one: &Found, row: usize| converted(one, unit(one), values.by_column[&one.column][row]);
    // Of the columns of one meaning, that of a direction.
    let of = |meaning: &Meaning, direction: Option<Direction>| {
        let of_meaning = || found.iter().filter(move |one| one.meaning == *meaning);
        let own = of_meaning().find(|one| one.direction == direction);
        own.or_else(|| of_meaning().find(|one| one.direction.is_none())).or_else(|| of_meaning().next())
    };
    let in_rad = |one: &Found, row: usize| {
        let written = unit(one).in_files();
        if written.is_angle() { written.to_internal(value(one, row)) } else { f64::NAN }
    };
    let mut written: Vec<(String, Cell<'_>)> = Vec::new();
    let mut seen: Vec<&Meaning> = Vec::new();
    for one in found.iter() {
        if seen.contains(&&one.meaning)
            || directed && matches!(one.meaning, Meaning::Time | Meaning::Clock | Meaning::Run)
        {
            continue;
        }
        seen.push(&one.meaning);
        match &one.meaning {
            Meaning::Polar => {
                let Some(circle) = expected.circle else { continue };
                for (place, axis) in circle.axes.into_iter().enumerate() {
                    let part = move |angle: f64| if place == 0 { angle.cos() } else { angle.sin() };
                    let cell = move |row: usize, _: Option<Direction>| {
                        decimal(circle.centre_mm[place] + circle.amplitude_mm[place] * part(in_rad(one, row)))
                    };
                    written.push((axis_name(axis, Unit::Millimetre, expected), Box::new(cell)));
                }
            }
            meaning => {
                let cell = move |row: usize, direction: Option<Direction>| {
                    let Some(one) = of(meaning, direction) else { return String::new() };
                    let text = &grid.rows[values.rows[row]].cells[one.column];
                    let Some(numbers) = values.by_column.get(&one.column) else { return quoted(text) };
                    match !is_converted(one, unit(one)) && *meaning != Meaning::Clock {
                        _ if numbers[row].is_nan() => String::new(),
                        true if grid.decimal == '.' && number(text, '.').is_some() && text.is_ascii() => text.clone(),
                        _ => decimal(value(one, row)),
                    }
                };
                written.push((own_name(one, unit(one), expected), Box::new(cell)));
            }
        }
    }
    let of_run = |row: usize| found.iter().find(|one| one.meaning == Meaning::Run).map_or(1.0, |one| value(one, row));
    let mut order: Vec<(usize, Option<Direction>, Option<usize>)> = Vec::new();
    if directed {
        let mut runs: Vec<f64> = Vec::new();
        (0..values.rows.len()).map(of_run).for_each(|run| {
            if !runs.contains(&run) {
                runs.push(run);
            }
        });
        for (place, run) in runs.iter().enumerate() {
            let rows: Vec<usize> = (0..values.rows.len()).filter(|row| of_run(*row) == *run).collect();
            order.extend(rows.iter().map(|row| (*row, Some(Direction::Forward), Some(2 * place + 1))));
            order.extend(rows.iter().rev().map(|row| (*row, Some(Direction::Backward), Some(2 * place + 2))));
        }
    } else {
        order.extend((0..values.rows.len()).map(|row| (row, None, None)));
    }
    let mut text = format!("# From {}: {}.\n", name.replace(['\n', '\r'], " "), because.join("; "));
    let header: Vec<&str> =
        directed.then_some("run").into_iter().chain(written.iter().map(|(name, _)| name.as_str())).collect();
    text += &header.join(",");
    text.push('\n');
    for (row, direction, run) in order {
        let cells =
            run.map(|run| run.to_string()).into_iter().chain(written.iter().map(|(_, cell)| cell(row, direction)));
        text += &cells.collect::<Vec<_>>().join(",");
        text.push('\n');
    }
    text
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '#']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_string() }
}

/// A number with the digits that it has.
fn decimal(value: f64) -> String {
    if value.is_nan() { String::new() } else { value.to_string() }
}
