//! `abbe validate`: a saved model against readings that it never saw.

use std::path::PathBuf;

use abbe::analysis::{Analysis, Given, Validated, ValidationOptions};
use abbe::files;
use abbe::identify::model_file;
use abbe::model::Diagnostic;
use clap::Args;

use super::results::Read;
use super::{CommonArguments, Global, SessionArguments, read_session};

/// Examples of `abbe validate`.
pub const HELP: &str = include_str!("help/validate.txt");

/// `abbe validate MODEL SESSION`
#[derive(Args)]
pub struct ValidateArguments {
    /// The model, a file of `abbe fit --save` or `abbe trace --save`.
    model: PathBuf,
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    options: ValidationOptions,
    #[command(flatten)]
    common: CommonArguments,
}

/// Runs `abbe validate`.
pub fn run(arguments: &ValidateArguments, _: Global) -> Result<(), Diagnostic> {
    let common = &arguments.common;
    let outputs = common.output.prepared(&[])?;
    outputs.refuse_overwrite([arguments.model.as_path()])?;
    let source = files::text(&arguments.model, "the model file")?;
    let model = model_file::of_source(&source)?;
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    let given = [Given::Model(&model), Given::Session(&session)];
    let found = Validated::run(&given, &arguments.options, common.seed, &|_| true)?;
    let commands = arguments.session.commands::<Validated>(1, &ValidationOptions::default())?;
    let mut read = Read::session(&session, &sources, common.seed);
    read.files.extend(&source.stamp);
    common.output.put_found(&outputs, &found, &commands, &read)
}
