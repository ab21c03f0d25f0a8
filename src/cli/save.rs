//! `--save MODEL`: the identified model as a file.

use std::path::PathBuf;

use abbe::document::Origin;
use abbe::files::SourceMap;
use abbe::identify::fit::Fit;
use abbe::identify::model_file::IdentifiedModel;
use abbe::identify::problem::Problem;
use abbe::model::Diagnostic;
use clap::Args;

use super::{json, output};

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
        let model =
            IdentifiedModel::of_fit(problem, fit, Origin::of_session(sources).provenance(json::command_line(), seed))?;
        output::write_whole(path, model.to_text()?.as_bytes())
    }
}
