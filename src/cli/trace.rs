//! `abbe trace`: find the unmodelled effect behind the residual.

mod clock;
mod screen;

use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

use abbe::identify::candidates::library;
use abbe::identify::plan::test_variations::TestVariations;
use abbe::identify::results::TraceResult;
use abbe::identify::separating_tests::separate_aliases;
use abbe::identify::trace::{Progress, TraceOptions};
use abbe::model::words::counted;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use clock::{Clock, seconds};

use super::failure::Failure;
use super::interrupt::Interrupts;
use super::report::ReportArguments;
use super::save::SaveArguments;
use super::search::SearchArguments;
use super::{CommonArguments, SessionArguments, compensation, message, next_session, output, read_session};
use crate::report::{readings, trace as present};

/// Examples of `abbe trace`.
pub const HELP: &str = "Examples:
  abbe trace sessions/hermle-c600u/measured/session.toml
  abbe trace sessions/hermle-c600u/measured/session.toml --all
  abbe trace sessions/hermle-c600u/measured/session.toml --json trace.json --csv trace.csv
  abbe trace sessions/hermle-c600u/measured/session.toml --report trace.html --write next.toml
  abbe trace sessions/hermle-c600u/measured/session.toml --write next.toml --with-tests
  abbe trace sessions/hermle-c600u/measured/session.toml --save model.json
  abbe trace sessions/hermle-c600u/measured/session.toml --only EZC \\
      --exclude ~time --max-effects 2
  abbe trace sessions/hermle-c600u/measured/session.toml --list

The first screen answers in this order: verdict and uniqueness; residual before and after, also on held-out readings; \
the effects with their aliases; the estimates with standard uncertainty; what to measure next. It folds aliases beyond \
three and set-up parameters. --all lists them.

An effect is component~driver:shape. EZC~C:h2 is an axial motion (EZC) over the angle of C, harmonic of order 2.";

/// `abbe trace SESSION`
#[derive(Args)]
pub struct TraceArguments {
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    common: CommonArguments,
    #[command(flatten)]
    report: ReportArguments,
    #[command(flatten)]
    save: SaveArguments,
    /// List everything that the first screen folds: all aliases, set-up parameters, null-space directions, outliers,
    /// rejected candidates.
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    search: SearchArguments,
    /// Explanation that is accepted on the user's word: a found effect, or one of its aliases, which then takes its place.
    /// Uncertainties do not cover the others; every output says so. May be repeated.
    ///
    /// Example: --assume EAC~C:h1
    #[arg(long, value_name = "EFFECT")]
    assume: Vec<String>,
    /// End the search after this many seconds. The effects found until then are fitted and reported, and every output
    /// states that the result is incomplete.
    ///
    /// Example: --time-limit 10
    #[arg(long, value_name = "S", value_parser = seconds)]
    time_limit: Option<f64>,
    /// List the candidates of the library with their detectability in this session, and stop.
    #[arg(long, conflicts_with_all = ["json", "csv", "residuals", "write", "report", "plots", "compensation", "max_effects", "time_limit", "save"])]
    list: bool,
    /// Write the session with the found effects declared.
    ///
    /// Example: --write next.toml
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Append the tests that separate the effects from their aliases to the written session, with all positions.
    #[arg(long, requires = "write")]
    with_tests: bool,
    /// Write the result as CSV, one row per value.
    ///
    /// Example: --csv trace.csv
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write reading and residual of every reading as CSV, for the model with the found effects: test, run, line, axis
    /// positions, reading, residual in µm, residual over the noise standard deviation, and whether the reading counts
    /// or is an outlier.
    ///
    /// Example: --residuals residuals.csv
    #[arg(long, value_name = "FILE.csv")]
    residuals: Option<PathBuf>,
    #[command(flatten)]
    compensation: compensation::CompensationArguments,
}

/// Runs `abbe trace`.
pub fn run(arguments: &TraceArguments) -> Result<(), Failure> {
    let clock = Clock::started(arguments.time_limit);
    arguments.report.check()?;
    arguments.compensation.check()?;
    let others =
        [arguments.csv.as_ref(), arguments.write.as_ref(), arguments.residuals.as_ref(), arguments.report.file()];
    let others = [others.as_slice(), &[arguments.save.file()]].concat();
    let outputs = arguments.common.outputs(&others)?;
    let tables = outputs.tables(arguments.common.quiet);
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    let options = TraceOptions {
        seed: arguments.common.seed,
        max_effects: arguments.search.max_effects,
        only: arguments.search.only.clone(),
        exclude: arguments.search.exclude.clone(),
        assume: arguments.assume.clone(),
        ..TraceOptions::default()
    };
    if arguments.list {
        return list(&session, &options);
    }
    let bar = progress_bar(arguments.common.quiet);
    let interrupts = Interrupts::handled(bar.clone());
    let shown = Mutex::new(());
    let report = |progress: Progress| {
        if matches!(progress, Progress::Working) {
            // Called often and from many threads; it shows nothing.
            interrupts.keep_results();
            return !interrupts.came() && !clock.has_run_out();
        }
        let _one_at_a_time = shown.lock();
        match progress {
            Progress::Fitting => bar.set_message("fitting the declared model"),
            Progress::Screening(candidates) => {
                bar.set_message(format!("screening {}", counted(candidates, "candidate")))
            }
            Progress::Folds(ended, folds) => bar.set_message(clock.remaining(ended, folds)),
            Progress::SelectedEffect(number, id, rms_um) => {
                let effects = counted(number, "effect");
                bar.set_message(format!("{effects}, held out {rms_um:.2} µm: {id}"));
                if !arguments.common.quiet {
                    bar.suspend(|| eprintln!("  + {id:<28} held out {rms_um:.3} µm"));
                }
            }
            Progress::Judging => bar.set_message("refitting and judging"),
            Progress::Working => {}
        }
        !interrupts.came() && !clock.has_run_out()
    };
    let mut trace = abbe::identify::trace::trace(&session, &options, &report)?;
    bar.set_message("comparing candidate tests");
    separate_aliases(&mut trace, &TestVariations::short(), &report)?;
    interrupts.end_at_once();
    bar.finish_and_clear();
    if let Some(seconds) = arguments.time_limit.filter(|_| !interrupts.came()) {
        trace.result.mark_time_limit(seconds);
    }
    if tables {
        screen::print(&trace, &arguments.session, arguments.all);
    }
    message::print_warnings(&trace.result.warnings);
    arguments.common.write_json(&sources, &trace.result)?;
    if let Some(path) = &arguments.write {
        next_session::write(path, &sources, &arguments.session, |text| {
            text.add_effects(&trace.effects, &session.machine)?;
            if arguments.with_tests {
                proposals(&trace.result).iter().try_for_each(|block| text.add_block(block))?;
            }
            if trace.result.interrupted {
                let interruption = trace.result.interruption();
                text.add_remark(&format!("The trace was {interruption}: effects may be missing."));
            }
            Ok(())
        })?;
    }
    if let Some(path) = &arguments.csv {
        output::write_figures(path, &present::figures(&trace.result))?;
    }
    if let Some(path) = &arguments.residuals {
        output::write_whole(path, &output::csv(&readings::residuals(&trace.after, &trace.after_fit))?)?;
    }
    if arguments.report.asked() {
        let document = crate::report::pages::trace::document(&trace)?;
        arguments.report.write(&document, (&session, &sources), arguments.common.seed)?;
    }
    if trace.result.interrupted {
        if arguments.compensation.wanted() {
            eprintln!("warning: no compensation tables are written: effects may be missing from the model");
        }
        if arguments.save.file().is_some() {
            eprintln!("warning: no model is saved: effects may be missing from it");
        }
        return match trace.result.time_limit_s {
            Some(_) => Ok(()),
            None => Err(Failure::Interrupted(trace.result.interruption())),
        };
    }
    arguments.save.run(&trace.after, &trace.after_fit, &sources, arguments.common.seed)?;
    arguments.compensation.run(&trace.after, &trace.after_fit, tables)
}

/// The proposed tests as blocks of a session, each once.
fn proposals(result: &TraceResult) -> Vec<String> {
    let mut seen: Vec<&str> = Vec::new();
    let mut blocks = Vec::new();
    for test in result.effects.iter().flat_map(|effect| &effect.separating_tests) {
        if !test.session_toml.is_empty() && !seen.contains(&test.test.as_str()) {
            seen.push(&test.test);
            blocks.push(test.session_toml.clone());
        }
    }
    blocks
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

fn list(session: &abbe::model::session::Session, options: &TraceOptions) -> Result<(), Failure> {
    let families = library::families()?;
    let entries = abbe::identify::trace::screening::screened_effects(session, options)?;
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
