//! `abbe volumetric`: the closed form of the error vector of the tool point, or its map.

use std::path::PathBuf;

use abbe::codegen::{Equation, ToolPoint};
use abbe::equation::EquationParameters;
use abbe::files;
use abbe::model::Diagnostic;
use abbe::model::pattern;
use clap::Args;

use super::Global;
use super::equation::form::FormArguments;
use super::map::{self, MapArguments};

/// Examples of `abbe volumetric`.
pub const HELP: &str = include_str!("help/volumetric.txt");

/// `abbe volumetric MACHINE`
#[derive(Args)]
pub struct VolumetricArguments {
    /// The machine file.
    machine: PathBuf,
    #[command(flatten)]
    form: FormArguments,
    #[command(flatten)]
    map: MapArguments,
}

/// Runs `abbe volumetric`.
pub fn run(arguments: &VolumetricArguments, _: Global) -> Result<(), Diagnostic> {
    let source = files::text(&arguments.machine, "the machine file")?;
    let machine = files::machine_of(&source)?;
    let outputs = arguments.map.output.prepared(&[arguments.form.out.as_ref(), arguments.map.map.as_ref()])?;
    let read = std::iter::once(&arguments.machine).chain(&arguments.map.functions);
    outputs.refuse_overwrite(read.map(PathBuf::as_path))?;
    if arguments.map.map.is_some() {
        return map::run(&source, &machine, &arguments.map, &outputs);
    }
    let form = &arguments.form;
    let mut parameters = EquationParameters::parse(&form.errors, &machine, &[], &[])?;
    if form.errors.is_empty() {
        parameters.errors = pattern::errors(&machine);
    }
    let equation = Equation::volumetric(&machine, &parameters.errors, &form.options(&parameters))?;
    form.write(&equation, &ToolPoint)
}
