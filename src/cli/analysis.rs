//! The commands of the analyses that need no code of their own: they read files and put what is found.

use std::path::{Path, PathBuf};

use abbe::analysis::{ANALYSES, Command, Given, Kind, Line};
use abbe::files::{self, ReadOptions};
use abbe::identify::model_file;
use abbe::model::Diagnostic;
use clap::{Arg, ArgMatches, Args, FromArgMatches, value_parser};

use super::failure::command_line;
use super::output::Outputs;
use super::results::{File, Read};
use super::{CommonArguments, DataArguments};

/// What every such command takes beside its files and its options.
#[derive(Args)]
struct SharedArguments {
    #[command(flatten)]
    data: DataArguments,
    #[command(flatten)]
    common: CommonArguments,
}

/// The analyses with such a command.
pub fn commands() -> impl Iterator<Item = (&'static Line, &'static Command)> {
    ANALYSES.iter().filter_map(|line| Some((line, line.command.as_ref()?)))
}

/// A parser with these commands.
pub fn added(parser: clap::Command) -> clap::Command {
    commands().fold(parser, |parser, (line, Command { about, help, reads })| {
        let inputs = reads.iter().map(|kind| {
            let (name, about) = words(*kind);
            Arg::new(name).value_name(name).help(about).required(true).value_parser(value_parser!(PathBuf))
        });
        let command = (line.arguments)(clap::Command::new(line.name).args(inputs));
        let command = SharedArguments::augment_args(command).about(about.trim_end_matches('.')).after_help(*help);
        // The options of a struct are not its command.
        parser.subcommand(command.long_about(None::<&str>))
    })
}

/// The name of the argument of a file, and what it is.
fn words(kind: Kind) -> (&'static str, &'static str) {
    match kind {
        Kind::Session => ("SESSION", "The session file"),
        Kind::Model => ("MODEL", "The model, a file of `abbe fit --save` or `abbe trace --save`"),
    }
}

/// Runs the command of an analysis.
pub fn run(line: &Line, command: &Command, matches: &ArgMatches) -> Result<(), Diagnostic> {
    let shared = SharedArguments::from_arg_matches(matches).map_err(|wrong| command_line(wrong.to_string()))?;
    let SharedArguments { data, common } = shared;
    let outputs = common.output.prepared(&[])?;
    let paths = command.reads.iter().filter_map(|kind| Some((*kind, matches.get_one::<PathBuf>(words(*kind).0)?)));
    let paths: Vec<(Kind, &PathBuf)> = paths.collect();
    let read = |(kind, path): &(Kind, &PathBuf)| File::read(path, Some(*kind), &data.options(), &outputs);
    let inputs: Vec<File> = paths.iter().map(read).collect::<Result<_, _>>()?;
    let given: Vec<Given<'_>> = inputs.iter().map(File::given).collect();
    let (stated, found) = (line.run)(&given, &(line.options)(matches)?, common.seed, &|_| true)?;
    let session = paths.iter().find(|(kind, _)| matches!(kind, Kind::Session)).map_or(Path::new(""), |(_, path)| path);
    let commands = data.commands(session).made_by(line.name, &stated);
    common.output.put_found(&outputs, &*found, &commands, &Read::inputs(&inputs, common.seed))
}

impl File {
    /// Reads a file of a kind, or of the one that its text shows. No output may replace it.
    pub fn read(path: &Path, kind: Option<Kind>, options: &ReadOptions, outputs: &Outputs) -> Result<File, Diagnostic> {
        let what = match kind {
            Some(Kind::Session) => "the session file",
            Some(Kind::Model) => "the model file",
            None => "the session or model",
        };
        let source = files::text(path, what)?;
        if kind.map_or_else(|| model_file::is_model(&source.text), |kind| matches!(kind, Kind::Model)) {
            outputs.refuse_overwrite([path])?;
            return Ok(File::Model(Box::new(model_file::of_source(&source)?), source.stamp));
        }
        let (session, sources) = files::session_of(&source, options)?;
        outputs.refuse_overwrite_of_sources(&sources)?;
        Ok(File::Session(Box::new((session, sources))))
    }

    /// What is analysed.
    pub fn given(&self) -> Given<'_> {
        match self {
            File::Session(read) => Given::Session(&read.0),
            File::Model(model, _) => Given::Model(model),
        }
    }
}
