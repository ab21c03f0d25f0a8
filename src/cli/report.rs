//! `--report FILE.html` and `--plots DIR`.

use std::path::{Path, PathBuf};

use abbe::model::files::SourceMap;
use abbe::model::session::Session;
use clap::Args;

use super::failure::Failure;
use super::{folder, output};
use crate::printers::csv;
use crate::printers::page;
use crate::report::figure::svg;
use crate::report::pages::document::Document;
use crate::report::provenance::Provenance;

/// The files of a report.
#[derive(Args, Clone)]
pub struct ReportArguments {
    /// Write a report with tables and plots as one self-contained HTML file.
    ///
    /// Example: --report report.html
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Write each plot of the report into a new or empty folder, as SVG, its data as CSV, and as PNG if the program is
    /// built with the feature `png`.
    ///
    /// Example: --plots plots
    #[arg(long, value_name = "DIR")]
    plots: Option<PathBuf>,
    /// Require PNG beside each SVG of --plots; an error if the program is built without the feature `png`.
    #[arg(long, requires = "plots")]
    png: bool,
}

impl ReportArguments {
    /// Whether a report or plots are requested.
    pub fn asked(&self) -> bool {
        self.report.is_some() || self.plots.is_some()
    }

    /// The file of the report.
    pub fn file(&self) -> Option<&PathBuf> {
        self.report.as_ref()
    }

    /// Refuses plots that cannot be written, before the work.
    pub fn check(&self) -> Result<(), Failure> {
        if self.png && !cfg!(feature = "png") {
            return Err(Failure::CommandLine(
                "`--png`: this program is built without PNG; build it with `cargo build --release --features png`, or leave out `--png` for SVG"
                    .into(),
            ));
        }
        if let Some(path) = &self.plots {
            folder::check(path, None)?;
        }
        Ok(())
    }

    /// Writes the requested files.
    pub fn write(&self, document: &Document, read: (&Session, &SourceMap), seed: u64) -> Result<(), Failure> {
        if let Some(path) = &self.report {
            let text = page::html(document, &Provenance::of(read, seed)).map_err(Failure::Other)?;
            output::write_whole(path, text.as_bytes())?;
        }
        if let Some(path) = &self.plots {
            write_plots(document, path)?;
        }
        Ok(())
    }
}

fn write_plots(document: &Document, path: &Path) -> Result<(), Failure> {
    #[cfg(feature = "png")]
    let fonts = crate::report::figure::png::Fonts::bundled();
    let mut files = Vec::new();
    for figure in &document.figures {
        let data = csv::text(&figure.table()).map_err(Failure::Other)?;
        files.push((format!("{}.svg", figure.name), svg::file(figure).into_bytes()));
        files.push((format!("{}.csv", figure.name), data));
        #[cfg(feature = "png")]
        {
            let png = crate::report::figure::png::png(figure, &fonts)
                .ok_or_else(|| Failure::Other(format!("the plot `{}` cannot be drawn as PNG", figure.name)))?;
            files.push((format!("{}.png", figure.name), png));
        }
    }
    folder::write(path, &files, false, |_| Ok(()))
}
