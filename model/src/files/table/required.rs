//! Columns that an instrument requires.

use super::columns::{Column, Role, known, listed};
use super::request::Request;
use crate::instrument::Fault;
use crate::instrument::column::Quantity;
use crate::session::check::{self, MissingPosition};

/// Returns a fault if one of them is missing.
pub(super) fn required(request: &Request<'_>, columns: &[Column], header: Option<&[String]>) -> Result<(), Fault> {
    let has = |accepted: &dyn Fn(&Role) -> bool| columns.iter().any(|column| accepted(&column.role));
    let found = || match header {
        Some(header) => format!("; found: {}", listed(header)),
        None => String::new(),
    };
    let missing = |what: String, help: String| Err((format!("no column {what}{}", found()), help));
    let reads = |quantity: Quantity| match quantity {
        Quantity::Socket => request.test.socket.is_some() || has(&|role| *role == Role::Socket),
        quantity => has(&|role| matches!(role, Role::Reading(own, _) if *own == quantity)),
    };
    if let Some((what, help)) = request.test.station.missing(&reads) {
        return missing(what, help);
    }
    let missed = check::missing_position(
        request.machine,
        request.instrument(),
        |axis| request.at_listed.get(axis).copied().unwrap_or(false),
        |axis| has(&|role| matches!(role, Role::Axis(i, _) if *i == axis)),
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
