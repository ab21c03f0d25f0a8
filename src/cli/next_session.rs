//! `--write FILE`: the session with what a command adds to it, as a session file.

use std::path::Path;

use abbe::files::SourceMap;
use abbe::model::Diagnostic;
use abbe::model::chain::Machine;
use abbe::model::document::edit::SessionText;
use abbe::model::document::measurement::Test;
use abbe::model::document::print::Block;
use abbe::trace::TraceOutcome;
use abbe::trace::result::TraceResult;

use super::message::{Kind, tell};
use super::{SessionArguments, output};

/// Writes the session's text after `edit`. Names of files are adapted to the folder of `path`; everything else, comments
/// included, stays.
pub fn write(
    path: &Path,
    sources: &SourceMap,
    arguments: &SessionArguments,
    edit: impl FnOnce(&mut SessionText) -> Result<(), Diagnostic>,
) -> Result<(), Diagnostic> {
    let data = arguments.data.data.as_deref();
    let mut text = sources.text.clone();
    text.relocate(output::folder_of(path), data)?;
    edit(&mut text)?;
    output::write_whole(path, text.to_string().as_bytes())?;
    let [own, there] = [&sources.file, path].map(|file| output::folder_of(file).canonicalize().ok());
    if own != there {
        let note = format!(
            "{} refers to its machine and data in another folder; commands read it with --allow-outside",
            path.display()
        );
        tell(Kind::Note, &note);
    }
    Ok(())
}

/// Declares the found effects, and adds the tests that separate them from their aliases if they are asked for.
pub fn add_trace(
    text: &mut SessionText,
    trace: &TraceOutcome,
    machine: &Machine,
    with_tests: bool,
) -> Result<(), Diagnostic> {
    text.add_effects(&trace.effects, machine)?;
    if with_tests {
        proposals(&trace.result).into_iter().try_for_each(|block| text.add_block(block))?;
    }
    if trace.result.interrupted {
        text.add_remark(&format!("The trace was {}: effects may be missing.", trace.result.interruption()));
    }
    Ok(())
}

/// The proposed tests, each once.
pub fn proposals(result: &TraceResult) -> Vec<&Block<Test>> {
    let mut seen: Vec<&str> = Vec::new();
    let mut proposals = Vec::new();
    for test in result.effects.iter().flat_map(|effect| &effect.separating_tests) {
        if test.proposal.entry.is_some() && !seen.contains(&test.test.as_str()) {
            seen.push(&test.test);
            proposals.push(&test.proposal);
        }
    }
    proposals
}
