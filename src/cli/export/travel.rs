//! `--travel AXIS=FROM..TO`: the travel over which the entries of a control count.

use abbe::identify::export::travel::Travel;
use abbe::identify::model_file::IdentifiedModel;
use abbe::model::words::cut;

use crate::cli::failure::Failure;
use crate::cli::values;

/// The travel of each axis: the measured range, or that of an option `AXIS=FROM..TO`.
pub fn stated(options: &[String], model: &IdentifiedModel) -> Result<Travel, Failure> {
    let mut travel = Travel::measured(model);
    for option in options {
        let refused = |why: &str| {
            let axes: Vec<&str> = model.machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            Failure::CommandLine(format!(
                "`--travel {}`: {why}; AXIS=FROM..TO is expected, as A=-30..110, in mm or degrees, with an axis of {}",
                cut(option, 80),
                axes.join(", ")
            ))
        };
        let (name, range) = option.split_once('=').ok_or_else(|| refused("no `=`"))?;
        let (from, to) = range.split_once("..").ok_or_else(|| refused("no `..`"))?;
        let axis = model.machine.axis_index(name.trim()).ok_or_else(|| refused("no such axis"))?;
        let number = |text: &str| text.trim().parse::<f64>().ok();
        let (from, to) = number(from).zip(number(to)).ok_or_else(|| refused("no two numbers"))?;
        values::POSITION.all(&format!("--travel {}=", model.machine.axes[axis].name), &[from, to])?;
        if from >= to {
            return Err(refused("the first number is not below the second"));
        }
        let kind = model.machine.axes[axis].kind;
        travel.ranges[axis] = [from, to].map(|value| kind.to_internal(value));
        travel.is_measured = false;
    }
    Ok(travel)
}
