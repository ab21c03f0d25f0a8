//! The command line: arguments, progress, tables, files. It calls the library and contains no mathematics.

/// Writes a line of the result to standard output. A closed pipe ends the program without a message.
macro_rules! say {
    ($($text:tt)*) => { $crate::cli::output::line(format_args!($($text)*)) };
}

mod analysis;
mod certificate;
mod compare;
mod compensate;
mod completions;
mod equation;
mod export;
mod failure;
mod fit;
mod fleet;
mod folder;
mod import;
mod interrupt;
mod message;
mod nc;
mod new;
mod next_session;
mod output;
mod overview;
mod paper;
mod plan;
mod poses;
mod results;
mod schema;
mod sheet;
mod simulate;
mod trace;
mod values;
mod volumetric;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use abbe::analysis::{Analysis, stated};
use abbe::files::{self, ReadOptions, SourceMap};
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use clap::{ArgMatches, Args, FromArgMatches, Subcommand};
use serde_json::Map;

use crate::report::commands::Commands;
use failure::command_line;
use output::Outputs;
use results::OutputArguments;

/// The options of all commands.
#[derive(Args, Clone, Copy)]
pub struct Global {
    /// Suppress tables and progress output; warnings and errors stay.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Number of threads; by default all processors, but one for `fleet run`.
    #[arg(long, global = true, value_name = "N", value_parser = values::threads())]
    threads: Option<u32>,
}

/// The parser of the command line.
fn parser() -> clap::Command {
    let parser = Global::augment_args(clap::Command::new("abbe"))
        .about("Geometric errors of machine tools, robots and other serial chains")
        .version(env!("CARGO_PKG_VERSION"))
        .max_term_width(110)
        .help_template(overview::template())
        .after_help(overview::EXAMPLES)
        .subcommand_required(true)
        .arg_required_else_help(true);
    analysis::added(Command::augment_subcommands(parser))
}

/// The commands: a line for each, with what it does. Its file has its arguments, its examples and what runs it.
macro_rules! commands {
    ($($name:ident: $module:ident::$arguments:ident = $about:literal;)*) => {
        #[derive(Subcommand)]
        enum Command {
            $(#[doc = $about] #[command(after_help = $module::HELP)] $name(Box<$module::$arguments>),)*
        }

        impl Command {
            /// Runs the command.
            fn run(self, global: Global) -> Result<(), Diagnostic> {
                match self { $(Command::$name(arguments) => $module::run(&arguments, global),)* }
            }
        }
    };
}

commands! {
    Equation: equation::EquationArguments = "Print the closed-form equation of a test.";
    Volumetric: volumetric::VolumetricArguments = "Print or map the volumetric error, and compensate it.";
    Compare: compare::CompareArguments = "State what differs between sessions or models of one machine.";
    Compensate: compensate::CompensateArguments = "Correct commanded positions or poses with a model.";
    Export: export::ExportArguments = "Export the calibrated machine for controls and other programs.";
    Nc: nc::NcArguments = "Write the NC programs of planned tests.";
    Fit: fit::FitArguments = "Estimate errors from readings, with uncertainties.";
    Paper: paper::PaperArguments = "Write text, tables and figures for LaTeX and Typst.";
    Plan: plan::PlanArguments = "State what planned tests identify, how surely, and what improves.";
    New: new::NewArguments = "Create a machine and a session.";
    Completions: completions::CompletionArguments = "Write the completions of a shell.";
    Fleet: fleet::FleetArguments = "Analyse many sessions and show machines over time.";
    Import: import::ImportArguments = "Turn foreign files of readings into a session.";
    Schema: schema::SchemaArguments = "Print the JSON Schema of a file or a result.";
    Sheet: sheet::SheetArguments = "Write set-up sheets of planned tests.";
    Simulate: simulate::SimulateArguments = "Simulate readings of planned tests with given errors.";
    Poses: poses::PoseArguments = "Choose the poses of a robot or a probe that determine its errors best.";
    Trace: trace::TraceArguments = "Find the unmodelled effect behind the residual.";
}

/// Arguments of every command that reads a session.
#[derive(Args, Clone)]
pub struct SessionArguments {
    /// The session file.
    session: PathBuf,
    #[command(flatten)]
    data: DataArguments,
}

/// Where the data files of sessions are.
#[derive(Args, Clone)]
pub struct DataArguments {
    /// Folder of the data files, if they do not lie beside the session file.
    ///
    /// Example: --data measurements
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Allow a session to read files outside its own folder. The folder of --data is always allowed.
    #[arg(long)]
    allow_outside: bool,
}

impl DataArguments {
    /// Options of the reader.
    fn options(&self) -> ReadOptions {
        ReadOptions { data_directory: self.data.clone(), allow_outside: self.allow_outside, ..ReadOptions::default() }
    }

    /// How command lines name a session that is read with these options.
    fn commands(&self, session: &Path) -> Commands {
        Commands::of(session, self.data.as_deref(), self.allow_outside)
    }
}

impl SessionArguments {
    /// Options of the reader.
    fn options(&self) -> ReadOptions {
        self.data.options()
    }

    /// Reads the planned motions of a session; its data only if a test states its positions there alone, and `needs` them.
    fn read_planned(&self, needs: impl Fn(&Session) -> bool) -> Result<(Session, SourceMap), Diagnostic> {
        let source = files::text(&self.session, "the session file")?;
        let (session, sources) = files::session_of(&source, &ReadOptions { read_data: false, ..self.options() })?;
        if needs(&session) && session.tests.iter().any(|test| test.motion.is_none()) {
            return files::session_of(&source, &self.options());
        }
        Ok((session, sources))
    }

    /// How command lines name the session after an analysis with these options, on which its result depends.
    fn commands<A: Analysis>(&self, seed: u64, options: &A::Options) -> Result<Commands, Diagnostic> {
        let mut repeated = Map::new();
        if seed != 1 {
            repeated.insert("seed".to_string(), seed.into());
        }
        repeated.extend(stated(options).map_err(|cause| Diagnostic::other(cause.to_string()))?);
        // The next search may take its time.
        repeated.shift_remove("time_limit");
        Ok(self.data.commands(&self.session).made_by(A::NAME, &repeated))
    }
}

/// `--force`: an option of every command that writes a folder. Files that options name are always replaced.
#[derive(Args, Clone, Copy)]
pub struct ForceArguments {
    /// Replace files in an existing folder.
    #[arg(long)]
    pub force: bool,
}

/// Arguments of every command with a result that depends on a seed.
#[derive(Args, Clone)]
pub struct CommonArguments {
    #[command(flatten)]
    output: OutputArguments,
    /// Seed of the random numbers: folds, null distribution, simulated noise, Monte Carlo.
    ///
    /// Example: --seed 7
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// Runs the command line and returns the exit status.
pub fn run() -> ExitCode {
    interrupt::watch();
    let parsed = parser().try_get_matches().and_then(|matches| Ok((Global::from_arg_matches(&matches)?, matches)));
    let (global, matches) = match parsed {
        Ok(parsed) => parsed,
        // Help and version, to standard output.
        Err(shown) if !shown.use_stderr() => {
            output::help(&shown);
            return ExitCode::SUCCESS;
        }
        Err(wrong) => {
            message::print_usage(wrong);
            return ExitCode::from(2);
        }
    };
    match with_threads(global.threads).and_then(|()| execute(&matches, global)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) if interrupt::is_ended() => ExitCode::from(interrupt::status()),
        Err(failure) => {
            failure::show(&failure);
            ExitCode::from(failure::status(&failure))
        }
    }
}

/// Makes the threads of the process, if their number is stated.
fn with_threads(threads: Option<u32>) -> Result<(), Diagnostic> {
    let Some(threads) = threads else { return Ok(()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads as usize).build_global();
    pool.map_err(|cause| Diagnostic::other(format!("{threads} threads cannot be started: {cause}; state fewer")))
}

/// Runs what a command line states.
fn execute(matches: &ArgMatches, global: Global) -> Result<(), Diagnostic> {
    if let Some((name, own)) = matches.subcommand()
        && let Some((line, command)) = analysis::commands().find(|(line, _)| line.name == name)
    {
        return analysis::run(line, command, own);
    }
    Command::from_arg_matches(matches).map_err(|wrong| command_line(wrong.to_string()))?.run(global)
}

/// Runs another command line as a part of a command.
fn again(arguments: &[&str], quiet: bool) -> Result<(), Diagnostic> {
    let words = std::iter::once("abbe").chain(arguments.iter().copied());
    let matches = parser().try_get_matches_from(words).map_err(|wrong| command_line(wrong.to_string()))?;
    execute(&matches, Global { quiet, threads: None })
}

/// Reads the session, with its sources. No output may replace one of its files.
fn read_session(arguments: &SessionArguments, outputs: &Outputs) -> Result<(Session, SourceMap), Diagnostic> {
    let (session, sources) = files::session_with_sources(&arguments.session, &arguments.options())?;
    outputs.refuse_overwrite_of_sources(&sources)?;
    Ok((session, sources))
}

#[cfg(test)]
mod tests;
