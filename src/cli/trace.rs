//! `abbe trace`: find the unmodelled effect behind the residual.

mod clock;
mod next;
mod progress;

use std::path::PathBuf;

use abbe::document::StatedTrace;
use abbe::trace::TraceOptions;
use clap::Args;

use clock::seconds;

use super::failure::Failure;
use super::results::Read;
use super::save::SaveArguments;
use super::search::SearchArguments;
use super::{CommonArguments, PlausibilityArguments, SessionArguments, next_session, output, read_session};
use crate::report::{readings, trace as present};

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
    plausibility: PlausibilityArguments,
    #[command(flatten)]
    save: SaveArguments,
    #[command(flatten)]
    search: SearchArguments,
    /// Explanation that is accepted on the user's word: a found effect, or one of its aliases, which then takes its place.
    /// Uncertainties do not cover the others; every output says so. May be repeated.
    ///
    /// Example: --assume EAC~C:h1
    #[arg(long, value_name = "EFFECT", allow_hyphen_values = true)]
    assume: Vec<String>,
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
    next: next::NextArguments,
}

/// Runs `abbe trace`.
pub fn run(arguments: &TraceArguments) -> Result<(), Failure> {
    let common = &arguments.common;
    let force = common.output.folder.force;
    arguments.next.check(force)?;
    let others = [arguments.write.as_ref(), arguments.residuals.as_ref(), arguments.save.file()];
    let outputs = common.output.prepared(&others)?;
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    let options = TraceOptions {
        seed: common.seed,
        max_effects: arguments.search.max_effects,
        only: arguments.search.only.clone(),
        exclude: arguments.search.exclude.clone(),
        assume: arguments.assume.clone(),
        ..TraceOptions::default()
    };
    if arguments.list {
        return progress::list(&session, &options);
    }
    let ends = (arguments.time_limit, common.output.quiet);
    let trace = progress::trace(&session, &options, arguments.plausibility, ends)?;
    let stated = StatedTrace::of_trace(&trace);
    let accepted: Vec<_> = arguments.plausibility.repeated().into_iter().collect();
    let repeated = [common.repeated(&arguments.assume), arguments.search.repeated(), accepted].concat();
    let commands = arguments.session.commands("trace", &repeated);
    let report = present::report(&trace, &stated, &commands, common.output.figures())?;
    common.output.put(&outputs, &report, &stated, &Read::session(&session, &sources, common.seed))?;
    if let Some(path) = &arguments.write {
        next_session::write(path, &sources, &arguments.session, |text| {
            next_session::add_trace(text, &trace, &session.machine, arguments.with_tests)
        })?;
    }
    if let Some(path) = &arguments.residuals {
        output::write_whole(path, &output::csv(&readings::residuals(&trace.after, &trace.after_fit))?)?;
    }
    if trace.result.interrupted {
        return progress::ended_early(&trace, arguments.save.file().is_some());
    }
    arguments.next.run(&session, &sources, &trace, (common.output.quiet, force))?;
    arguments.save.run(&trace.after, &trace.after_fit, &sources, common.seed)
}
