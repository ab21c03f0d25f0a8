//! A trace.

use abbe::document::StatedTrace;
use abbe::plan::separating_tests::separate_aliases;
use abbe::plan::test_variations::TestVariations;
use abbe::report::block::Report;
use abbe::report::commands::Commands;
use abbe::report::{self, readings};
use abbe::trace::{self, Progress, TraceOptions, TraceOutcome};
use wasm_bindgen::prelude::*;

use crate::failed::Failed;
use crate::folder::{Folder, Read};
use crate::output;

/// A traced session.
#[wasm_bindgen]
pub struct Trace {
    read: Read,
    seed: u64,
    trace: TraceOutcome,
}

#[wasm_bindgen]
impl Trace {
    /// Traces a session of a folder. `abbeProgress` of the worker is called with words.
    ///
    /// # Errors
    /// If the session cannot be used or its parameters cannot be estimated.
    pub fn of(folder: &Folder, session: &str, seed: u32) -> Result<Trace, Failed> {
        let read = folder.read(session, true)?;
        let seed = u64::from(seed);
        let options = TraceOptions { seed, ..TraceOptions::default() };
        let mut trace = trace::trace(&read.session, &options, &|progress| tell(&progress))?;
        say("comparing candidate tests");
        separate_aliases(&mut trace, &TestVariations::short(), &|progress| tell(&progress))?;
        Ok(Trace { read, seed, trace })
    }

    /// The document of `--json`.
    pub fn json(&self) -> Result<String, Failed> {
        output::json("trace", &self.read, self.seed, &StatedTrace::of_trace(&self.trace))
    }

    /// The page of `--report`.
    pub fn report(&self) -> Result<String, Failed> {
        output::report("trace", &self.read, self.seed, &self.found(true)?)
    }

    /// The table of `--csv`.
    pub fn csv(&self) -> Result<String, Failed> {
        output::values(&self.found(false)?)
    }

    /// The table of `--residuals`.
    pub fn residuals(&self) -> Result<String, Failed> {
        output::table(&readings::residuals(&self.trace.after, &self.trace.after_fit))
    }

    /// The file of `--save`.
    pub fn model(&self) -> Result<String, Failed> {
        output::model("trace", &self.read, self.seed, &self.trace.after, &self.trace.after_fit)
    }

    /// The session of `--write`: the same with the found effects declared.
    ///
    /// # Errors
    /// If the session states its effects as something else than tables.
    pub fn session(&self) -> Result<String, Failed> {
        let mut text = self.read.sources.text.clone();
        text.add_effects(&self.trace.effects, &self.read.session.machine)?;
        Ok(text.to_string())
    }
}

impl Trace {
    fn found(&self, figures: bool) -> Result<Report, Failed> {
        let commands = Commands::of(&self.read.sources.file, None, false);
        Ok(report::trace::report(&self.trace, &StatedTrace::of_trace(&self.trace), &commands, figures)?)
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
fn tell(progress: &Progress) -> bool {
    if rayon::current_thread_index() == Some(0) {
        progress.words().iter().for_each(|words| say(words));
    }
    true
}
