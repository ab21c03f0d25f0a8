//! Where the result of a command goes: screen, JSON, report, CSV, plots. One group of options for all commands.

use std::any::TypeId;
use std::path::{Path, PathBuf};

use abbe::analysis::Found;
use abbe::document::{self, Call, Document, Origin};
use abbe::files::SourceMap;
use abbe::files::stamp::FileStamp;
use abbe::identify::fit::Fit;
use abbe::identify::model_file::IdentifiedModel;
use abbe::identify::problem::Problem;
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use clap::{Arg, ArgAction, ArgMatches, Args};
use serde::Serialize;
use serde_json::{Map, Value};

use super::failure::command_line;
use super::message::print_warnings;
use super::output::{self, Outputs};
use super::{folder, parser};
use crate::printers::{csv, page, terminal};
use crate::report::block::Report;
use crate::report::commands::Commands;
use crate::report::figure::svg;
use crate::report::provenance::{Input, Provenance};
use crate::report::readings;

/// How to see what the first screen folds.
const MORE: &str = "--all lists them";

/// The outputs of a result.
#[derive(Args, Clone)]
pub struct OutputArguments {
    /// Write the result as JSON; `-` writes it, and nothing else, to standard output.
    ///
    /// Example: --json result.json
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write a report with tables and plots as one self-contained HTML file.
    ///
    /// Example: --report report.html
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Write the values of the result as CSV.
    ///
    /// Example: --csv values.csv
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Write each plot of the report into a new or empty folder, as SVG, its data as CSV, and as PNG if the program is
    /// built with the feature `png`.
    ///
    /// Example: --plots plots
    #[arg(long, value_name = "DIR")]
    pub plots: Option<PathBuf>,
    /// Require PNG beside each SVG of --plots; an error if the program is built without the feature `png`.
    #[arg(long, requires = "plots")]
    png: bool,
    #[command(flatten)]
    pub folder: super::ForceArguments,
    /// List everything that the first screen folds.
    #[arg(long)]
    all: bool,
    /// Suppress tables and progress output; warnings and errors stay.
    #[arg(short, long, global = true)]
    pub quiet: bool,
}

/// A file that is analysed, with what it was read from.
pub enum File {
    /// A session.
    Session(Box<(Session, SourceMap)>),
    /// A saved model.
    Model(Box<IdentifiedModel>, Option<FileStamp>),
}

/// What a result was computed from.
#[derive(Default)]
pub struct Read<'r> {
    /// The sessions.
    pub sessions: Vec<(&'r Session, &'r SourceMap)>,
    /// Further files.
    pub files: Vec<&'r FileStamp>,
    /// Seed of all random numbers, if there are any.
    pub seed: Option<u64>,
}

impl<'r> Read<'r> {
    /// A session.
    pub fn session(session: &'r Session, sources: &'r SourceMap, seed: u64) -> Read<'r> {
        Read { sessions: vec![(session, sources)], files: Vec::new(), seed: Some(seed) }
    }

    /// Files.
    pub fn files(files: impl IntoIterator<Item = &'r FileStamp>) -> Read<'r> {
        Read { files: files.into_iter().collect(), ..Read::default() }
    }

    /// Sessions and models.
    pub fn inputs(inputs: &'r [File], seed: u64) -> Read<'r> {
        let mut found = Read { seed: Some(seed), ..Read::default() };
        for input in inputs {
            match input {
                File::Session(read) => found.sessions.push((&read.0, &read.1)),
                File::Model(_, stamp) => found.files.extend(stamp),
            }
        }
        found
    }

    /// The files, for a JSON document.
    pub fn origin(&self) -> Origin {
        let mut origin = Origin::default();
        for (_, sources) in &self.sessions {
            origin.add(Origin::of_session(sources));
        }
        origin.add(Origin::of_files(self.files.iter().copied()));
        origin
    }

    /// The files, for a page.
    pub fn provenance(&self) -> Provenance {
        let mut found = Provenance::of_command(self.seed);
        for read in &self.sessions {
            found.add(*read);
        }
        found.inputs.extend(self.files.iter().map(|stamp| Input::of(stamp)));
        found
    }
}

impl OutputArguments {
    /// The files that are written, `others` of the command among them. What cannot be written is refused before the
    /// work.
    pub fn prepared(&self, others: &[Option<&PathBuf>]) -> Result<Outputs, Diagnostic> {
        if self.png && !cfg!(feature = "png") {
            return Err(command_line(
                "`--png`: this program is built without PNG; build it with `cargo build --release --features png`, or leave out `--png` for SVG",
            ));
        }
        if let Some(path) = &self.plots {
            folder::check(path, self.folder.force)?;
        }
        self.report.as_deref().map(output::check_page).transpose()?;
        let own = [&self.csv, &self.report, &self.json].map(Option::as_ref);
        Ok(Outputs::new(others.iter().chain(&own).copied().flatten())?.quieted(self.quiet))
    }

    /// Prints a report, and writes it and its result to the files that are asked for.
    ///
    /// # Errors
    /// If a file cannot be written, or one that was read has changed.
    pub fn put<T: Serialize>(
        &self,
        outputs: &Outputs,
        report: &Report,
        result: &T,
        read: &Read<'_>,
    ) -> Result<(), Diagnostic> {
        self.write(outputs, report, read, || document::json(result))
    }

    /// The same of an analysis. Its report proposes `commands`.
    pub fn put_found(
        &self,
        outputs: &Outputs,
        found: &dyn Found,
        commands: &Commands,
        read: &Read<'_>,
    ) -> Result<(), Diagnostic> {
        let report = found.report(commands, self.report.is_some() || self.plots.is_some())?;
        self.write(outputs, &report, read, || found.result())
    }

    fn write(
        &self,
        outputs: &Outputs,
        report: &Report,
        read: &Read<'_>,
        result: impl FnOnce() -> serde_json::Result<Value>,
    ) -> Result<(), Diagnostic> {
        self.show(outputs, report);
        if let Some(path) = &self.json {
            let text = Document::text(call(), read.origin(), read.seed, result())?;
            output::write_whole(path, text.as_bytes())?;
        }
        if let Some(path) = &self.csv {
            output::write_whole(path, &csv::report(report)?)?;
        }
        if let Some(path) = &self.report {
            let text = page::html(report, &read.provenance()).map_err(Diagnostic::other)?;
            output::write_whole(path, text.as_bytes())?;
        }
        self.plots.as_ref().map_or(Ok(()), |path| write_plots(report, path, self.folder.force))
    }

    /// Prints a report, and its warnings to standard error.
    pub fn show(&self, outputs: &Outputs, report: &Report) {
        if outputs.tables() {
            output::whole(&terminal::report(report, (!self.all).then_some(MORE)));
        }
        print_warnings(&report.warnings);
    }
}

fn write_plots(report: &Report, path: &Path, force: bool) -> Result<(), Diagnostic> {
    #[cfg(feature = "png")]
    let fonts = crate::report::figure::png::Fonts::bundled();
    let mut files = Vec::new();
    for figure in report.drawn() {
        let data = csv::text(&figure.chart.table).map_err(Diagnostic::other)?;
        files.push((format!("{}.svg", figure.name), svg::file(figure).into_bytes()));
        files.push((format!("{}.csv", figure.name), data));
        #[cfg(feature = "png")]
        {
            let png = crate::report::figure::png::png(figure, &fonts)
                .ok_or_else(|| Diagnostic::other(format!("the plot `{}` cannot be drawn as PNG", figure.name)))?;
            files.push((format!("{}.png", figure.name), png));
        }
    }
    folder::write(path, &files, force, |_| Ok(()))
}

/// The file of the model.
#[derive(Args, Clone)]
pub struct SaveArguments {
    /// Save the identified model (machine, estimates with covariance, effects, noise, range of the data), so that
    /// `abbe validate` can test it on another session.
    ///
    /// Example: --save model.json
    #[arg(long, value_name = "MODEL")]
    pub save: Option<PathBuf>,
}

impl SaveArguments {
    /// Saves the model of a fit, if it is requested.
    pub fn run(&self, problem: &Problem, fit: &Fit, sources: &SourceMap, seed: u64) -> Result<(), Diagnostic> {
        let Some(path) = &self.save else {
            return Ok(());
        };
        let model = IdentifiedModel::of_fit(problem, fit, Origin::of_session(sources).provenance(call(), seed))?;
        output::write_whole(path, model.to_text()?.as_bytes())
    }
}

/// Options of the tables of readings of a fit.
#[derive(Args)]
pub struct ReadingArguments {
    /// Write readings and residuals of an R-test by direction: of the sensors, along X, Y and Z, radial, tangential and
    /// axial.
    ///
    /// Example: --views views.csv
    #[arg(long, value_name = "FILE.csv")]
    pub views: Option<PathBuf>,
    /// Write reading and residual of every reading as CSV: test, run, line, axis positions, reading, residual in µm,
    /// residual over the noise standard deviation, and whether the reading counts or is an outlier; of the full fit.
    ///
    /// Example: --residuals residuals.csv
    #[arg(long, value_name = "FILE.csv")]
    pub residuals: Option<PathBuf>,
}

impl ReadingArguments {
    /// Writes the tables that are asked for.
    pub fn write(&self, problem: &Problem, fit: &Fit) -> Result<(), Diagnostic> {
        if let Some(path) = &self.views {
            output::write_whole(path, &output::csv(&readings::by_direction(problem, fit)?)?)?;
        }
        if let Some(path) = &self.residuals {
            output::write_whole(path, &output::csv(&readings::residuals(problem, fit))?)?;
        }
        Ok(())
    }
}

/// The name of the command, and the options on the command line of this process.
pub fn call() -> Call {
    let mut parser = parser();
    // The command line has been parsed before.
    let Ok(mut matches) = parser.clone().try_get_matches_from(std::env::args_os()) else {
        return Call::default();
    };
    let mut name = String::new();
    // Of `fleet run` the command is `run`.
    while let Some((inner, own)) = matches.remove_subcommand() {
        parser = parser.find_subcommand(&inner).cloned().unwrap_or_default();
        (name, matches) = (inner, own);
    }
    Call { command: name, options: options(&parser, &matches) }
}

/// Options that have a field of their own, or that change no result.
const LEFT_OUT: [&str; 3] = ["json", "quiet", "seed"];

/// The options of a command line, typed as the program reads them.
fn options(command: &clap::Command, matches: &ArgMatches) -> Map<String, Value> {
    let mut options = Map::new();
    for argument in command.get_arguments() {
        let id = argument.get_id().as_str();
        let Some(long) = argument.get_long().filter(|long| !LEFT_OUT.contains(long)) else {
            continue;
        };
        if matches.value_source(id) != Some(clap::parser::ValueSource::CommandLine) {
            continue;
        }
        let value = if matches!(argument.get_action(), ArgAction::SetTrue) {
            Value::Bool(true)
        } else {
            let raw = matches.get_raw(id).into_iter().flatten();
            let mut values: Vec<Value> = raw.map(|value| typed(argument, &value.to_string_lossy())).collect();
            match values.len() {
                1 if !takes_several(argument) => values.remove(0),
                _ => Value::Array(values),
            }
        };
        options.insert(long.replace('-', "_"), value);
    }
    options
}

fn takes_several(argument: &Arg) -> bool {
    let several = argument.get_num_args().is_some_and(|range| range.max_values() > 1);
    several || argument.get_value_delimiter().is_some() || matches!(argument.get_action(), ArgAction::Append)
}

/// A value as a number where the program reads a number, else as a string.
fn typed(argument: &Arg, text: &str) -> Value {
    let read = argument.get_value_parser().type_id();
    let whole = [TypeId::of::<usize>(), TypeId::of::<u64>(), TypeId::of::<u32>()];
    let number = if whole.iter().any(|kind| read == *kind) {
        text.parse::<u64>().ok().map(Value::from)
    } else if read == TypeId::of::<f64>() {
        text.parse::<f64>().ok().map(Value::from)
    } else {
        None
    };
    number.unwrap_or_else(|| Value::from(text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn options_have_the_types_that_the_program_reads() {
        let parser = super::parser();
        let line = [
            "abbe",
            "trace",
            "s.toml",
            "--max-effects",
            "2",
            "--only",
            "EZC",
            "--only",
            "~time",
            "--json",
            "t.json",
            "--seed",
            "3",
        ];
        let matches = parser.clone().try_get_matches_from(line).unwrap();
        let (name, own) = matches.subcommand().unwrap();
        let found = options(parser.find_subcommand(name).unwrap(), own);
        assert_eq!(Value::Object(found), json!({"max_effects": 2, "only": ["EZC", "~time"]}));
    }
}
