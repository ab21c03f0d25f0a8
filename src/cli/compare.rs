//! `abbe compare`: differences between sessions or models of one machine.

use std::path::{Path, PathBuf};

use abbe::analysis::{Analysis, Compared, ComparisonOptions, Given};
use abbe::files::stamp::FileStamp;
use abbe::files::{self, ReadOptions, SourceMap};
use abbe::identify::model_file::{self, IdentifiedModel};
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use clap::Args;

use super::failure::command_line;
use super::output::Outputs;
use super::results::Read;
use super::{CommonArguments, DataArguments, Global, PlausibilityArguments, repeated};

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
    #[command(flatten)]
    plausibility: PlausibilityArguments,
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
    if arguments.plausibility.allow_implausible && !arguments.repeated {
        let message = "`--allow-implausible` belongs to `--repeated`; state both or none";
        return Err(command_line(message));
    }
    if arguments.repeated {
        return repeated::run(&arguments.inputs, &arguments.data, arguments.plausibility, common, &outputs);
    }
    let reading = arguments.data.options();
    let inputs: Vec<File> =
        arguments.inputs.iter().map(|file| read(file, &reading, &outputs)).collect::<Result<_, _>>()?;
    let names = arguments.inputs.iter().map(|file| file.display().to_string()).collect();
    let options = ComparisonOptions { names, ..arguments.options.clone() };
    let given: Vec<Given<'_>> = inputs.iter().map(File::given).collect();
    let found = Compared::run(&given, &options, common.seed, &|_| true)?;
    let mut from = Read { seed: Some(common.seed), ..Read::default() };
    for input in &inputs {
        match input {
            File::Session(read) => from.sessions.push((&read.0, &read.1)),
            File::Model(_, stamp) => from.files.extend(stamp),
        }
    }
    common.output.put_found(&outputs, &found, &arguments.data.commands(Path::new("")), &from)
}

/// An input with what it was read from.
enum File {
    Session(Box<(Session, SourceMap)>),
    Model(Box<IdentifiedModel>, Option<FileStamp>),
}

impl File {
    fn given(&self) -> Given<'_> {
        match self {
            File::Session(read) => Given::Session(&read.0),
            File::Model(model, _) => Given::Model(model),
        }
    }
}

fn read(file: &Path, options: &ReadOptions, outputs: &Outputs) -> Result<File, Diagnostic> {
    let source = files::text(file, "the session or model")?;
    if model_file::is_model(&source.text) {
        outputs.refuse_overwrite([file])?;
        return Ok(File::Model(Box::new(model_file::of_source(&source)?), source.stamp));
    }
    let (session, sources) = files::session_of(&source, options)?;
    outputs.refuse_overwrite_of_sources(&sources)?;
    Ok(File::Session(Box::new((session, sources))))
}
