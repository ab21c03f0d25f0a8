//! Folders of files, written completely or not at all.

use std::path::{Path, PathBuf};

use abbe::model::Diagnostic;
use abbe::temporary::{self, TemporaryFolder};

use super::failure::{command_line, unwritable};
use super::output;

/// A file to write: its name in the folder, with the names of folders within it, and its contents.
pub type NewFile = (String, String);

/// Writes files into a folder: first into a temporary folder beside it, where `check_files` reads them and may add others.
/// Then all are moved, on one file system: a new folder in one step; into an existing one file after the other, the added ones last.
///
/// A folder that is not empty is refused, unless `force` allows to replace files with these names. Other files stay.
pub fn write(
    folder: &Path,
    files: &[(String, impl AsRef<[u8]>)],
    force: bool,
    check_files: impl FnOnce(&Path) -> Result<(), Diagnostic>,
) -> Result<(), Diagnostic> {
    let fault = |source| unwritable(folder, source);
    let present = check(folder, force)?;
    let parent = match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(parent).map_err(fault)?;
    temporary::remove_stale(parent);
    let made = TemporaryFolder::in_folder(parent).map_err(fault)?;
    let whole = made.path().join("whole");
    std::fs::create_dir(&whole).map_err(fault)?;
    // An error names the final path, not the temporary one.
    let final_path = |mut error: Diagnostic| {
        if let Some(place) = &mut error.place
            && let Ok(name) = place.file.strip_prefix(&whole)
        {
            place.file = folder.join(name);
        }
        error
    };
    let make_folder_of = |file: &Path| file.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(fault);
    for (name, contents) in files {
        make_folder_of(&whole.join(name))?;
        output::write_whole(&whole.join(name), contents.as_ref()).map_err(final_path)?;
    }
    check_files(&whole).map_err(final_path)?;
    if present {
        let move_file = |name: &Path| {
            make_folder_of(&folder.join(name))?;
            std::fs::rename(whole.join(name), folder.join(name)).map_err(fault)
        };
        files.iter().try_for_each(|(name, _)| move_file(Path::new(name)))?;
        let added = temporary::files_below(&whole).map_err(fault)?;
        added.iter().filter_map(|file| file.strip_prefix(&whole).ok()).try_for_each(move_file)?;
    } else {
        std::fs::rename(&whole, folder).map_err(fault)?;
    }
    Ok(())
}

/// Adds files to an existing folder in their order, except those that are named as `read` where they lie. The last one is
/// the file that names the others, and replaces its former state.
///
/// # Errors
/// If another file with one of the names and other contents exists, unless `force` allows to replace it. Nothing is written
/// then.
pub fn add(folder: &Path, files: &[(String, Vec<u8>)], read: &[PathBuf], force: bool) -> Result<(), Diagnostic> {
    let Some((last, others)) = files.split_last() else { return Ok(()) };
    let mut written: Vec<(PathBuf, &[u8])> = Vec::new();
    for (name, contents) in others {
        let path = folder.join(name);
        if read.iter().any(|file| output::is_same(file, &path)) {
            continue;
        }
        match std::fs::read(&path) {
            Ok(present) if present == *contents => continue,
            Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => {}
            Err(source) => return Err(unwritable(&path, source)),
            Ok(_) if force => {}
            Ok(_) => {
                return Err(Diagnostic::other(format!(
                    "{}: a file with this name exists, and its contents are others; rename one of the two, or use --force to replace it",
                    path.display()
                )));
            }
        }
        written.push((path, contents));
    }
    written.push((folder.join(&last.0), &last.1));
    written.into_iter().try_for_each(|(path, contents)| output::write_whole(&path, contents))
}

/// Whether the folder exists. `force` is the option of the user.
///
/// # Errors
/// If nothing may be written into the folder.
pub fn check(folder: &Path, force: bool) -> Result<bool, Diagnostic> {
    if folder.as_os_str() == "-" {
        let what = "`-` is standard output, which cannot contain a folder; name a folder";
        return Err(command_line(what));
    }
    if folder.is_file() {
        return Err(Diagnostic::other(format!("{}: this is a file; name a folder", folder.display())));
    }
    let present = folder.is_dir();
    if present && !force && std::fs::read_dir(folder).map_err(|source| unwritable(folder, source))?.next().is_some() {
        return Err(Diagnostic::other(format!(
            "{}: the folder exists and is not empty; name another, or use --force to replace files with the same names",
            folder.display()
        )));
    }
    Ok(present)
}
