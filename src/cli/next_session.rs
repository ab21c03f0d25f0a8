//! `--write FILE`: the session with what a command adds to it, as a session file.

use std::path::Path;

use abbe::model::files::SourceMap;
use abbe::model::files::toml::rewrite;

use super::failure::Failure;
use super::message::{Kind, tell};
use super::{SessionArguments, output};

/// Writes the session's text after `edit`. Names of files are adapted to the folder of `path`; everything else, comments
/// included, stays.
pub fn write(
    path: &Path,
    sources: &SourceMap,
    arguments: &SessionArguments,
    edit: impl FnOnce(&str) -> String,
) -> Result<(), Failure> {
    let data = arguments.data.as_deref();
    let text = rewrite::relocated(&sources.text, &sources.file, output::folder_of(path), data)?;
    output::write_whole(path, edit(&text).as_bytes())?;
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
