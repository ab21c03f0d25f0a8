//! `abbe compare … --repeated`: Type A evaluation over repeated sessions beside the Type B evaluation of each fit.

use std::path::PathBuf;

use abbe::files;
use abbe::identify::{fit, model_file, plausibility, repeated};
use abbe::model::Diagnostic;

use super::output::{self, Outputs};
use super::results::Read;
use super::{CommonArguments, DataArguments};
use crate::report::block::Report;
use crate::report::repeated as present;

/// Fits each session separately and compares the fits.
pub fn run(
    all: &[PathBuf],
    data: &DataArguments,
    allow_implausible: bool,
    common: &CommonArguments,
    outputs: &Outputs,
) -> Result<(), Diagnostic> {
    let mut read = Vec::with_capacity(all.len());
    for (place, path) in all.iter().enumerate() {
        if all[..place].iter().any(|earlier| output::is_same(earlier, path)) {
            return Err(Diagnostic::other(format!(
                "{} is named twice; name each repeated session once",
                path.display()
            )));
        }
        let source = files::text(path, "the session")?;
        if model_file::is_model(&source.text) {
            let file = path.display();
            return Err(Diagnostic::other(format!("{file} is a model; `--repeated` compares the fits of sessions")));
        }
        let (session, sources) = files::session_of(&source, &data.options())?;
        outputs.refuse_overwrite_of_sources(&sources)?;
        read.push((session, sources));
    }
    let (mut sessions, mut warnings) = (Vec::with_capacity(all.len()), Vec::new());
    for (path, (session, _)) in all.iter().zip(&read) {
        let (problem, found) = fit::prepare(session, common.seed)?;
        let own = fit::report(&problem, &found)?;
        if !allow_implausible {
            plausibility::accepted(&own.plausibility)?;
        }
        warnings.extend(own.warnings.iter().map(|warning| format!("{}: {warning}", path.display())));
        sessions.push(repeated::Session::new(&path.display().to_string(), &problem, &found));
    }
    let result = repeated::compare(&sessions)?;
    let report = Report { warnings, ..present::report(&read[0].0.machine.name, &result) };
    let sessions = read.iter().map(|(session, sources)| (session, sources)).collect();
    common.output.put(outputs, &report, &result, &Read { sessions, files: Vec::new(), seed: Some(common.seed) })
}
