//! `[unknowns]`: the errors to be identified.

use super::quantity;
use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::component::{ErrorKind, ErrorName, Freedom};
use crate::error::ModelError;
use crate::instrument::InstrumentKind;
use crate::session::document::{Table, Value};

/// The errors to be identified: those stated, or what the instrument is there for.
pub(super) fn unknowns(
    machine: &Machine,
    kind: InstrumentKind,
    root: &mut Table<'_>,
) -> Result<Vec<ErrorName>, ModelError> {
    let stated = match root.take("unknowns") {
        None => None,
        Some(value) => {
            let mut table = value.table("[unknowns]".into())?;
            let errors = table.take("errors");
            table.finish()?;
            errors
        }
    };
    let Some(value) = stated else {
        return Ok(match kind {
            InstrumentKind::BallBar | InstrumentKind::Probe | InstrumentKind::RTest => {
                default_unknowns(machine)
            }
            InstrumentKind::Tracker | InstrumentKind::Socket => Vec::new(),
        });
    };
    let mut unknowns: Vec<ErrorName> = Vec::new();
    for item in value.list("a list of error names")? {
        let name = error_name(machine, &item)?;
        if unknowns.contains(&name) {
            return Err(item.error(format!("`{name}` stands twice among the unknowns"), None));
        }
        unknowns.push(name);
    }
    Ok(unknowns)
}

/// An error of the machine by its name.
fn error_name(machine: &Machine, item: &Value<'_>) -> Result<ErrorName, ModelError> {
    let text = item.text()?;
    let Some(mut name) = ErrorName::parse(&text) else {
        let help = "ISO 230-1 names such as \"EY0A\" (location) and \"EYA\" (motion), or `e_y0a`, `θ_z0c`";
        return Err(item.error(format!("\"{text}\" is no error's name"), Some(help.into())));
    };
    match quantity::axis_index(machine, &name.axis) {
        Some(index) => name.axis.clone_from(&machine.axes[index].name),
        None => {
            let (message, help) = quantity::no_axis(machine, &name.axis);
            return Err(item.error(format!("\"{text}\": {message}"), Some(help)));
        }
    }
    Ok(name)
}

/// The position and orientation errors of every rotary axis, in alphabetical order of the axes: its location errors without the two
/// that its own movement hides.
fn default_unknowns(machine: &Machine) -> Vec<ErrorName> {
    let mut rotary: Vec<_> = machine
        .axes
        .iter()
        .filter(|axis| axis.kind == AxisKind::Rotary)
        .collect();
    rotary.sort_by(|a, b| a.name.cmp(&b.name));
    rotary
        .into_iter()
        .flat_map(|axis| {
            let own = axis.own_freedom().index() % 3;
            Freedom::ALL
                .into_iter()
                .filter(move |freedom| freedom.index() % 3 != own)
                .map(|freedom| ErrorName {
                    kind: ErrorKind::Location,
                    freedom,
                    axis: axis.name.clone(),
                })
        })
        .collect()
}
