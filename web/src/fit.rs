//! A fit.

use abbe::document::StatedFit;
use abbe::report::block::Report;
use abbe::report::commands::Commands;
use abbe::report::{self, readings};
use abbe::trace::SessionFit;
use wasm_bindgen::prelude::*;

use crate::failed::Failed;
use crate::folder::{Folder, Read};
use crate::output;

/// A fitted session.
#[wasm_bindgen]
pub struct Fit {
    read: Read,
    seed: u64,
    fit: SessionFit,
}

#[wasm_bindgen]
impl Fit {
    /// Fits a session of a folder.
    ///
    /// # Errors
    /// If the session cannot be used or its parameters cannot be estimated.
    pub fn of(folder: &Folder, session: &str, seed: u32) -> Result<Fit, Failed> {
        let read = folder.read(session, true)?;
        let seed = u64::from(seed);
        let fit = SessionFit::of(&read.session, seed)?;
        Ok(Fit { read, seed, fit })
    }

    /// The document of `--json`.
    pub fn json(&self) -> Result<String, Failed> {
        output::json("fit", &self.read, self.seed, &StatedFit::of_fit(&self.fit.problem, &self.fit.result))
    }

    /// The page of `--report`.
    pub fn report(&self) -> Result<String, Failed> {
        output::report("fit", &self.read, self.seed, &self.found(true)?)
    }

    /// The table of `--csv`.
    pub fn csv(&self) -> Result<String, Failed> {
        output::values(&self.found(false)?)
    }

    /// The table of `--residuals`.
    pub fn residuals(&self) -> Result<String, Failed> {
        output::table(&readings::residuals(&self.fit.problem, &self.fit.fit))
    }

    /// The file of `--save`.
    pub fn model(&self) -> Result<String, Failed> {
        output::model("fit", &self.read, self.seed, &self.fit.problem, &self.fit.fit)
    }
}

impl Fit {
    fn found(&self, figures: bool) -> Result<Report, Failed> {
        let commands = Commands::of(&self.read.sources.file, None, false);
        let SessionFit { problem, fit, result, .. } = &self.fit;
        Ok(report::fit::report(problem, fit, &StatedFit::of_fit(problem, result), &commands, figures)?)
    }
}
