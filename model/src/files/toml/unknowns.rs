//! Reader of `[unknowns]`: the errors to be estimated.

use super::quantity;
use crate::chain::Machine;
use crate::component::ErrorName;
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
        return Ok(kind.default_errors(machine));
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
        return Err(item.error(format!("\"{text}\" is not the name of an error"), Some(help.into())));
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
