//! `--at AXIS=POSITION`: positions of axes without a column.

use abbe::model::chain::Machine;

use crate::cli::failure::Failure;
use crate::cli::values;

/// The stated positions of axes, zero for the others, mm or rad.
pub fn stated(machine: &Machine, stated: &[String]) -> Result<Vec<f64>, Failure> {
    let mut at = vec![None; machine.axes.len()];
    for text in stated {
        let fault = || Failure::Other(format!("--at {text}: write an axis and its position in mm or degrees, `A=30`"));
        let (name, number) = text.split_once('=').ok_or_else(fault)?;
        let number: f64 = number.trim().parse().map_err(|_| fault())?;
        values::POSITION.check(&format!("--at {}=", name.trim()), number)?;
        let Some(axis) = machine.axis_index(name.trim()) else {
            let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            let axes = names.join(", ");
            return Err(Failure::Other(format!(
                "--at {text}: the machine has no axis `{}`; its axes are {axes}",
                name.trim()
            )));
        };
        if at[axis].replace(machine.axes[axis].kind.to_internal(number)).is_some() {
            return Err(Failure::Other(format!("--at {text}: the position of {} is stated twice", name.trim())));
        }
    }
    Ok(at.into_iter().map(Option::unwrap_or_default).collect())
}
