//! Session files from files, folders and lists.

use std::io::Read;
use std::path::{Path, PathBuf};

use abbe_model::Diagnostic;

use super::{unreadable, unusable};

/// The name of a session file in a folder that is searched.
const SESSION_FILE: &str = "session.toml";

/// Largest size of a list, bytes.
const MAX_BYTES: u64 = 64 << 20;
/// Largest number of paths of a list.
const MAX_PATHS: usize = 1_000_000;

/// Session files: each file itself, and every `session.toml` in or below each folder, in the order of their names. A
/// file that is named twice counts once.
///
/// A folder that cannot be read is listed in place of its sessions, so that it is a row with its error.
///
/// # Errors
/// If a folder holds no `session.toml`.
pub fn sessions(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Diagnostic> {
    let mut found = Vec::new();
    for path in paths {
        if path.is_dir() {
            let before = found.len();
            below(path, &mut found);
            if found.len() == before {
                let found = format!("no {SESSION_FILE} lies in this folder or below");
                return Err(unusable(path.display(), found, "name session files"));
            }
        } else {
            found.push(path.clone());
        }
    }
    let mut known = std::collections::HashSet::new();
    found.retain(|path| known.insert(path.clone()));
    Ok(found)
}

/// The paths that are typed and those of a list, and their session files, or of `n` parts of them the `k`th: every `n`th
/// file from the `k`th on.
///
/// # Errors
/// If a typed path is not there, the list cannot be read, or there is no session.
pub fn chosen(
    typed: &[PathBuf],
    list: Option<&Path>,
    part: Option<(usize, usize)>,
) -> Result<(Vec<PathBuf>, Vec<PathBuf>), Diagnostic> {
    // A file of a list may be gone since the list was made: it is a result with its error. A path that is typed is a
    // mistake.
    if let Some(path) = typed.iter().find(|path| matches!(path.try_exists(), Ok(false))) {
        return Err(unusable(path.display(), "neither a session file nor a folder is there", "correct the path"));
    }
    let mut paths = typed.to_vec();
    paths.extend(list.map_or(Ok(Vec::new()), listed)?);
    let files = sessions(&paths)?;
    if files.is_empty() && part.is_none() {
        return Err(Diagnostic::other("no session is named; name session files or folders"));
    }
    let (first, every) = part.map_or((0, 1), |(k, n)| (k - 1, n));
    Ok((paths, files.into_iter().skip(first).step_by(every).collect()))
}

/// The paths of a file with one path in each line; `-` is standard input. Empty lines and lines that begin with `#` do
/// not count.
///
/// # Errors
/// If the file cannot be read or is no UTF-8.
pub fn listed(file: &Path) -> Result<Vec<PathBuf>, Diagnostic> {
    let fault = |source| unreadable(file, source);
    let mut text = String::new();
    let opened: Box<dyn Read> = match file.as_os_str() == "-" {
        true => Box::new(std::io::stdin()),
        false => Box::new(std::fs::File::open(file).map_err(fault)?),
    };
    opened.take(MAX_BYTES + 1).read_to_string(&mut text).map_err(fault)?;
    let lines = || text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let count = lines().count();
    if text.len() as u64 > MAX_BYTES || count > MAX_PATHS {
        let found = format!("a list has at most {MAX_PATHS} paths and {MAX_BYTES} bytes");
        return Err(unusable(file.display(), found, "name folders, or split the list"));
    }
    Ok(lines().map(PathBuf::from).collect())
}

/// Adds the session files of a folder. A link to a folder is not followed, so that no circle is walked.
fn below(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(mut entries) = std::fs::read_dir(folder).and_then(Iterator::collect::<Result<Vec<_>, _>>) else {
        found.push(folder.to_path_buf());
        return;
    };
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            below(&entry.path(), found);
        } else if entry.file_name() == SESSION_FILE {
            found.push(entry.path());
        }
    }
}
