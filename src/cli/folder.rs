//! Folders of files that appear whole or not at all.

use std::path::Path;

use super::failure::Failure;

/// A file to be written: its name in the folder, its contents.
pub type NewFile = (String, String);

/// Writes files into a folder. They are made in a temporary folder beside it, `look` sees them there, and only then do they move to their place:
/// a new folder in one step, into one that is there file by file, the last one last.
///
/// A folder that is there and not empty is refused unless `force` says that files of these names may be replaced; other files in it stay.
pub fn write(
    folder: &Path,
    files: &[(String, impl AsRef<[u8]>)],
    force: bool,
    look: impl FnOnce(&Path) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let fault = |source| fault(folder, source);
    let present = check(folder, Some(force))?;
    let parent = match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(parent).map_err(fault)?;
    // What is written here is renamed into its place, so it has to lie on the same file system.
    let made = tempfile::Builder::new()
        .prefix(".abbe-")
        .tempdir_in(parent)
        .map_err(fault)?;
    let whole = made.path().join("whole");
    std::fs::create_dir(&whole).map_err(fault)?;
    for (name, contents) in files {
        // The place that is meant, not the one where it is made.
        super::output::write_whole(&whole.join(name), contents.as_ref()).map_err(
            |failure| match failure {
                Failure::Write { source, .. } => self::fault(&folder.join(name), source),
                other => other,
            },
        )?;
    }
    look(&whole)?;
    if present {
        for (name, _) in files {
            std::fs::rename(whole.join(name), folder.join(name)).map_err(fault)?;
        }
    } else {
        std::fs::rename(&whole, folder).map_err(fault)?;
    }
    Ok(())
}

fn fault(folder: &Path, source: std::io::Error) -> Failure {
    Failure::Write {
        path: folder.display().to_string(),
        source,
    }
}

/// Whether the folder is there; an error where nothing may be written into it. `force` is what the user said, where the command has a `--force`.
pub fn check(folder: &Path, force: Option<bool>) -> Result<bool, Failure> {
    if folder.as_os_str() == "-" {
        return Err(Failure::CommandLine(
            "`-` is standard output, which cannot take a folder of files; name a folder".into(),
        ));
    }
    if folder.is_file() {
        return Err(Failure::Other(format!(
            "{}: this is a file; name a folder",
            folder.display()
        )));
    }
    let present = folder.is_dir();
    let occupied = present
        && std::fs::read_dir(folder)
            .map_err(|source| fault(folder, source))?
            .next()
            .is_some();
    if occupied && force != Some(true) {
        let or = match force {
            Some(_) => ", or say --force to replace the files in it that are of the same names",
            None => "",
        };
        return Err(Failure::Other(format!(
            "{}: the folder is there and not empty; name another{or}",
            folder.display()
        )));
    }
    Ok(present)
}
