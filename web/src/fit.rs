//! A fit.

use abbe::identify::fit::SessionFit;
use abbe::report::fit::Figures;
use abbe::report::{pages, readings};
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
        output::json("fit", &self.read, self.seed, &self.fit.result)
    }

    /// The page of `--report`.
    pub fn report(&self) -> Result<String, Failed> {
        let document = pages::fit::document(&self.fit.problem, &self.fit.fit, &self.fit.result)?;
        output::report("fit", &self.read, self.seed, &document)
    }

    /// The table of `--csv`.
    pub fn csv(&self) -> Result<String, Failed> {
        output::figures(&Figures::of_fit(&self.fit.result))
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
