//! The result of an analysis.

use abbe::analysis::{self, Analysed, Given, Progress};
use abbe::printers::{csv, page};
use abbe::report::block::Report;
use abbe::report::commands::Commands;
use abbe::report::provenance::Provenance;
use abbe::report::readings;
use abbe::report::table::Table;
use abbe::trace::TraceOutcome;
use wasm_bindgen::prelude::*;

use crate::failed::Failed;
use crate::folder::{Folder, Read};

/// A session of a folder with what an analysis found.
#[wasm_bindgen]
pub struct Analysis {
    read: Read,
    analysed: Analysed,
}

#[wasm_bindgen]
impl Analysis {
    /// Runs the analysis of a name. `abbeProgress` of the worker is called with words.
    ///
    /// # Errors
    /// If the session cannot be used or its parameters cannot be estimated.
    pub fn run(name: &str, folder: &Folder, session: &str, options: &str, seed: u32) -> Result<Analysis, Failed> {
        let read = folder.read(session, true)?;
        let given = [Given::Session(&read.session)];
        let analysed = analysis::run(name, &given, options, u64::from(seed), &tell)?;
        Ok(Analysis { read, analysed })
    }

    /// The document of `--json`.
    pub fn json(&self) -> Result<String, Failed> {
        Ok(self.analysed.document(self.read.origin.clone())?)
    }

    /// The page of `--report`.
    pub fn report(&self) -> Result<String, Failed> {
        let provenance = Provenance::of((&self.read.session, &self.read.sources), self.analysed.seed);
        let command = format!("abbe {} {}", self.analysed.call.command, self.read.sources.file.display());
        Ok(page::html(&self.found(true)?, &Provenance { command, ..provenance })?)
    }

    /// The table of `--csv`.
    pub fn csv(&self) -> Result<String, Failed> {
        Ok(String::from_utf8_lossy(&csv::report(&self.found(false)?)?).into_owned())
    }

    /// The table of `--residuals`; none of a result without a fit.
    pub fn residuals(&self) -> Result<String, Failed> {
        let fits = self.analysed.found.fits();
        let table = fits.last().map_or_else(Table::default, |(problem, fit)| readings::residuals(problem, fit));
        Ok(String::from_utf8_lossy(&csv::text(&table)?).into_owned())
    }

    /// The file of `--save`.
    pub fn model(&self) -> Result<String, Failed> {
        Ok(self.analysed.model(&self.read.origin)?.to_text()?)
    }

    /// The session of `--write`: the same with the found effects declared.
    ///
    /// # Errors
    /// If the session states its effects as something else than tables.
    pub fn session(&self) -> Result<String, Failed> {
        let mut text = self.read.sources.text.clone();
        let found: &dyn std::any::Any = &*self.analysed.found;
        if let Some(trace) = found.downcast_ref::<TraceOutcome>() {
            text.add_effects(&trace.effects, &self.read.session.machine)?;
        }
        Ok(text.to_string())
    }
}

impl Analysis {
    fn found(&self, figures: bool) -> Result<Report, Failed> {
        Ok(self.analysed.found.report(&Commands::of(&self.read.sources.file, None, false), figures)?)
    }
}

#[wasm_bindgen]
extern "C" {
    /// The function of the worker that hears of progress.
    #[wasm_bindgen(js_name = abbeProgress)]
    fn say(words: &str);
}

/// Tells what is done now; only the first thread, since the other workers have no `abbeProgress`. The work goes on until
/// the page ends the worker.
fn tell(progress: Progress) -> bool {
    if rayon::current_thread_index() == Some(0) {
        progress.words().iter().for_each(|words| say(words));
    }
    true
}
