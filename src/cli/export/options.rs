//! What a format takes beside the model, from the options of `abbe export`.

use abbe::apply::export::travel::Travel;
use abbe::exports::{self, ExportOptions};
use abbe::files;
use abbe::identify::model_file::IdentifiedModel;
use abbe::model::Diagnostic;
use abbe::model::words::cut;

use super::ExportArguments;
use crate::cli::failure::command_line;
use crate::cli::values;

impl ExportArguments {
    /// The options for a model; the files that they name are read.
    pub fn options(&self, model: &IdentifiedModel) -> Result<ExportOptions, Diagnostic> {
        let patch = self.patch.as_ref().map(|file| files::foreign_text(file, "the URDF file")).transpose()?;
        let dh = self.dh.as_ref().map(|file| files::foreign_text(file, "the table")).transpose()?;
        Ok(ExportOptions {
            convention: self.convention,
            dh,
            patch: patch.map(|source| (source, self.tip.clone())),
            tool_mm: values::point_mm("--tool-mm", &self.tool_mm, model.tool_mm)?,
            entries: exports::entries(&self.entries)?,
            travel: travel(&self.travel, model)?,
            places: self.places,
            references: self.reference.iter().map(|option| reference(option)).collect::<Result<_, _>>()?,
        })
    }
}

/// The travel of each axis over which the entries of a control count: the measured range, or that of an option
/// `AXIS=FROM..TO`.
fn travel(options: &[String], model: &IdentifiedModel) -> Result<Travel, Diagnostic> {
    options.iter().try_fold(Travel::measured(model), |travel, option| {
        let refused = |why: String| {
            command_line(format!(
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

/// The axis and the position of an option `AXIS=POSITION`.
fn reference(option: &str) -> Result<(String, f64), Diagnostic> {
    let place = option.split_once('=').and_then(|(name, place)| Some((name.trim(), place.trim().parse().ok()?)));
    let (name, place) = place.ok_or_else(|| {
        let found = cut(option, 80);
        command_line(format!("`--reference {found}`: AXIS=POSITION is expected, as X=-400, in mm or degrees"))
    })?;
    values::POSITION.check(&format!("--reference {}=", cut(name, 80)), place)?;
    Ok((name.to_string(), place))
}
