//! Arguments, progress, tables: what stands between a user and the library. No mathematics.

/// Writes a line of the result to standard output. A reader that has seen enough (a closed pipe) ends the program, quietly.
macro_rules! say {
    ($($text:tt)*) => { $crate::cli::output::line(format_args!($($text)*)) };
}

pub mod circular;
mod compensation;
mod csv;
mod directions;
mod equation;
mod failure;
mod fit;
mod folder;
mod from_code;
pub mod geometric;
mod interrupt;
mod map;
mod message;
mod new;
pub mod output;
pub mod plan;
mod plausibility;
mod repeated;
mod report;
mod schema;
mod self_calibration;
mod simulate;
pub mod table;
pub mod trace;
pub mod uniqueness;

use std::path::PathBuf;
use std::process::ExitCode;

use abbe::model::files::{self, ReadOptions, SourceMap};
use abbe::model::session::Session;
use clap::{Args, CommandFactory, Parser, Subcommand};

use failure::Failure;
use output::Outputs;

/// Geometric errors of machine tools and other serial chains: what tests can see, how large errors are, and what a model still lacks.
#[derive(Parser)]
#[command(name = "abbe", version, max_term_width = 110, after_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Print no tables and no progress; warnings and errors stay.
    #[arg(short, long, global = true)]
    quiet: bool,
}

const EXAMPLES: &str = "Example, from nothing to a found effect:
  abbe new my --template hermle-c600u
  abbe plan my/chapter5.toml
  abbe simulate my/chapter5.toml --out my/run1 --error EY0A=35.3um --error EB0A=-1.29arcsec
  abbe fit my/run1/session.toml --json my/fit.json
  abbe trace my/run1/session.toml --only EZC --only EAC
  abbe equation my/chapter5.toml --test C150 --order first

`abbe new` lists the templates; `abbe new mine --from-code \"[wCAbYXZt]\"` lays out a machine of your own. `abbe COMMAND --help` has examples of each.

Output:
  Results go to standard output; progress, warnings and errors go to standard error. A FILE of
  `-` is standard output: `--json -` writes JSON there and nothing else. `--quiet` suppresses
  tables and progress, not warnings.

Exit status:
  0    done, whatever the verdict
  1    the input cannot be used; the message names the file, the line and what to do
  2    the command line is wrong
  130  interrupted (Ctrl-C)";

const COMPLETIONS: &str = "Example:
  abbe completions bash

Put what it prints where the shell looks for it: ~/.local/share/bash-completion/completions/abbe (bash), a folder of $fpath as _abbe (zsh),
~/.config/fish/completions/abbe.fish (fish).";

#[derive(Subcommand)]
enum Command {
    /// Print the closed form of a test's reading.
    #[command(
        after_help = "Example:\n  abbe equation sessions/hermle-c600u/chapter5.toml --test A150 --as latex"
    )]
    Equation(equation::EquationArguments),
    /// Print the error vector of the tool in the workpiece frame, or map it over the workspace.
    #[command(
        after_help = "Examples:\n  abbe volumetric sessions/hermle-c600u/machine.toml --order first --errors EX0C,EY0C,EXX\n  \
                      abbe volumetric sessions/volumetric/machine.toml --map map.csv \\\n      --functions sessions/volumetric/errors.toml --compensate"
    )]
    Volumetric(equation::VolumetricArguments),
    /// Identify errors from readings, with uncertainties.
    #[command(after_help = fit::HELP)]
    Fit(fit::FitArguments),
    /// What can these tests see, before anybody measures?
    #[command(after_help = plan::EXAMPLES)]
    Plan(Box<plan::PlanArguments>),
    /// Start from a ready session.
    #[command(after_help = new::HELP)]
    New(new::NewArguments),
    /// Write a script that completes the command line in a shell.
    #[command(after_help = COMPLETIONS)]
    Completions {
        /// For which shell.
        shell: clap_complete::Shell,
    },
    /// Describe a file or a result as JSON Schema.
    #[command(after_help = schema::HELP)]
    Schema(schema::SchemaArguments),
    /// Simulate readings from a plan with given errors.
    #[command(after_help = simulate::HELP)]
    Simulate(Box<simulate::SimulateArguments>),
    /// Find the unmodelled effect behind the residual.
    #[command(
        after_help = "Example:\n  abbe trace sessions/hermle-c600u/measured/session.toml --json trace.json --csv trace.csv"
    )]
    Trace(trace::TraceArguments),
}

/// What every command that reads a session takes.
#[derive(Args, Clone)]
pub struct SessionArguments {
    /// The session file.
    session: PathBuf,
    /// Where the data files lie when they do not lie beside the session file.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Let the session read files that lie neither beside or below it nor where `--data` points.
    #[arg(long)]
    allow_outside: bool,
}

impl SessionArguments {
    /// How the session is to be read.
    fn options(&self) -> ReadOptions {
        ReadOptions {
            data_directory: self.data.clone(),
            read_data: true,
            allow_outside: self.allow_outside,
        }
    }
}

/// What every command takes.
#[derive(Args, Clone)]
pub struct CommonArguments {
    /// Write the result as JSON; `-` writes it, and nothing else, to standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print no tables and no progress; warnings and errors stay.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Seed of everything that is drawn: folds, null draws, simulated noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

impl CommonArguments {
    /// The JSON and the other files that were asked for. Refuses before the work what could not be written after it.
    fn outputs(&self, others: &[Option<&PathBuf>]) -> Result<Outputs, Failure> {
        Outputs::new(others.iter().copied().flatten().chain(&self.json))
    }
}

/// Runs the command line; the exit status.
pub fn run() -> ExitCode {
    let Arguments { command, quiet } = Arguments::parse();
    let outcome = match command {
        Command::Equation(arguments) => equation::run(&arguments),
        Command::Volumetric(arguments) => equation::run_volumetric(&arguments, quiet),
        Command::Fit(arguments) => fit::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::New(arguments) => new::run(&arguments, quiet),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "abbe", &mut script);
            say!("{}", String::from_utf8_lossy(&script).trim_end());
            Ok(())
        }
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Trace(arguments) => trace::run(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.show();
            ExitCode::from(failure.status())
        }
    }
}

/// Reads the session that the arguments name, with its sources, which no output may replace.
fn read_session(arguments: &SessionArguments, outputs: &Outputs) -> Result<(Session, SourceMap), Failure> {
    let (session, sources) = files::session_with_sources(&arguments.session, &arguments.options())?;
    outputs.refuse_overwrite_of_sources(&sources)?;
    Ok((session, sources))
}
