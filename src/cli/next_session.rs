//! `--write FILE`: the session with what a command adds to it, as a session file.

use std::path::Path;

use abbe::model::ModelError;
use abbe::model::document::edit::SessionText;
use abbe::model::files::SourceMap;

use super::failure::Failure;
use super::message::{Kind, tell};
use super::{SessionArguments, output};

/// Writes the session's text after `edit`. Names of files are adapted to the folder of `path`; everything else, comments
/// included, stays.
pub fn write(
    path: &Path,
    sources: &SourceMap,
    arguments: &SessionArguments,
    edit: impl FnOnce(&mut SessionText) -> Result<(), ModelError>,
) -> Result<(), Failure> {
    let data = arguments.data.as_deref();
    let mut text = SessionText::new(&sources.text, &sources.file)?;
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
