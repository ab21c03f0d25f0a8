//! `--travel AXIS=FROM..TO`: the travel over which the entries of a control count.

use abbe::apply::export::travel::Travel;
use abbe::identify::model_file::IdentifiedModel;
use abbe::model::words::cut;

use crate::cli::failure::Failure;
use crate::cli::values;

/// The travel of each axis: the measured range, or that of an option `AXIS=FROM..TO`.
pub fn stated(options: &[String], model: &IdentifiedModel) -> Result<Travel, Failure> {
    options.iter().try_fold(Travel::measured(model), |travel, option| {
        let refused = |why: String| {
            Failure::CommandLine(format!(
                "`--travel {}`: {why}; AXIS=FROM..TO is expected, as A=-30..110, in mm or degrees",
                cut(option, 80)
            ))
        };
        let (name, range) = option.split_once('=').ok_or_else(|| refused("no `=`".into()))?;
        let (from, to) = range.split_once("..").ok_or_else(|| refused("no `..`".into()))?;
        let number = |text: &str| text.trim().parse::<f64>().ok();
        let (from, to) = number(from).zip(number(to)).ok_or_else(|| refused("no two numbers".into()))?;
        values::POSITION.all(&format!("--travel {}=", cut(name.trim(), 80)), &[from, to])?;
        travel.with(model, name.trim(), [from, to]).map_err(|error| refused(error.to_string()))
    })
}
