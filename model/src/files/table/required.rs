//! Columns that an instrument requires.

use std::path::Path;

use super::columns::{Column, Role, known, listed, r_test_columns, r_test_help};
use super::request::Request;
use crate::error::{Location, ModelError};
use crate::instrument::InstrumentKind;
use crate::session::check::{self, MissingPosition};

/// Returns an error if one of them is missing.
pub(super) fn required(
    request: &Request<'_>,
    file: &Path,
    line: usize,
    columns: &[Column],
    header: Option<&[String]>,
) -> Result<(), ModelError> {
    let has = |accepted: &dyn Fn(Role) -> bool| columns.iter().any(|column| accepted(column.role));
    let found = || match header {
        Some(header) => format!("; found: {}", listed(header)),
        None => String::new(),
    };
    let missing = |what: String, help: String| {
        Err(ModelError::Input {
            location: Location::line(file, line),
            message: format!("no column {what}{}", found()),
            help: Some(help),
        })
    };
    match request.instrument() {
        InstrumentKind::BallBar => {
            if !has(&|role| matches!(role, Role::Length(_) | Role::Deviation(_))) {
                return missing(
                    "with the bar readings".into(),
                    "a ball bar needs `length_mm`, or `deviation_um` from `bar_mm`".into(),
                );
            }
        }
        InstrumentKind::Probe => {
            if !has(&|role| matches!(role, Role::Length(_) | Role::Outward(_))) {
                return missing(
                    "with the probe readings".into(),
                    "a probe needs `distance_mm` to the surface, or `deviation_um`, the deviation outwards".into(),
                );
            }
        }
        InstrumentKind::Tracker => {
            for (index, name) in ["px_mm", "py_mm", "pz_mm"].into_iter().enumerate() {
                if !has(&|role| matches!(role, Role::Coordinate(i, _) if i == index)) {
                    return missing(format!("`{name}`"), "a tracker needs px_mm, py_mm and pz_mm".into());
                }
            }
        }
        InstrumentKind::RTest => {
            for (index, name) in r_test_columns(request.sensors()).into_iter().enumerate() {
                if !has(&|role| matches!(role, Role::Coordinate(i, _) if i == index)) {
                    return missing(format!("`{name}_um`"), r_test_help(request).into());
                }
            }
        }
        InstrumentKind::Socket => {
            if request.test.socket.is_none() && !has(&|role| role == Role::Socket) {
                return missing(
                    "`socket`".into(),
                    "add the column, or add `socket = \"…\"` to the test if all its poses have one socket".into(),
                );
            }
        }
    }
    let missed = check::missing_position(
        request.machine,
        request.instrument(),
        |axis| request.at_listed.get(axis).copied().unwrap_or(false),
        |axis| has(&|role| matches!(role, Role::Axis(i, _) if i == axis)),
        &request.moved(),
    );
    match missed {
        None => Ok(()),
        Some(MissingPosition::Moved(index)) => {
            let axis = &request.machine.axes[index];
            let name = axis.column("");
            missing(
                format!("`{name}`, though axis `{}` moves in this test", axis.name),
                "add its positions to the data".into(),
            )
        }
        Some(MissingPosition::NotStated(index)) => {
            let axis = &request.machine.axes[index];
            let name = axis.column("");
            missing(
                format!("`{name}`"),
                format!("add the positions of axis `{}` to the data, or state it: `at = {{ {name} = 0 }}`", axis.name),
            )
        }
        Some(MissingPosition::All) => {
            missing("with the position of an axis".into(), format!("known here: {}", listed(&known(request))))
        }
    }
}
