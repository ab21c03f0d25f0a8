//! `abbe fleet run`: analyse many sessions, and keep what is done.

use std::path::{Path, PathBuf};

use abbe::analysis::Candidates;
use abbe::fleet::options::Options;
use abbe::fleet::run::{self, RunResult};
use abbe::fleet::store::Store;
use abbe::fleet::unit::{self, Places};
use abbe::fleet::{INTERRUPTED, ShouldContinue, list};
use abbe::model::Diagnostic;
use abbe::model::words::counted;
use clap::Args;

use crate::cli::failure::stopped;
use crate::cli::interrupt::Interrupts;
use crate::cli::message::progress_bar;
use crate::cli::results::{OutputArguments, Read};
use crate::report;

/// Examples of `abbe fleet run`.
pub const HELP: &str = include_str!("../help/run.txt");

/// `abbe fleet run SESSION… --out DIR`
#[derive(Args)]
pub struct RunArguments {
    /// Session files, or folders in which every session.toml is found.
    #[arg(value_name = "SESSION", required_unless_present = "listed")]
    sessions: Vec<PathBuf>,
    /// File with one session file or folder in each line; `-` is standard input.
    ///
    /// Example: --sessions sessions.txt
    #[arg(long = "sessions", value_name = "FILE")]
    listed: Option<PathBuf>,
    /// Analyse part K of N of the sessions, for an array of jobs: every Nth session from the Kth on.
    ///
    /// Example: --part 3/100
    #[arg(long, value_name = "K/N", value_parser = part)]
    part: Option<(usize, usize)>,
    /// Where the result is written: a folder, new or that of an earlier run.
    ///
    /// Example: --out results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Fit alone, without the search for effects.
    #[arg(long)]
    no_trace: bool,
    #[command(flatten)]
    search: Candidates,
    /// Folder of saved models to validate: MACHINE.json is the model of the machine with this identifier.
    ///
    /// Example: --models models
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// Allow a session to read files outside its own folder.
    #[arg(long)]
    allow_outside: bool,
    #[command(flatten)]
    output: OutputArguments,
}

/// Reads `3/100`.
fn part(text: &str) -> Result<(usize, usize), String> {
    let numbers = text.split_once('/').and_then(|(part, parts)| Some((part.parse().ok()?, parts.parse().ok()?)));
    match numbers {
        Some((part, parts)) if (1..=parts).contains(&part) => Ok((part, parts)),
        _ => Err("expected a part and the number of parts, for example 3/100".to_string()),
    }
}

/// Runs `abbe fleet run`.
pub fn run(arguments: &RunArguments, threads: u32) -> Result<(), Diagnostic> {
    let outputs = arguments.output.prepared(&[])?;
    let (paths, files) = list::chosen(&arguments.sessions, arguments.listed.as_deref(), arguments.part)?;
    if let Some(models) = arguments.models.as_ref().filter(|models| !models.is_dir()) {
        let message = format!("{}: this is no folder; name the folder of the saved models", models.display());
        return Err(Diagnostic::other(message));
    }
    let store = Store::open(&arguments.out)?;
    store.remove_stale();
    let forgotten = store.forget_missing(&paths)?;
    let options = Options {
        no_trace: arguments.no_trace,
        max_effects: arguments.search.max_effects,
        only: arguments.search.only.clone(),
        exclude: arguments.search.exclude.clone(),
    };
    let places = Places { models: arguments.models.clone(), allow_outside: arguments.allow_outside };
    let (bar, interrupts) = (progress_bar(files.len(), "sessions", arguments.output.quiet), Interrupts::noticed());
    let unit = |file: &Path, if_claimed, should_continue: ShouldContinue<'_>| {
        unit::run(file, &options, &places, &store, if_claimed, should_continue)
    };
    let (done, ended) = run::all(&files, threads as usize, &|| !interrupts.came(), unit, &|| bar.inc(1));
    bar.finish_and_clear();
    let result = RunResult::of(&arguments.out, files.len(), &done, forgotten);
    arguments.output.put(&outputs, &report::run::report(&result), &result, &Read::default())?;
    match ended {
        None => Ok(()),
        Some(error) if error.code == INTERRUPTED => {
            let count = counted(files.len(), "session");
            Err(stopped(format!("interrupted: {} of {count} done; the same command continues", done.len())))
        }
        Some(error) => Err(error),
    }
}
