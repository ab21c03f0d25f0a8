//! `abbe fleet`: many sessions, and machines over time.

mod history;
mod run;

use abbe::model::Diagnostic;
use clap::{Args, Subcommand};

use super::Global;

/// Examples of `abbe fleet`.
pub const HELP: &str = "Examples:
  abbe fleet run sessions/hermle-c600u/measured/session.toml --out results --no-trace
  abbe fleet history results";

/// `abbe fleet COMMAND`
#[derive(Args)]
pub struct FleetArguments {
    #[command(subcommand)]
    command: Fleet,
}

/// The commands of `abbe fleet`.
#[derive(Subcommand)]
enum Fleet {
    /// Analyse many sessions; a second run computes what has changed.
    #[command(after_help = run::HELP)]
    Run(run::RunArguments),
    /// Show machines over time: drifts, steps, the next check.
    #[command(after_help = history::HELP)]
    History(history::HistoryArguments),
}

/// Runs a command of `abbe fleet`, with one thread if no number is stated.
pub fn run(arguments: &FleetArguments, global: Global) -> Result<(), Diagnostic> {
    match &arguments.command {
        Fleet::Run(arguments) => run::run(arguments, global.threads.unwrap_or(1)),
        Fleet::History(arguments) => history::run(arguments),
    }
}
