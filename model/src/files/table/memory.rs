//! Readings from columns in memory: the same names, units and checks as the columns of a file.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use super::columns::{Column, Role, known, listed};
use super::fill::{self, BySocket};
use super::missing::{self, Marks};
use super::request::Request;
use super::{duplicates, required};
use crate::error::ModelError;
use crate::files::spelling::suggestion;
use crate::instrument::Fault;
use crate::instrument::column::Quantity;
use crate::session::readings::Readings;
use crate::session::{check, columns};

const NOT_ENOUGH: &str = "a test needs at least two readings, and as many as it has parameters";

/// A column of readings in memory.
#[derive(Clone, Copy, Debug)]
pub struct MemoryColumn<'a> {
    /// Its name in a data file, with the unit: `c_deg`, `length_mm`, `run`, `socket`.
    pub name: &'a str,
    /// Its values, one for each reading.
    pub values: Values<'a>,
    /// Which of the values are missing, one for each reading; empty if none is. A reading of which a value is missing is
    /// left out, and a warning tells how many they are and where.
    pub missing: &'a [bool],
}

/// The values of a column.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// Numbers in the unit of the name.
    Numbers(&'a [f64]),
    /// The names of sockets.
    Words(&'a [String]),
}

impl Values<'_> {
    fn len(self) -> usize {
        match self {
            Values::Numbers(numbers) => numbers.len(),
            Values::Words(words) => words.len(),
        }
    }

    /// The values of some rows.
    fn of_rows(self, rows: &[usize]) -> OwnValues {
        match self {
            Values::Numbers(numbers) => OwnValues::Numbers(rows.iter().map(|row| numbers[*row]).collect()),
            Values::Words(words) => OwnValues::Words(rows.iter().map(|row| words[*row].clone()).collect()),
        }
    }

    fn hash(self, row: usize, hasher: &mut DefaultHasher) {
        match self {
            Values::Numbers(numbers) => numbers[row].to_bits().hash(hasher),
            Values::Words(words) => words[row].hash(hasher),
        }
    }
}

/// The values of the readings that are not missing.
enum OwnValues {
    Numbers(Vec<f64>),
    Words(Vec<String>),
}

impl OwnValues {
    fn borrowed(&self) -> Values<'_> {
        match self {
            OwnValues::Numbers(numbers) => Values::Numbers(numbers),
            OwnValues::Words(words) => Values::Words(words),
        }
    }
}

/// Readings of the columns, one set per socket if a column names sockets, and warnings.
///
/// # Errors
/// A column of an unknown name, of another length or with a number that is not finite; a missing column; decreasing
/// time.
pub(crate) fn read(given: &[MemoryColumn<'_>], request: &Request<'_>) -> Result<(BySocket, Vec<String>), ModelError> {
    let columns = roles(given, request).map_err(fault)?;
    let names: Vec<String> = given.iter().map(|column| column.name.to_string()).collect();
    required::required(request, Path::new(""), 0, &columns, Some(&names))?;
    let rows = given.first().map_or(0, |column| column.values.len());
    let marks: Vec<Marks<'_>> =
        given.iter().map(|column| Marks { name: column.name, missing: column.missing }).collect();
    let Some(present) = missing::present(&marks, rows).map_err(fault)? else {
        return filled(given, None, &columns, request).map_err(fault);
    };
    if present.len() < check::MIN_READINGS {
        let message =
            format!("{} of {rows} readings are missing, the rest is not enough for a fit", rows - present.len());
        return Err(fault((message, NOT_ENOUGH.into())));
    }
    let values: Vec<OwnValues> = given.iter().map(|column| column.values.of_rows(&present)).collect();
    let kept = given.iter().zip(&values);
    let kept: Vec<MemoryColumn<'_>> =
        kept.map(|(column, own)| MemoryColumn { values: own.borrowed(), missing: &[], ..*column }).collect();
    let (readings, mut warnings) = filled(&kept, Some(&present), &columns, request).map_err(fault)?;
    warnings.insert(0, missing::warning(&request.test.name, &marks, rows, present.len()));
    Ok((readings, warnings))
}

fn fault((message, help): Fault) -> ModelError {
    ModelError::Session { message, help }
}

/// The role of each column.
fn roles(given: &[MemoryColumn<'_>], request: &Request<'_>) -> Result<Vec<Column>, Fault> {
    let mut columns: Vec<Column> = Vec::with_capacity(given.len());
    for (index, MemoryColumn { name, values, .. }) in given.iter().enumerate() {
        let Some(role) = Role::of(name, request).or_else(|| Role::of(&name.to_lowercase(), request)) else {
            let known = known(request);
            let like: Vec<&str> = known.iter().map(String::as_str).collect();
            let help = format!("{}known columns are {}", suggestion(name, &like), listed(&known));
            return Err((format!("unknown column `{name}`"), help));
        };
        if let Some(other) = columns.iter().find(|other| other.role.same_as(&role)) {
            return Err((
                format!("columns `{}` and `{name}` have the same meaning", other.name),
                "keep one of them".into(),
            ));
        }
        if (role == Role::Socket) != matches!(values, Values::Words(_)) {
            let what = if role == Role::Socket { "the names of sockets" } else { "numbers" };
            return Err((format!("`{name}`: {what} are expected"), "one for each reading".into()));
        }
        if values.len() != given[0].values.len() {
            return Err((
                format!("`{name}` has {} values, `{}` has {}", values.len(), given[0].name, given[0].values.len()),
                "all columns have one value for each reading".into(),
            ));
        }
        columns.push(Column { role, index, name: (*name).to_string() });
    }
    Ok(columns)
}

/// Readings of columns without gaps. `items` are the places of their rows among all that were given, if some are missing.
fn filled(
    given: &[MemoryColumn<'_>],
    items: Option<&[usize]>,
    columns: &[Column],
    request: &Request<'_>,
) -> Result<(BySocket, Vec<String>), Fault> {
    let rows = given.first().map_or(0, |column| column.values.len());
    let item = |row: usize| items.map_or(row, |items| items[row]);
    if rows < check::MIN_READINGS {
        return Err((format!("{rows} readings, which is not enough for a fit"), NOT_ENOUGH.into()));
    }
    let coordinates = request.instrument().coordinates();
    let mut readings = Readings {
        positions: vec![Vec::new(); request.machine.axes.len()],
        coordinates,
        observed: vec![0.0; rows * coordinates],
        ..Readings::default()
    };
    let (mut sockets, mut socket): (Vec<String>, Vec<usize>) = (Vec::new(), Vec::new());
    for (column, MemoryColumn { name, values, .. }) in columns.iter().zip(given) {
        let numbers = match values {
            Values::Numbers(numbers) => *numbers,
            Values::Words(words) => {
                for word in *words {
                    socket.push(fill::socket_index(&mut sockets, word)?);
                }
                continue;
            }
        };
        for (row, number) in numbers.iter().enumerate() {
            columns::number(name, *number)
                .map_err(|(message, help)| (format!("{message} (item {})", item(row)), help))?;
        }
        match &column.role {
            Role::Time => readings.time_s = times(name, numbers, &item)?,
            Role::Run => {
                readings.run =
                    numbers.iter().map(|number| fill::run_number(*number)).collect::<Option<_>>().ok_or((
                        format!("`{name}` has a value that is not a run number"),
                        "run numbers are integers, one for each traversal in one direction".to_string(),
                    ))?;
            }
            Role::Driver(name) => _ = readings.drivers.insert(name.clone(), numbers.to_vec()),
            Role::Axis(axis, unit) => {
                readings.positions[*axis] = numbers.iter().map(|number| unit.to_internal(*number)).collect();
            }
            Role::Reading(quantity, unit) => {
                let first = match quantity {
                    Quantity::Coordinate(coordinate) => *coordinate,
                    _ => 0,
                };
                let observed = readings.observed[first..].iter_mut().step_by(coordinates);
                for (observed, number) in observed.zip(numbers) {
                    *observed = fill::observed(*quantity, unit.to_internal(*number), request);
                }
            }
            Role::Socket => {}
        }
    }
    for (positions, at) in readings.positions.iter_mut().zip(&request.test.at) {
        if positions.is_empty() {
            *positions = vec![*at; rows];
        }
    }
    let warning = without_copies(&mut readings, &mut socket, given, &item);
    let warnings = warning.map(|warning| format!("test \"{}\": {warning}", request.test.name));
    Ok((fill::by_socket(readings, sockets, &socket), warnings.into_iter().collect()))
}

fn times(name: &str, numbers: &[f64], item: &dyn Fn(usize) -> usize) -> Result<Vec<f64>, Fault> {
    for (row, pair) in numbers.windows(2).enumerate() {
        if let Some(fault) = check::decreasing_time(pair[0], pair[1]) {
            return Err((format!("`{name}`, item {}: {fault}", item(row + 1)), "sort the readings by time".into()));
        }
    }
    Ok(numbers.to_vec())
}

/// Removes rows that are copies of earlier ones, as in a file, with a message.
fn without_copies(
    readings: &mut Readings,
    socket: &mut Vec<usize>,
    given: &[MemoryColumn<'_>],
    item: &dyn Fn(usize) -> usize,
) -> Option<String> {
    // Hashes of all rows take as much memory as the rows themselves.
    if readings.time_s.is_empty() && readings.run.is_empty() || duplicates::cannot_occur(readings) {
        return None;
    }
    let rows = readings.rows();
    let hash_of = |row: usize| {
        let mut hasher = DefaultHasher::new();
        given.iter().for_each(|column| column.values.hash(row, &mut hasher));
        hasher.finish()
    };
    let cells: Vec<u64> = (0..rows).map(hash_of).collect();
    let kept = duplicates::kept(readings, &cells)?;
    let lines: Vec<usize> = (0..rows).map(|row| item(row) + 1).collect();
    let message = duplicates::message(Path::new("the arrays"), &lines, &kept);
    *readings = readings.of_rows(&kept);
    if !socket.is_empty() {
        *socket = kept.iter().map(|row| socket[*row]).collect();
    }
    Some(message)
}
