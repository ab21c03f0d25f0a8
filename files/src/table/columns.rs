//! Assignment of the columns of a file to their roles.

use std::path::Path;

use abbe_model::chain::Machine;
use abbe_model::diagnostic::{Diagnostic, Location};
use abbe_model::document::layout::Traversals;
use abbe_model::document::value::Count;
use abbe_model::driver::column;
use abbe_model::instrument::Fault;
use abbe_model::instrument::Station;
use abbe_model::instrument::column::Quantity;
use abbe_model::unit::Unit;

use super::encoding::name_of;
use super::number::number;
use super::request::{ColumnMapping, ForeignColumn, Request};
use super::row::Row;
use crate::axes;
use crate::spelling::suggestion;

/// The content of a column.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Role {
    Time,
    Run,
    /// A driver column, `NAME_unit`.
    Driver(String),
    Axis(usize, Unit),
    /// A column of the instrument's readings.
    Reading(Quantity, Unit),
    Socket,
    /// The polar angle of a test whose path is a circle, in place of the positions of both axes.
    Polar(Unit),
}

/// A column that is read.
#[derive(Clone, Debug)]
pub(super) struct Column {
    pub role: Role,
    /// Its index in a row, from 0.
    pub index: usize,
    /// Its name in messages.
    pub name: String,
    /// The columns of traversals: their indices, and whether they are against the order of the rows; empty for a column
    /// with one value in a row.
    pub traversals: Vec<(usize, bool)>,
}

impl Role {
    /// Parses one of our names that no instrument has: a time, a run, a driver, the position of an axis.
    pub fn of_machine(name: &str, machine: &Machine) -> Option<Role> {
        match name {
            "time_s" => return Some(Role::Time),
            "run" => return Some(Role::Run),
            _ => {}
        }
        match column::of_files(name) {
            Some(own) => Some(Role::Driver(own.to_string())),
            None => axes::axis_position(machine, name).map(|(axis, unit)| Role::Axis(axis, unit)),
        }
    }

    /// Parses one of our names.
    pub fn of(name: &str, request: &Request<'_>) -> Option<Role> {
        let own = request.test.station.columns();
        if let Some(column) = own.iter().find(|column| column.unit == Unit::One && column.stem == name) {
            return Some(match column.quantity {
                Quantity::Socket => Role::Socket,
                quantity => Role::Reading(quantity, Unit::One),
            });
        }
        match name {
            "polar_deg" => return Some(Role::Polar(Unit::Degree)),
            "polar_rad" => return Some(Role::Polar(Unit::Radian)),
            _ => {}
        }
        if let Some(role) = Role::of_machine(name, request.machine) {
            return Some(role);
        }
        let (what, unit) = name.rsplit_once('_')?;
        let column = own.iter().find(|column| column.unit != Unit::One && column.stem == what)?;
        Some(Role::Reading(column.quantity, Unit::of_column(unit, column.is_angle())?))
    }

    /// Whether two columns contain the same quantity.
    pub fn same_as(&self, other: &Role) -> bool {
        match (self, other) {
            (Role::Axis(a, _), Role::Axis(b, _)) => a == b,
            (Role::Polar(_), Role::Polar(_)) => true,
            (Role::Reading(a, _), Role::Reading(b, _)) => a.is_same_as(*b),
            _ => self == other,
        }
    }
}

/// What the columns of readings hold.
pub(super) fn quantities(columns: &[Column]) -> Vec<Quantity> {
    let of_role = |column: &Column| match column.role {
        Role::Reading(quantity, _) => Some(quantity),
        _ => None,
    };
    columns.iter().filter_map(of_role).collect()
}

/// The set-up with the channels for which there are columns.
pub(crate) fn kept(station: &Station<f64>, quantities: &[Quantity]) -> Station<f64> {
    let mut station = station.clone();
    station.keep_channels(&|quantity| quantities.contains(&quantity));
    station
}

/// Every valid column name of this test.
pub(super) fn known(request: &Request<'_>) -> Vec<String> {
    let mut known: Vec<String> = ["time_s", "run"].map(str::to_string).to_vec();
    for axis in &request.machine.axes {
        let unit = axis.kind.unit();
        known.push(format!("{}_{unit}", axis.name.to_lowercase()));
    }
    known.push(column::TEMPERATURE.into());
    known.push(format!("{}NAME_unit", column::PREFIX));
    known.extend(request.test.station.columns().iter().map(|column| column.name(column.unit)));
    known
}

pub(crate) fn listed(names: &[String]) -> String {
    const MAX: usize = 40;
    let mut text = names.iter().take(MAX).cloned().collect::<Vec<_>>().join(", ");
    if names.len() > MAX {
        text.push_str(", …");
    }
    text
}

/// The columns to be read, from the first row, which is the header if the file has one.
pub(super) fn columns(
    request: &Request<'_>,
    file: &Path,
    first: &Row,
    header: Option<&Row>,
) -> Result<Vec<Column>, Diagnostic> {
    let line = first.line;
    let columns = match request.columns {
        Some(mapped) => mapped_columns(request, file, mapped, header, first)?,
        None => own_columns(request, file, header)?,
    };
    for (index, column) in columns.iter().enumerate() {
        if let Some(other) = columns[..index].iter().find(|other| other.role.same_as(&column.role)) {
            return Err(Diagnostic::input(
                Location::line(file, line),
                format!("columns `{}` and `{}` have the same meaning", other.name, column.name),
                "keep one of them; [columns] can name the one to read",
            ));
        }
    }
    Ok(columns)
}

fn own_columns(request: &Request<'_>, file: &Path, header: Option<&Row>) -> Result<Vec<Column>, Diagnostic> {
    let Some(row) = header else {
        return Err(Diagnostic::input(
            Location::file(file),
            "a data file without a header and without [columns] that name its columns",
            "add [columns] with `name = number`, counted from 1, such as `j1_rad = 1`",
        ));
    };
    let known = known(request);
    let header = &row.cells;
    let mut columns = Vec::new();
    for (index, name) in header.iter().enumerate() {
        let Some(role) = Role::of(name, request).or_else(|| Role::of(&name.to_lowercase(), request)) else {
            return Err(Diagnostic::input(
                Location::line(file, row.line),
                if row.keyed {
                    format!("unknown key `{name}`")
                } else {
                    format!("column {} has the unknown name `{name}`", index + 1)
                },
                unknown_column_help(request, name, header, &known),
            ));
        };
        columns.push(Column { role, index, name: name.clone(), traversals: Vec::new() });
    }
    Ok(columns)
}

fn unknown_column_help(request: &Request<'_>, name: &str, header: &[String], known: &[String]) -> String {
    let separators = [(';', "\";\""), ('\t', "\"\\t\""), (',', "\",\"")];
    if header.len() == 1
        && let Some((_, other)) =
            separators.iter().find(|(other, _)| *other as u8 != request.format.separator && name.contains(*other))
    {
        return format!("the columns seem to be separated by {other}: declare `[format] separator = {other}`");
    }
    if name.parse::<f64>().is_ok() {
        return NO_HEADER.into();
    }
    if name.starts_with(column::PREFIX) {
        return column::help_on_name();
    }
    let id_stem = name.rsplit_once('_').map_or(name, |(id_stem, _)| id_stem);
    if let Some(help) = request.test.station.help_on_column(id_stem) {
        return help.into();
    }
    format!(
        "{}known here: {}; a file with other names needs [columns], own name = foreign name",
        suggestion(name, known),
        listed(known)
    )
}

/// What to do with a file whose first row names nothing.
const NO_HEADER: &str = "a number was found where a name is expected: a file without a header declares `[format] header = false` and numbers its columns in [columns], such as `length_mm = 3`; lines above the header are skipped with `skip_lines`";

fn mapped_columns(
    request: &Request<'_>,
    file: &Path,
    mapped: &[ColumnMapping],
    header: Option<&Row>,
    first: &Row,
) -> Result<Vec<Column>, Diagnostic> {
    let mut columns: Vec<Column> = Vec::new();
    for entry in mapped {
        let fault = |message: String, help: String| Diagnostic::input(entry.location.clone(), message, help);
        let Some(role) = Role::of(&entry.own, request).or_else(|| Role::of(&entry.own.to_lowercase(), request)) else {
            let known = known(request);
            let help = match entry.own.starts_with(column::PREFIX) {
                true => column::help_on_name(),
                false => format!("{}valid names are {}", suggestion(&entry.own, &known), listed(&known)),
            };
            return Err(fault(format!("[columns] has the unknown column `{}`", entry.own), help));
        };
        let of_one = |foreign: &ForeignColumn| match foreign {
            ForeignColumn::Number(Count(number)) => number_in(*number, file, first.cells.len()),
            ForeignColumn::Name(name) => name_in(name, request, file, header),
            ForeignColumn::Traversals(_) => {
                Err(("a traversal has one column".to_string(), "name it, or state its number".to_string()))
            }
        };
        let traversals = match &entry.foreign {
            ForeignColumn::Traversals(traversals) => traversals_in(traversals, &role, of_one),
            _ => Ok(Vec::new()),
        }
        .map_err(|(message, help)| fault(message, help))?;
        let index = match traversals.first() {
            Some((index, _)) => Ok(*index),
            None => of_one(&entry.foreign),
        }
        .map_err(|(message, help)| fault(message, help))?;
        let is_read =
            |column: &Column| column.index == index || column.traversals.iter().any(|(other, _)| *other == index);
        if let Some(other) = columns.iter().position(is_read) {
            return Err(fault(
                format!(
                    "[columns] reads column {} of {} twice: as `{}` and as `{}`",
                    index + 1,
                    file.display(),
                    mapped[other].own,
                    entry.own
                ),
                "a column has one meaning: name another column for one of them, or remove one".into(),
            ));
        }
        let name = match &entry.foreign {
            ForeignColumn::Name(name) => name.clone(),
            ForeignColumn::Number(_) | ForeignColumn::Traversals(_) => entry.own.clone(),
        };
        columns.push(Column { role, index, name, traversals });
    }
    match header {
        Some(header) if are_readings(request, mapped, &columns, header) => Err(Diagnostic::input(
            Location::line(file, header.line),
            "the first row contains numbers where a header is expected; it would not be read",
            "a file without a header declares `[format] header = false`; lines above the header are skipped with `skip_lines`",
        )),
        _ => Ok(columns),
    }
}

/// The columns of traversals, forward and backward in turn, and whether they are against the order of the rows.
fn traversals_in(
    traversals: &Traversals,
    role: &Role,
    of_one: impl Fn(&ForeignColumn) -> Result<usize, Fault>,
) -> Result<Vec<(usize, bool)>, Fault> {
    if !matches!(role, Role::Reading(..)) {
        let help = "positions, times and runs have one column; only readings stand side by side";
        return Err(("`forward` and `backward` belong to a column of readings".into(), help.into()));
    }
    let (forward, backward) = (&traversals.forward.0, &traversals.backward.0);
    let mut found = Vec::new();
    for number in 0..forward.len().max(backward.len()) {
        for (columns, is_backward) in [(forward, false), (backward, true)] {
            if let Some(column) = columns.get(number) {
                found.push((of_one(column)?, is_backward));
            }
        }
    }
    if found.is_empty() {
        return Err((
            "neither `forward` nor `backward` names a column".into(),
            "name the columns of the traversals".into(),
        ));
    }
    Ok(found)
}

/// Whether the first row is a row of readings instead of a header: columns are given by number only, and all of them
/// contain numbers.
fn are_readings(request: &Request<'_>, mapped: &[ColumnMapping], columns: &[Column], header: &Row) -> bool {
    let mut of_numbers = columns.iter().filter(|column| column.role != Role::Socket).peekable();
    of_numbers.peek().is_some()
        && mapped.iter().all(|entry| matches!(entry.foreign, ForeignColumn::Number(_)))
        && of_numbers.all(|column| number(&header.cells[column.index], &request.format).is_ok())
}

/// The index of a column from its number; otherwise a message and what to do.
fn number_in(number: usize, file: &Path, width: usize) -> Result<usize, (String, String)> {
    if number > width {
        let message = format!("there is no column {number} in {}, which has {width}", file.display());
        return Err((message, "columns are numbered from 1".into()));
    }
    Ok(number - 1)
}

/// The index of a column from its name in the header. If there is none or more than one: a message and what to do.
fn name_in(name: &str, request: &Request<'_>, file: &Path, header: Option<&Row>) -> Result<usize, (String, String)> {
    let Some(row) = header else {
        return Err((
            format!("column `{name}` of a file declared to have no header"),
            "use its number, counted from 1".into(),
        ));
    };
    let header = &row.cells;
    let found: Vec<usize> = (0..header.len()).filter(|index| header[*index] == name).collect();
    match found[..] {
        [index] => Ok(index),
        [] => {
            let mut help = format!("{}it has {}", suggestion(name, header), listed(header));
            if header.iter().all(|cell| number(cell, &request.format).is_ok()) {
                help = NO_HEADER.into();
            } else if let Some(encoding) = row.encoding {
                help.push_str(&format!(
                    "; the header was read as {}: if names look garbled, declare the encoding, such as `[format] encoding = \"utf-8\"`",
                    name_of(encoding)
                ));
            }
            Err((format!("{} has no column `{name}`", file.display()), help))
        }
        [first, ..] => {
            let numbers: Vec<String> = found.iter().map(|index| (index + 1).to_string()).collect();
            Err((
                format!(
                    "{} has {} columns with the name `{name}`: {}",
                    file.display(),
                    found.len(),
                    numbers.join(", ")
                ),
                format!("use the number of one of them, counted from 1, such as {}", first + 1),
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::listed;

    #[test]
    fn a_list_of_names_ends_after_forty() {
        let names: Vec<String> = (0..42).map(|k| format!("n{k}")).collect();
        assert!(listed(&names[..40]).ends_with("n38, n39"));
        for count in [41, 42] {
            assert!(listed(&names[..count]).ends_with("n38, n39, …"));
        }
    }
}
