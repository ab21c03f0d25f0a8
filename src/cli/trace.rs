//! `abbe trace`: find the unmodelled effect behind the residual.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use abbe::analysis::{Analysis, Given, Progress, SearchOptions};
use abbe::codegen::nc::Control;
use abbe::files::{self, ReadOptions, SourceMap};
use abbe::model::Diagnostic;
use abbe::model::document::edit::SessionText;
use abbe::model::effect::Effect;
use abbe::model::session::Session;
use abbe::model::words::counted;
use abbe::trace::candidates::library;
use abbe::trace::{self, TraceOptions, TraceOutcome};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::failure::stopped;
use super::interrupt::Interrupts;
use super::message::{Kind, tell};
use super::next_session::{self, proposals};
use super::results::{Read, SaveArguments};

use super::{CommonArguments, Global, SessionArguments, again, folder, nc, output, read_session, values};
use crate::report::readings;

/// Examples of `abbe trace`.
pub const HELP: &str = include_str!("help/trace.txt");

/// `abbe trace SESSION`
#[derive(Args)]
pub struct TraceArguments {
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    common: CommonArguments,
    #[command(flatten)]
    save: SaveArguments,
    #[command(flatten)]
    options: SearchOptions,
    /// End the search after this many seconds. The effects found until then are fitted and reported, and every output
    /// states that the result is incomplete.
    ///
    /// Example: --time-limit 10
    #[arg(long, value_name = "S", value_parser = seconds)]
    time_limit: Option<f64>,
    /// List the choices, and stop: the candidates of the library with their detectability in this session.
    #[arg(long, conflicts_with_all = ["json", "csv", "residuals", "write", "report", "plots", "max_effects", "time_limit", "save"])]
    list: bool,
    /// Write the session with the result in it: the found effects are declared.
    ///
    /// Example: --write next.toml
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Append the tests that separate the effects from their aliases to the written session, with all positions.
    #[arg(long, requires = "write")]
    with_tests: bool,
    /// Write reading and residual of every reading as CSV: test, run, line, axis positions, reading, residual in µm,
    /// residual over the noise standard deviation, and whether the reading counts or is an outlier; of the model with the
    /// found effects.
    ///
    /// Example: --residuals residuals.csv
    #[arg(long, value_name = "FILE.csv")]
    residuals: Option<PathBuf>,
    #[command(flatten)]
    next: NextArguments,
}

/// Runs `abbe trace`.
pub fn run(arguments: &TraceArguments, _: Global) -> Result<(), Diagnostic> {
    let common = &arguments.common;
    let force = common.output.folder.force;
    arguments.next.check(force)?;
    let others = [arguments.write.as_ref(), arguments.residuals.as_ref(), arguments.save.save.as_ref()];
    let outputs = common.output.prepared(&others)?;
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    let options = SearchOptions { time_limit: arguments.time_limit, ..arguments.options.clone() };
    if arguments.list {
        return list(&session, &options.with_seed(common.seed));
    }
    let trace = trace(&session, &options, common.seed, common.output.quiet)?;
    let commands = arguments.session.commands::<TraceOutcome>(common.seed, &options)?;
    common.output.put_found(&outputs, &trace, &commands, &Read::session(&session, &sources, common.seed))?;
    if let Some(path) = &arguments.write {
        next_session::write(path, &sources, &arguments.session, |text| {
            next_session::add_trace(text, &trace, &session.machine, arguments.with_tests)
        })?;
    }
    if let Some(path) = &arguments.residuals {
        output::write_whole(path, &output::csv(&readings::residuals(&trace.after, &trace.after_fit))?)?;
    }
    if trace.result.interrupted {
        return ended_early(&trace, arguments.save.save.is_some());
    }
    arguments.next.run(&session, &sources, &trace, (common.output.quiet, force))?;
    arguments.save.run(&trace.after, &trace.after_fit, &sources, common.seed)
}

/// When the searches without one fold began.
pub struct Folds(Mutex<Instant>);

impl Folds {
    /// They begin from now on.
    pub fn started() -> Folds {
        Folds(Mutex::new(Instant::now()))
    }

    /// The stage of the searches without one fold, of which so many have ended, and the time that the others are
    /// expected to take.
    pub fn remaining(&self, ended: usize, folds: usize) -> String {
        let Ok(mut began) = self.0.lock() else { return String::new() };
        if ended <= 1 {
            *began = Instant::now();
        }
        let stage = format!("searching without one fold: {ended} of {folds}");
        let left = began.elapsed().as_secs_f64() * folds.saturating_sub(ended) as f64 / ended.saturating_sub(1) as f64;
        if left.is_finite() && left >= 1.0 { format!("{stage}, about {left:.0} s left") } else { stage }
    }
}

/// Reads a time in seconds.
pub fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse::<f64>().map_err(|_| "a number of seconds is expected, for example 10".to_string())?;
    values::SECONDS.reason(seconds).map_or(Ok(seconds), Err)
}

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
fn ended_early(trace: &TraceOutcome, model: bool) -> Result<(), Diagnostic> {
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

/// The next measurement.
#[derive(Args)]
struct NextArguments {
    /// Write what to measure next into a new folder: a session that holds only the tests that separate the found effects
    /// from their aliases, their NC programs and their set-up sheets.
    ///
    /// Example: --next next --control siemens
    #[arg(long, value_name = "DIR")]
    next: Option<PathBuf>,
    /// The control of the NC programs: they are written beside the session.
    ///
    /// Example: --next next --control fanuc
    #[arg(long, value_name = "CONTROL", value_parser = nc::controls(), requires = "next")]
    control: Option<&'static dyn Control>,
}

/// The name of the session in the folder.
const SESSION: &str = "session.toml";
/// The folder of the programs in it.
const PROGRAMS: &str = "programs";
/// The sheets in it.
const SHEETS: &str = "sheets.html";

impl NextArguments {
    /// Refuses a folder that cannot be written before the search.
    pub fn check(&self, force: bool) -> Result<(), Diagnostic> {
        self.next.as_ref().map_or(Ok(()), |folder| folder::check(folder, force).map(|_| ()))
    }

    /// Writes the folder, if it is asked for.
    pub fn run(
        &self,
        session: &Session,
        sources: &SourceMap,
        trace: &TraceOutcome,
        (quiet, force): (bool, bool),
    ) -> Result<(), Diagnostic> {
        let Some(out) = &self.next else { return Ok(()) };
        let proposed = proposals(&trace.result);
        if proposed.is_empty() {
            tell(Kind::Note, "the search proposes no further test: nothing is written");
            return Ok(());
        }
        let mut text = sources.text.clone();
        // What was measured stays where it is.
        text.remove(&["test", "socket_distance", "format", "columns", "effect"]);
        let of_all = |effect: &&Effect| effect.tests.is_empty();
        let effects: Vec<Effect> = session.effects.iter().chain(&trace.effects).filter(of_all).cloned().collect();
        text.add_effects(&effects, &session.machine)?;
        proposed.into_iter().try_for_each(|block| text.add_block(block))?;
        folder::write(out, &files_of(text, sources)?, force, |made| {
            files::session(&made.join(SESSION), &ReadOptions { read_data: false, ..ReadOptions::default() })?;
            self.documents(made)
        })?;
        if !quiet {
            let at = |name: &str| out.join(name).display().to_string();
            say!("{}: the tests to measure next", at(SESSION));
            if let Some(control) = self.control {
                say!("{}: their programs for {}", at(PROGRAMS), control.word());
            }
            say!("{}: their set-up sheets", at(SHEETS));
        }
        Ok(())
    }

    /// The programs and the sheets of the session in a folder that is not in its place yet.
    fn documents(&self, made: &Path) -> Result<(), Diagnostic> {
        let [session, programs, sheets] = [SESSION, PROGRAMS, SHEETS].map(|name| made.join(name).display().to_string());
        let control: Vec<&str> = self.control.iter().flat_map(|control| ["--control", control.word()]).collect();
        if !control.is_empty() {
            again(&[&["nc", &session, "--out", &programs], &control[..]].concat(), true)?;
        }
        again(&[&["sheet", &session, "--out", &sheets], &control[..]].concat(), true)
    }
}

/// The session with its machine and the bodies of it.
fn files_of(mut text: SessionText, sources: &SourceMap) -> Result<Vec<(String, Vec<u8>)>, Diagnostic> {
    let mut files = Vec::new();
    if let Some(machine) = &sources.machine_text {
        files.push(("machine.toml".to_string(), machine.clone().into_bytes()));
        text.set_machine_file("machine.toml");
    }
    files.extend(sources.bodies.iter().map(|body| (body.name.clone(), body.contents.to_vec())));
    files.push((SESSION.to_string(), text.to_string().into_bytes()));
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_a_positive_number() {
        assert_eq!(seconds("2.5"), Ok(2.5));
        for wrong in ["0", "-1", "nan", "inf", "1e300", "soon"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }
}
