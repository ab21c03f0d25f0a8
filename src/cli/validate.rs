//! `abbe validate`: a saved model against readings that it never saw.

use std::path::PathBuf;

use abbe::apply::compare::workspace::rms_of_moved;
use abbe::document::StatedValidation;
use abbe::files;
use abbe::identify::model_file;
use abbe::model::component::ErrorName;
use abbe::trace::validate::validate_anew;
use clap::Args;

use super::failure::Failure;
use super::results::Read;
use super::{CommonArguments, SessionArguments, read_session, values};
use crate::report;

/// Examples of `abbe validate`.
pub const HELP: &str = include_str!("help/validate.txt");

/// `abbe validate MODEL SESSION`
#[derive(Args)]
pub struct ValidateArguments {
    /// The model, a file of `abbe fit --save` or `abbe trace --save`.
    model: PathBuf,
    #[command(flatten)]
    session: SessionArguments,
    /// Errors of the machine that a new mounting changes, such as EC0AZ: estimated from SESSION like its set-up, not taken
    /// from the model. Separate several by commas.
    #[arg(long, value_name = "ERROR", value_delimiter = ',', value_parser = values::error_name)]
    anew: Vec<ErrorName>,
    #[command(flatten)]
    common: CommonArguments,
}

/// Runs `abbe validate`.
pub fn run(arguments: &ValidateArguments) -> Result<(), Failure> {
    let common = &arguments.common;
    let outputs = common.output.prepared(&[])?;
    outputs.refuse_overwrite([arguments.model.as_path()])?;
    let source = files::text(&arguments.model, "the model file")?;
    let model = model_file::of_source(&source)?;
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    let mut validation = validate_anew(&model, &session, &arguments.anew)?;
    validation.result.volumetric_rms_um = rms_of_moved(&model, &validation.result.moved)?;
    let mut read = Read::session(&session, &sources, common.seed);
    read.files.extend(&source.stamp);
    let stated = StatedValidation::of_validation(&validation.result);
    let report = report::validate::report(&session, &validation, &stated, &arguments.session.commands("validate", &[]));
    common.output.put(&outputs, &report, &stated, &read)
}
