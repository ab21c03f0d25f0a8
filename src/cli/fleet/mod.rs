//! `abbe fleet`: many sessions, machines over time, and studies.

mod history;
mod run;
mod study;

use clap::Subcommand;

use super::failure::Failure;

/// Examples of `abbe fleet`.
pub const HELP: &str = "Examples:
  abbe fleet run sessions/hermle-c600u/measured/session.toml --out results --no-trace
  abbe fleet history results
  abbe fleet study studies/small.toml --out study";

/// The commands of `abbe fleet`.
#[derive(Subcommand)]
pub enum Fleet {
    /// Analyse many sessions; a second run computes what has changed.
    #[command(after_help = run::HELP)]
    Run(run::RunArguments),
    /// Show machines over time: drifts, steps, the next check.
    #[command(after_help = history::HELP)]
    History(history::HistoryArguments),
    /// Simulate many sessions: power, false claims, ranking of set-ups.
    #[command(after_help = study::HELP)]
    Study(study::StudyArguments),
}

/// Runs a command of `abbe fleet`, with one thread if no number is stated.
pub fn run(command: &Fleet, threads: Option<u32>) -> Result<(), Failure> {
    let threads = threads.unwrap_or(1);
    match command {
        Fleet::Run(arguments) => run::run(arguments, threads),
        Fleet::History(arguments) => history::run(arguments),
        Fleet::Study(arguments) => study::run(arguments, threads),
    }
}
