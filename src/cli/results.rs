//! Where the result of a command goes: screen, JSON, report, CSV, plots. One group of options for all commands.

use std::path::{Path, PathBuf};

use abbe::analysis::Found;
use abbe::document::{self, Document, Origin};
use abbe::files::SourceMap;
use abbe::files::stamp::FileStamp;
use abbe::identify::model_file::IdentifiedModel;
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use clap::Args;
use serde::Serialize;
use serde_json::Value;

use super::failure::command_line;
use super::folder;
use super::json;
use super::message::print_warnings;
use super::output::{self, Outputs};
use crate::printers::{csv, page, terminal};
use crate::report::block::Report;
use crate::report::commands::Commands;
use crate::report::figure::svg;
use crate::report::provenance::{Input, Provenance};

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
            let text = Document::text(json::command_line(), read.origin(), read.seed, result())?;
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
