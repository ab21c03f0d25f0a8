//! `abbe compare`: differences between sessions or models of one machine.

use std::path::{Path, PathBuf};

use abbe::analysis::{Analysis, Compared, ComparisonOptions, Given};
use abbe::model::Diagnostic;
use clap::Args;

use super::failure::command_line;
use super::results::{File, Read};
use super::{CommonArguments, DataArguments, Global, repeated};

/// Examples of `abbe compare`.
pub const HELP: &str = include_str!("help/compare.txt");

/// `abbe compare A B …`
#[derive(Args)]
pub struct CompareArguments {
    /// Sessions or models, the first one being that with which the others are compared.
    #[arg(required = true)]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    data: DataArguments,
    /// The sessions repeat one plan on an unchanged machine: state the standard uncertainty from the scatter of their fits
    /// (Type A) beside that of each fit (Type B).
    #[arg(long, conflicts_with_all = ["shared", "significance", "places"])]
    repeated: bool,
    /// Accept readings that contradict the machine, such as axes more than 5 % of a link beside their place. Without it they
    /// are refused where another reading of the file explains them.
    #[arg(long)]
    allow_implausible: bool,
    #[command(flatten)]
    options: ComparisonOptions,
    #[command(flatten)]
    common: CommonArguments,
}

/// Runs `abbe compare`.
pub fn run(arguments: &CompareArguments, _: Global) -> Result<(), Diagnostic> {
    let ComparisonOptions { significance: found, places, .. } = arguments.options;
    if !(found > 0.0 && found < 1.0) {
        return Err(command_line(format!("`--significance {found}`: a probability between 0 and 1 is expected")));
    }
    if places > 100 {
        return Err(command_line(format!("`--places {places}`: 100 is the most")));
    }
    let common = &arguments.common;
    let outputs = common.output.prepared(&[])?;
    if arguments.inputs.len() < 2 {
        return Err(command_line("at least two sessions or models are expected; name another"));
    }
    if arguments.allow_implausible && !arguments.repeated {
        let message = "`--allow-implausible` belongs to `--repeated`; state both or none";
        return Err(command_line(message));
    }
    if arguments.repeated {
        return repeated::run(&arguments.inputs, &arguments.data, arguments.allow_implausible, common, &outputs);
    }
    let reading = arguments.data.options();
    let inputs: Vec<File> =
        arguments.inputs.iter().map(|file| File::read(file, None, &reading, &outputs)).collect::<Result<_, _>>()?;
    let names = arguments.inputs.iter().map(|file| file.display().to_string()).collect();
    let options = ComparisonOptions { names, ..arguments.options.clone() };
    let given: Vec<Given<'_>> = inputs.iter().map(File::given).collect();
    let found = Compared::run(&given, &options, common.seed, &|_| true)?;
    let commands = arguments.data.commands(Path::new(""));
    common.output.put_found(&outputs, &found, &commands, &Read::inputs(&inputs, common.seed))
}
