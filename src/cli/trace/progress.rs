//! A trace with its progress on standard error, and the list of its candidates.

use std::sync::Mutex;
use std::time::Duration;

use abbe::analysis::{Analysis, Given, Progress, SearchOptions};
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use abbe::model::words::counted;
use abbe::trace::candidates::library;
use abbe::trace::{self, TraceOptions, TraceOutcome};
use indicatif::{ProgressBar, ProgressStyle};

use super::clock::Folds;
use crate::cli::failure::stopped;
use crate::cli::interrupt::Interrupts;
use crate::cli::message::{Kind, tell};

/// Traces a session and compares tests that separate its effects from their aliases, until they are done, the time is up
/// or the user interrupts.
///
/// # Errors
/// If the session cannot be fitted, or its estimates mean nothing and the options do not accept it.
pub fn trace(session: &Session, options: &SearchOptions, seed: u64, quiet: bool) -> Result<TraceOutcome, Diagnostic> {
    let folds = Folds::started();
    let bar = progress_bar(quiet);
    let interrupts = Interrupts::handled(bar.clone());
    let shown = Mutex::new(());
    let listener = |progress: Progress| {
        let Some(words) = progress.words() else {
            // Called often and from many threads; it shows nothing.
            interrupts.keep_results();
            return !interrupts.came();
        };
        let _one_at_a_time = shown.lock();
        match &progress {
            Progress::Folds(ended, all) => bar.set_message(folds.remaining(*ended, *all)),
            Progress::SelectedEffect(_, id, rms, unit) if !quiet => {
                bar.suspend(|| eprintln!("  + {id:<28} held out {}", unit.text(*rms, 3)));
                bar.set_message(words);
            }
            _ => bar.set_message(words),
        }
        !interrupts.came()
    };
    let trace = TraceOutcome::run(&[Given::Session(session)], options, seed, &listener);
    interrupts.end_at_once();
    bar.finish_and_clear();
    trace
}

/// Says that the model of a trace that ended early is not saved.
///
/// # Errors
/// If the user interrupted it.
pub fn ended_early(trace: &TraceOutcome, model: bool) -> Result<(), Diagnostic> {
    if model {
        tell(Kind::Warning, "no model is saved: effects may be missing from it");
    }
    match trace.result.time_limit_s {
        Some(_) => Ok(()),
        None => Err(stopped(trace.result.interruption())),
    }
}

fn progress_bar(quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// Lists the candidates of the library with their detectability.
pub fn list(session: &Session, options: &TraceOptions) -> Result<(), Diagnostic> {
    let families = library::families()?;
    let entries = trace::screening::screened_effects(session, options)?;
    for (number, family) in families.iter().enumerate() {
        let of_family: Vec<_> = entries.iter().filter(|entry| entry.family == number).collect();
        let seen = of_family.iter().filter(|entry| entry.observable).count();
        let candidates = counted(of_family.len(), "candidate");
        say!("{}: {candidates}, {seen} detectable", family.name);
        for entry in of_family {
            say!("  {} {}", if entry.observable { "detectable    " } else { "not detectable" }, entry.id);
        }
    }
    Ok(())
}
