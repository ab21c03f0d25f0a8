//! `abbe trace`: find the unmodelled effect behind the residual.

mod clock;
mod next;
mod progress;

use std::path::PathBuf;

use abbe::analysis::SearchOptions;
use abbe::model::Diagnostic;
use abbe::trace::TraceOutcome;
use clap::Args;

use clock::seconds;

use super::results::Read;
use super::save::SaveArguments;
use super::{CommonArguments, Global, SessionArguments, next_session, output, read_session};
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
    next: next::NextArguments,
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
        return progress::list(&session, &options.with_seed(common.seed));
    }
    let trace = progress::trace(&session, &options, common.seed, common.output.quiet)?;
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
        return progress::ended_early(&trace, arguments.save.save.is_some());
    }
    arguments.next.run(&session, &sources, &trace, (common.output.quiet, force))?;
    arguments.save.run(&trace.after, &trace.after_fit, &sources, common.seed)
}
