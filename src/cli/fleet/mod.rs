//! `abbe fleet`: many sessions, machines over time, and studies.

mod history;
mod run;
mod study;

use abbe::fleet::INTERRUPTED;
use abbe::fleet::pool::{self, Pooled, ShouldContinue};
use abbe::fleet::store::IfClaimed;
use abbe::model::Diagnostic;
use clap::{Args, Subcommand};

use super::Global;
use super::failure::stopped;
use super::interrupt::Interrupts;
use super::message::progress_bar;

/// Examples of `abbe fleet`.
pub const HELP: &str = "Examples:
  abbe fleet run sessions/hermle-c600u/measured/session.toml --out results --no-trace
  abbe fleet history results
  abbe fleet study studies/small.toml --out study";

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
    /// Simulate many sessions: power, false claims, ranking of set-ups.
    #[command(after_help = study::HELP)]
    Study(study::StudyArguments),
}

/// Runs a command of `abbe fleet`, with one thread if no number is stated.
pub fn run(arguments: &FleetArguments, global: Global) -> Result<(), Diagnostic> {
    let threads = global.threads.unwrap_or(1);
    match &arguments.command {
        Fleet::Run(arguments) => run::run(arguments, threads),
        Fleet::History(arguments) => history::run(arguments),
        Fleet::Study(arguments) => study::run(arguments, threads),
    }
}

/// Does all units, which a bar counts: the results, and what ended the work before. The words are what the units are, and
/// how many.
fn all<U: Sync, T: Send>(
    units: &[U],
    (things, count): (&str, String),
    (threads, quiet): (u32, bool),
    unit: impl Fn(&U, IfClaimed, ShouldContinue<'_>) -> Result<Option<T>, Diagnostic> + Sync,
) -> (Vec<T>, Result<(), Diagnostic>) {
    let (bar, interrupts) = (progress_bar(units.len(), things, quiet), Interrupts::noticed());
    let Pooled { done, ended } = pool::all(units, threads as usize, &|| !interrupts.came(), unit, &|| bar.inc(1));
    bar.finish_and_clear();
    let ended = match ended {
        None => Ok(()),
        Some(error) if error.code == INTERRUPTED => {
            let message = format!("interrupted: {} of {count} done; the same command continues", done.len());
            Err(stopped(message))
        }
        Some(error) => Err(error),
    };
    (done, ended)
}
