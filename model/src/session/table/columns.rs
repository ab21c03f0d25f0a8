//! Which column holds what.

use std::path::Path;

use super::Request;
use crate::error::{ModelError, Place};
use crate::instrument::InstrumentKind;
use crate::session::read::quantity::{self, Unit};
use crate::session::spelling::meant;

/// A line of `[columns]`: ours = theirs.
#[derive(Clone, Debug)]
pub(crate) struct Mapped {
    /// Our name, which carries the unit.
    pub ours: String,
    /// Their name or number.
    pub theirs: Theirs,
    /// Where it is written.
    pub place: Place,
}

/// How a foreign column is called.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Theirs {
    /// By the header.
    Name(String),
    /// From 1.
    Number(usize),
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    Time,
    Run,
    Temperature,
    Axis(usize, Unit),
    Length(Unit),
    Deviation(Unit),
    /// Against the probing direction: how far out a surface was met beyond the target.
    Outward(Unit),
    Coordinate(usize, Unit),
    Socket,
}

/// A column that is read.
#[derive(Clone, Debug)]
pub(super) struct Column {
    pub role: Role,
    /// Its place in a row, from 0.
    pub index: usize,
    /// How messages call it.
    pub name: String,
}

impl Role {
    /// Reads one of our names.
    pub fn of(name: &str, request: &Request<'_>) -> Option<Role> {
        match name {
            "time_s" => return Some(Role::Time),
            "run" => return Some(Role::Run),
            "temperature_c" => return Some(Role::Temperature),
            "socket" if request.instrument == InstrumentKind::Socket => return Some(Role::Socket),
            _ => {}
        }
        if let Some((axis, unit)) = quantity::axis_position(request.machine, name) {
            return Some(Role::Axis(axis, unit));
        }
        let (what, unit) = name.rsplit_once('_')?;
        let unit = Unit::of_length(unit)?;
        match (request.instrument, what) {
            (InstrumentKind::BallBar, "length") => Some(Role::Length(unit)),
            (InstrumentKind::BallBar, "deviation") => Some(Role::Deviation(unit)),
            (InstrumentKind::Probe, "distance") => Some(Role::Length(unit)),
            (InstrumentKind::Probe, "deviation") => Some(Role::Outward(unit)),
            (InstrumentKind::Tracker, "px") => Some(Role::Coordinate(0, unit)),
            (InstrumentKind::Tracker, "py") => Some(Role::Coordinate(1, unit)),
            (InstrumentKind::Tracker, "pz") => Some(Role::Coordinate(2, unit)),
            (InstrumentKind::RTest, name) => {
                let place = r_test_columns(request.sensors)
                    .iter()
                    .position(|own| *own == name)?;
                Some(Role::Coordinate(place, unit))
            }
            _ => None,
        }
    }

    /// Whether two columns would tell the same.
    fn same_as(self, other: Role) -> bool {
        match (self, other) {
            (Role::Axis(a, _), Role::Axis(b, _)) => a == b,
            (Role::Coordinate(a, _), Role::Coordinate(b, _)) => a == b,
            (
                Role::Length(_) | Role::Deviation(_) | Role::Outward(_),
                Role::Length(_) | Role::Deviation(_) | Role::Outward(_),
            ) => true,
            _ => self == other,
        }
    }
}

/// What an R-test's columns are called before their unit: what the sensors count one by one, or the vector in the frame that carries them.
pub(crate) fn r_test_columns(sensors: bool) -> [&'static str; 3] {
    if sensors {
        ["du", "dv", "dw"]
    } else {
        ["dx", "dy", "dz"]
    }
}

/// What an R-test's columns need to be, where they are the other kind's.
fn r_test_help(request: &Request<'_>) -> &'static str {
    if request.sensors {
        "the test says how the sensors stand: it needs what they count, `du_um`, `dv_um` and `dw_um`; without `sensor_angles_deg` and \
         `sensor_directions` it takes `dx_um`, `dy_um` and `dz_um`"
    } else {
        "an R-test needs `dx_um`, `dy_um` and `dz_um`; what single sensors count, `du_um`, `dv_um` and `dw_um`, needs \
         `sensor_angles_deg` or `sensor_directions` in the test"
    }
}

/// Every name that a column may have in this test.
fn known(request: &Request<'_>) -> Vec<String> {
    let mut known: Vec<String> = ["time_s", "run"].map(str::to_string).to_vec();
    for axis in &request.machine.axes {
        let unit = axis.kind.unit();
        known.push(format!("{}_{unit}", axis.name.to_lowercase()));
    }
    known.push("temperature_c".into());
    let own: &[&str] = match request.instrument {
        InstrumentKind::BallBar => &["length_mm", "deviation_um"],
        InstrumentKind::Tracker => &["px_mm", "py_mm", "pz_mm"],
        InstrumentKind::Socket => &["socket"],
        InstrumentKind::Probe => &["distance_mm", "deviation_um"],
        InstrumentKind::RTest if request.sensors => &["du_um", "dv_um", "dw_um"],
        InstrumentKind::RTest => &["dx_um", "dy_um", "dz_um"],
    };
    known.extend(own.iter().map(|name| name.to_string()));
    known
}

fn listed(names: &[String]) -> String {
    const MOST: usize = 40;
    let mut text = names.iter().take(MOST).cloned().collect::<Vec<_>>().join(", ");
    if names.len() > MOST {
        text.push_str(", …");
    }
    text
}

/// The columns to be read, from the header (or the first row's length without one).
pub(super) fn columns(
    request: &Request<'_>,
    file: &Path,
    line: usize,
    header: Option<&[String]>,
    width: usize,
) -> Result<Vec<Column>, ModelError> {
    let columns = match &request.columns {
        Some(mapped) => mapped_columns(request, file, mapped, header, width)?,
        None => own_columns(request, file, line, header)?,
    };
    for (index, column) in columns.iter().enumerate() {
        if let Some(other) = columns[..index]
            .iter()
            .find(|other| other.role.same_as(column.role))
        {
            return Err(ModelError::Input {
                place: Place::line(file, line),
                message: format!("columns `{}` and `{}` tell the same", other.name, column.name),
                help: Some("keep one of them; [columns] can name the one to read".into()),
            });
        }
    }
    required(request, file, line, &columns, header)?;
    Ok(columns)
}

fn own_columns(
    request: &Request<'_>,
    file: &Path,
    line: usize,
    header: Option<&[String]>,
) -> Result<Vec<Column>, ModelError> {
    let Some(header) = header else {
        return Err(ModelError::Input {
            place: Place::file(file),
            message: "a data file without a header, and no [columns] that say what its columns hold".into(),
            help: Some("add [columns] with `ours = number`, counted from 1, as in `j1_rad = 1`".into()),
        });
    };
    let known = known(request);
    let mut columns = Vec::new();
    for (index, name) in header.iter().enumerate() {
        let Some(role) = Role::of(name, request).or_else(|| Role::of(&name.to_lowercase(), request)) else {
            return Err(ModelError::Input {
                place: Place::line(file, line),
                message: format!("column {} is called `{name}`, which is not known", index + 1),
                help: Some(unknown_column_help(request, name, header, &known)),
            });
        };
        columns.push(Column {
            role,
            index,
            name: name.clone(),
        });
    }
    Ok(columns)
}

fn unknown_column_help(request: &Request<'_>, name: &str, header: &[String], known: &[String]) -> String {
    let separators = [(';', "\";\""), ('\t', "\"\\t\""), (',', "\",\"")];
    if header.len() == 1
        && let Some((_, other)) = separators
            .iter()
            .find(|(other, _)| *other as u8 != request.format.separator && name.contains(*other))
    {
        return format!(
            "the columns seem to be separated by {other}: declare `[format] separator = {other}`"
        );
    }
    if name.parse::<f64>().is_ok() {
        return "a number where a name is expected: a file without a header declares `[format] header = false` \
                and numbers its columns in [columns]"
            .into();
    }
    let stem = name.rsplit_once('_').map_or(name, |(stem, _)| stem);
    if request.instrument == InstrumentKind::RTest && r_test_columns(!request.sensors).contains(&stem) {
        return r_test_help(request).into();
    }
    format!(
        "{}known here: {}; a file with other names is read through [columns], ours = theirs",
        meant(name, known),
        listed(known)
    )
}

fn mapped_columns(
    request: &Request<'_>,
    file: &Path,
    mapped: &[Mapped],
    header: Option<&[String]>,
    width: usize,
) -> Result<Vec<Column>, ModelError> {
    let mut columns = Vec::new();
    for entry in mapped {
        let fault = |message: String, help: String| ModelError::Input {
            place: entry.place.clone(),
            message,
            help: Some(help),
        };
        let Some(role) =
            Role::of(&entry.ours, request).or_else(|| Role::of(&entry.ours.to_lowercase(), request))
        else {
            let known = known(request);
            return Err(fault(
                format!("[columns] knows no column `{}`", entry.ours),
                format!("{}ours are {}", meant(&entry.ours, &known), listed(&known)),
            ));
        };
        let index = match (&entry.theirs, header) {
            (Theirs::Number(number), _) => {
                if *number > width {
                    return Err(fault(
                        format!("column {number} of {}, which has {width}", file.display()),
                        "columns are numbered from 1".into(),
                    ));
                }
                number - 1
            }
            (Theirs::Name(name), None) => {
                return Err(fault(
                    format!("column `{name}` of a file declared to have no header"),
                    "give its number, counted from 1".into(),
                ));
            }
            (Theirs::Name(name), Some(header)) => match header.iter().position(|found| found == name) {
                Some(index) => index,
                None => {
                    return Err(fault(
                        format!("{} has no column `{name}`", file.display()),
                        format!("{}it has {}", meant(name, header), listed(header)),
                    ));
                }
            },
        };
        let name = match &entry.theirs {
            Theirs::Name(name) => name.clone(),
            Theirs::Number(_) => entry.ours.clone(),
        };
        columns.push(Column { role, index, name });
    }
    Ok(columns)
}

fn required(
    request: &Request<'_>,
    file: &Path,
    line: usize,
    columns: &[Column],
    header: Option<&[String]>,
) -> Result<(), ModelError> {
    let has = |wanted: &dyn Fn(Role) -> bool| columns.iter().any(|column| wanted(column.role));
    let found = || match header {
        Some(header) => format!("; found: {}", listed(header)),
        None => String::new(),
    };
    let missing = |what: String, help: String| {
        Err(ModelError::Input {
            place: Place::line(file, line),
            message: format!("no column {what}{}", found()),
            help: Some(help),
        })
    };
    match request.instrument {
        InstrumentKind::BallBar => {
            if !has(&|role| matches!(role, Role::Length(_) | Role::Deviation(_))) {
                return missing(
                    "with what the bar read".into(),
                    "a ball bar needs `length_mm`, or `deviation_um` from `bar_mm`".into(),
                );
            }
        }
        InstrumentKind::Probe => {
            if !has(&|role| matches!(role, Role::Length(_) | Role::Outward(_))) {
                return missing(
                    "with what the probe read".into(),
                    "a probe needs `distance_mm` to the surface, or `deviation_um`, by how much further out it was met"
                        .into(),
                );
            }
        }
        InstrumentKind::Tracker => {
            for (index, name) in ["px_mm", "py_mm", "pz_mm"].into_iter().enumerate() {
                if !has(&|role| matches!(role, Role::Coordinate(i, _) if i == index)) {
                    return missing(
                        format!("`{name}`"),
                        "a tracker needs px_mm, py_mm and pz_mm".into(),
                    );
                }
            }
        }
        InstrumentKind::RTest => {
            for (index, name) in r_test_columns(request.sensors).into_iter().enumerate() {
                if !has(&|role| matches!(role, Role::Coordinate(i, _) if i == index)) {
                    return missing(format!("`{name}_um`"), r_test_help(request).into());
                }
            }
        }
        InstrumentKind::Socket => {
            if request.socket.is_none() && !has(&|role| role == Role::Socket) {
                return missing(
                    "`socket`".into(),
                    "add the column, or `socket = \"…\"` to the test if all its poses are of one".into(),
                );
            }
        }
    }
    for (index, axis) in request.machine.axes.iter().enumerate() {
        let stated = request.at_listed.get(index).copied().unwrap_or(false);
        if stated || has(&|role| matches!(role, Role::Axis(i, _) if i == index)) {
            continue;
        }
        let name = axis.column("");
        if request.moved.contains(&index) {
            return missing(
                format!("`{name}`, though axis `{}` moves in this test", axis.name),
                "add its positions to the data".into(),
            );
        }
        if request.instrument != InstrumentKind::BallBar {
            return missing(
                format!("`{name}`"),
                format!(
                    "add the positions of axis `{}` to the data, or where it stands: `at = {{ {name} = 0 }}`",
                    axis.name
                ),
            );
        }
    }
    if !has(&|role| matches!(role, Role::Axis(..))) {
        return missing(
            "with the position of an axis".into(),
            format!("known here: {}", listed(&known(request))),
        );
    }
    Ok(())
}
