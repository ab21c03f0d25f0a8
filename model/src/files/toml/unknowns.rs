//! Reader of `[unknowns]`: the errors to be estimated.

use super::quantity;
use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::component::{ErrorKind, ErrorName, Freedom};
use crate::error::ModelError;
use crate::files::toml::document::{Table, Value};
use crate::instrument::InstrumentKind;
use crate::pattern;

/// The errors to be estimated: those stated, or the defaults of the instrument.
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
            InstrumentKind::Tracker | InstrumentKind::Socket => all_location_errors(machine),
        });
    };
    let mut unknowns: Vec<ErrorName> = Vec::new();
    // A pattern may include errors that are named already; each error is estimated once.
    let mut by_pattern: Vec<ErrorName> = Vec::new();
    for item in value.list("a list of error names")? {
        let text = item.text()?;
        if pattern::is_pattern(&text) {
            by_pattern.extend(matching(machine, &item, &text)?);
            for name in &by_pattern {
                if !unknowns.contains(name) {
                    unknowns.push(name.clone());
                }
            }
            continue;
        }
        let name = error_name(machine, &item)?;
        if by_pattern.contains(&name) {
            continue;
        }
        if unknowns.contains(&name) {
            return Err(item.error(format!("`{name}` occurs twice in `errors`"), None));
        }
        unknowns.push(name);
    }
    Ok(unknowns)
}

/// The errors that a pattern matches.
fn matching(machine: &Machine, item: &Value<'_>, text: &str) -> Result<Vec<ErrorName>, ModelError> {
    let found = pattern::matching(machine, text);
    if found.is_empty() {
        let axes: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
        let help = format!(
            "`?` matches one character and `*` any number of them: \"E?0C\" for the location errors of C, \"E?0J*\" for those of all joints; the axes are {}",
            axes.join(", ")
        );
        return Err(item.error(format!("\"{text}\" matches no error of the machine"), Some(help)));
    }
    Ok(found)
}

/// An error of the machine by its name.
fn error_name(machine: &Machine, item: &Value<'_>) -> Result<ErrorName, ModelError> {
    let text = item.text()?;
    let Some(mut name) = ErrorName::parse(&text) else {
        let help = "ISO 230-1 names such as \"EY0A\" (location) and \"EYA\" (motion), or `e_y0a`, `θ_z0c`";
        return Err(item.error(
            format!("\"{text}\" is not the name of an error"),
            Some(help.into()),
        ));
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

/// All location errors of all axes, except the rotation of a linear axis about its own direction, which affects no reading. The joints of
/// a robot have six each, more than its readings identify; the fit names the confounded combinations.
fn all_location_errors(machine: &Machine) -> Vec<ErrorName> {
    let mut errors = pattern::errors(machine);
    errors.retain(|name| {
        let of_linear = machine
            .axes
            .iter()
            .find(|axis| axis.name == name.axis && axis.kind == AxisKind::Linear);
        let own = of_linear.is_some_and(|axis| name.freedom.index() == axis.own_freedom().index() + 3);
        name.kind == ErrorKind::Location && !own
    });
    errors
}

/// The position and orientation errors of every rotary axis, in alphabetical order of the axes. The two location errors in the axis' own
/// degrees of freedom are excluded, because its own motion is confounded with them.
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
