//! `abbe run`: analyse many sessions, and keep what is done.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use abbe::fleet::options::Options;
use abbe::fleet::store::{IfClaimed, Pointer, Store};
use abbe::fleet::unit::{self, Done, Places};
use abbe::fleet::{FleetError, list};
use abbe::model::words::counted;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::failure::Failure;
use super::interrupt::Interrupts;
use super::json::{self, Origin};
use super::message::{Kind, tell};
use super::output::{self, Outputs};
use super::search::SearchArguments;
use crate::report::table::{Table, cells};

/// Examples of `abbe run`.
pub const HELP: &str = "Each session is fitted and traced; with --models the model of its machine is validated. The \
result is a file of --out whose name is the SHA-256 of all inputs and options: a second run computes only what is \
missing or changed. A session that cannot be analysed is a result with its error. Sessions of earlier runs whose files \
are no longer in a named folder leave history and data set; their results stay. Seeds follow from the inputs, so that \
results do not depend on the order, the process or the computer.

Identifiers are notes of [about] in session.toml: `serial_number` of the machine, `session_id`, `date`.

Examples:
  abbe run sessions/hermle-c600u/measured/session.toml --out results --no-trace
  abbe run sessions/hermle-c600u sessions/r-test --out results --no-trace --threads 2
  abbe run sessions/hermle-c600u sessions/r-test --out results --no-trace --part 1/2

`abbe history results` shows the machines over time. In Python, `abbe.fleet.run` spreads the same work over processes \
and computers.";

/// Largest number of threads.
pub const MAX_THREADS: usize = 1024;
/// Failed sessions that the tables list.
const MAX_ROWS: usize = 10;

/// `abbe run SESSION… --out DIR`
#[derive(Args)]
pub struct RunArguments {
    /// Session files, or folders in which every session.toml is found.
    #[arg(value_name = "SESSION", required_unless_present = "list")]
    sessions: Vec<PathBuf>,
    /// File with one session file or folder in each line; `-` is standard input.
    ///
    /// Example: --list sessions.txt
    #[arg(long, value_name = "FILE")]
    list: Option<PathBuf>,
    /// Analyse part K of N of the sessions, for an array of jobs: every Nth session from the Kth on.
    ///
    /// Example: --part 3/100
    #[arg(long, value_name = "K/N", value_parser = part)]
    part: Option<(usize, usize)>,
    /// Folder of the results; new, or that of an earlier run.
    ///
    /// Example: --out results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Fit alone, without the search for effects.
    #[arg(long)]
    no_trace: bool,
    #[command(flatten)]
    search: SearchArguments,
    /// Folder of saved models to validate: MACHINE.json is the model of the machine with this identifier.
    ///
    /// Example: --models models
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// Allow sessions to read files outside their own folders.
    #[arg(long)]
    allow_outside: bool,
    /// Number of threads for all sessions together.
    ///
    /// Example: --threads 4
    #[arg(long, value_name = "N", default_value_t = 1)]
    threads: usize,
    /// Write the summary of the run as JSON; `-` writes it, and nothing else, to standard output.
    ///
    /// Example: --json run.json
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Reads `3/100`.
fn part(text: &str) -> Result<(usize, usize), String> {
    let numbers = text.split_once('/').and_then(|(part, parts)| Some((part.parse().ok()?, parts.parse().ok()?)));
    match numbers {
        Some((part, parts)) if (1..=parts).contains(&part) => Ok((part, parts)),
        _ => Err("expected a part and the number of parts, for example 3/100".to_string()),
    }
}

/// What a run did.
#[derive(Serialize, JsonSchema)]
pub struct RunResult {
    /// Folder of the results.
    out: String,
    /// Number of sessions.
    sessions: usize,
    /// Sessions that were analysed.
    computed: usize,
    /// Sessions whose result was there.
    kept: usize,
    /// Sessions without a result, with the reason.
    failed: Vec<FailedSession>,
    /// Identifiers that several sessions of different content have.
    shared_ids: Vec<SharedId>,
    /// Session files of earlier runs that are no longer there: they have left history and data set.
    forgotten: Vec<String>,
}

/// A session without a result.
#[derive(Serialize, JsonSchema)]
struct FailedSession {
    /// The session file.
    file: String,
    /// What was found and what was expected.
    message: String,
}

/// An identifier of several sessions.
#[derive(Serialize, JsonSchema)]
struct SharedId {
    /// The identifier.
    session_id: String,
    /// The session files.
    files: Vec<String>,
}

/// Runs `abbe run`.
pub fn run(arguments: &RunArguments, quiet: bool) -> Result<(), Failure> {
    if !(1..=MAX_THREADS).contains(&arguments.threads) {
        return Err(Failure::CommandLine(format!(
            "`--threads {}`: a number of threads from 1 to {MAX_THREADS} is expected",
            arguments.threads
        )));
    }
    let outputs = Outputs::new(&arguments.json)?;
    // A file of a list may be gone since the list was made: it is a result with its error. A path that is typed is a
    // mistake.
    if let Some(path) = arguments.sessions.iter().find(|path| matches!(path.try_exists(), Ok(false))) {
        let message = format!("{}: neither a session file nor a folder is there; correct the path", path.display());
        return Err(Failure::Other(message));
    }
    let mut paths = arguments.sessions.clone();
    if let Some(file) = &arguments.list {
        paths.extend(list::listed(file)?);
    }
    let mut files = list::sessions(&paths)?;
    if let Some((part, parts)) = arguments.part {
        files = files.into_iter().skip(part - 1).step_by(parts).collect();
    }
    if files.is_empty() && arguments.part.is_none() {
        return Err(Failure::Other("no session is named; name session files or folders".into()));
    }
    if let Some(models) = arguments.models.as_ref().filter(|models| !models.is_dir()) {
        let message = format!("{}: this is no folder; name the folder of the saved models", models.display());
        return Err(Failure::Other(message));
    }
    let store = Store::open(&arguments.out)?;
    store.remove_stale();
    let forgotten = store.forget_missing(&paths)?;
    let bar = progress_bar(files.len(), quiet);
    let outcomes = analyse(arguments, &files, &store, &bar);
    bar.finish_and_clear();
    let Outcomes { done, ended } = outcomes;
    let result = RunResult { forgotten, ..summary(&arguments.out, files.len(), &done) };
    if outputs.tables(quiet) {
        print(&result);
    }
    for shared in &result.shared_ids {
        let message = format!(
            "sessions of different content have the identifier `{}`: {}; results of all are kept",
            shared.session_id,
            shared.files.join(", ")
        );
        tell(Kind::Warning, &message);
    }
    if let Some(path) = &arguments.json {
        json::write(path, Origin::default(), None, &result)?;
    }
    match ended {
        None => Ok(()),
        Some(FleetError::Interrupted) => Err(Failure::Interrupted(format!(
            "interrupted: {} of {} done; the same command continues",
            done.len(),
            counted(files.len(), "session")
        ))),
        Some(error) => Err(error.into()),
    }
}

/// The sessions that were done, in the order of the files, and why the run ended early.
struct Outcomes {
    done: Vec<(Done, Pointer)>,
    ended: Option<FleetError>,
}

/// Analyses the sessions. The first error of the store ends the run: the next session would meet it too.
fn analyse(arguments: &RunArguments, files: &[PathBuf], store: &Store, bar: &ProgressBar) -> Outcomes {
    let options = Options {
        no_trace: arguments.no_trace,
        max_effects: arguments.search.max_effects,
        only: arguments.search.only.clone(),
        exclude: arguments.search.exclude.clone(),
    };
    let places = Places { models: arguments.models.clone(), allow_outside: arguments.allow_outside };
    let interrupts = Interrupts::noticed();
    let stopped = AtomicBool::new(false);
    let goes_on = || !interrupts.came() && !stopped.load(Ordering::Relaxed);
    let one = |file: &PathBuf, if_claimed: IfClaimed| {
        if !goes_on() {
            return Err(FleetError::Interrupted);
        }
        let outcome = unit::run(file, &options, &places, store, if_claimed, &goes_on);
        match outcome {
            Ok(None) => {}
            Ok(Some(_)) => bar.inc(1),
            Err(_) => stopped.store(true, Ordering::Relaxed),
        }
        outcome
    };
    let pool = match rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build() {
        Ok(pool) => pool,
        Err(cause) => {
            let ended = Some(FleetError::Request(format!("the threads cannot be started: {cause}")));
            return Outcomes { done: Vec::new(), ended };
        }
    };
    let mut outcomes: Vec<Result<Option<(Done, Pointer)>, FleetError>> =
        pool.install(|| files.par_iter().with_max_len(1).map(|file| one(file, IfClaimed::Skip)).collect());
    // Those on which other processes are at work: they are done, or the processes have ended.
    let claimed = files.iter().zip(&mut outcomes).filter(|(_, outcome)| matches!(outcome, Ok(None)));
    let claimed: Vec<_> = claimed.collect();
    pool.install(|| {
        claimed.into_par_iter().with_max_len(1).for_each(|(file, outcome)| *outcome = one(file, IfClaimed::Wait));
    });
    let (mut done, mut ended) = (Vec::with_capacity(files.len()), None);
    for outcome in outcomes {
        match outcome {
            Ok(outcome) => done.extend(outcome),
            // A fault of the store, rather than the interruption that follows from it.
            Err(error) => match &ended {
                None | Some(FleetError::Interrupted) => ended = Some(error),
                Some(_) => {}
            },
        }
    }
    Outcomes { done, ended }
}

fn summary(out: &Path, sessions: usize, done: &[(Done, Pointer)]) -> RunResult {
    let mut by_id: BTreeMap<&str, Vec<&Pointer>> = BTreeMap::new();
    for (_, pointer) in done {
        by_id.entry(&pointer.session_id).or_default().push(pointer);
    }
    let shared = by_id.into_iter().filter(|(_, pointers)| pointers.iter().any(|other| other.key != pointers[0].key));
    let failed = done
        .iter()
        .filter_map(|(_, pointer)| Some(FailedSession { file: pointer.file.clone(), message: pointer.error.clone()? }));
    let computed = done.iter().filter(|(done, _)| *done == Done::Computed).count();
    RunResult {
        out: out.display().to_string(),
        sessions,
        computed,
        kept: done.len() - computed,
        failed: failed.collect(),
        shared_ids: shared
            .map(|(id, pointers)| SharedId {
                session_id: id.to_string(),
                files: pointers.iter().map(|pointer| pointer.file.clone()).collect(),
            })
            .collect(),
        forgotten: Vec::new(),
    }
}

fn progress_bar(sessions: usize, quiet: bool) -> ProgressBar {
    let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(sessions as u64) };
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos} of {len} sessions, {eta} left") {
        bar.set_style(style);
    }
    bar
}

fn print(result: &RunResult) {
    say!(
        "{}: {}, {} analysed, {} kept, {} without a result",
        result.out,
        counted(result.sessions, "session"),
        result.computed,
        result.kept,
        result.failed.len()
    );
    if !result.forgotten.is_empty() {
        say!("  {} of earlier runs left: the file is no longer there", counted(result.forgotten.len(), "session"));
    }
    if !result.failed.is_empty() {
        let rows = result.failed.iter().take(MAX_ROWS).map(|failed| {
            let first = failed.message.lines().next().unwrap_or_default();
            cells![&failed.file, first]
        });
        output::print(&Table::new(["session", "why"], rows.collect::<Vec<_>>()));
        if result.failed.len() > MAX_ROWS {
            say!("  … {} more; --json lists them", result.failed.len() - MAX_ROWS);
        }
    }
}
