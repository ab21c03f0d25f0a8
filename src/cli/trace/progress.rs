//! A trace with its progress on standard error, and the list of its candidates.

use std::sync::Mutex;
use std::time::Duration;

use abbe::model::session::Session;
use abbe::model::words::counted;
use abbe::plan::separating_tests::separate_aliases;
use abbe::plan::test_variations::TestVariations;
use abbe::trace::candidates::library;
use abbe::trace::{self, Progress, TraceOptions, TraceOutcome};
use indicatif::{ProgressBar, ProgressStyle};

use super::clock::Clock;
use crate::cli::PlausibilityArguments;
use crate::cli::failure::Failure;
use crate::cli::interrupt::Interrupts;
use crate::cli::message::{Kind, tell};

/// Traces a session and compares tests that separate its effects from their aliases, until they are done, the time is up
/// or the user interrupts.
///
/// # Errors
/// If the session cannot be fitted, or its estimates mean nothing and `plausibility` does not accept it.
pub fn trace(
    session: &Session,
    options: &TraceOptions,
    plausibility: PlausibilityArguments,
    (time_limit, quiet): (Option<f64>, bool),
) -> Result<TraceOutcome, Failure> {
    let clock = Clock::started(time_limit);
    let bar = progress_bar(quiet);
    let interrupts = Interrupts::handled(bar.clone());
    let shown = Mutex::new(());
    let refused: Mutex<Option<Failure>> = Mutex::new(None);
    let report = |progress: Progress| {
        if let Progress::Contradicted(found) = &progress
            && let Err(failure) = plausibility.check(found)
            && let Ok(mut refused) = refused.lock()
        {
            *refused = Some(failure);
            return false;
        }
        let Some(words) = progress.words() else {
            // Called often and from many threads; it shows nothing.
            interrupts.keep_results();
            return !interrupts.came() && !clock.has_run_out();
        };
        let _one_at_a_time = shown.lock();
        match &progress {
            Progress::Folds(ended, folds) => bar.set_message(clock.remaining(*ended, *folds)),
            Progress::SelectedEffect(_, id, rms, unit) if !quiet => {
                bar.suspend(|| eprintln!("  + {id:<28} held out {}", unit.text(*rms, 3)));
                bar.set_message(words);
            }
            _ => bar.set_message(words),
        }
        !interrupts.came() && !clock.has_run_out()
    };
    let mut trace = trace::trace(session, options, &report)?;
    if let Some(failure) = refused.lock().ok().and_then(|mut refused| refused.take()) {
        bar.finish_and_clear();
        return Err(failure);
    }
    bar.set_message("comparing candidate tests");
    separate_aliases(&mut trace, &TestVariations::short(), &report)?;
    interrupts.end_at_once();
    bar.finish_and_clear();
    if let Some(seconds) = time_limit.filter(|_| !interrupts.came()) {
        trace.result.mark_time_limit(seconds);
    }
    Ok(trace)
}

/// Says that the model of a trace that ended early is not saved.
///
/// # Errors
/// If the user interrupted it.
pub fn ended_early(trace: &TraceOutcome, model: bool) -> Result<(), Failure> {
    if model {
        tell(Kind::Warning, "no model is saved: effects may be missing from it");
    }
    match trace.result.time_limit_s {
        Some(_) => Ok(()),
        None => Err(Failure::Interrupted(trace.result.interruption())),
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
pub fn list(session: &Session, options: &TraceOptions) -> Result<(), Failure> {
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
