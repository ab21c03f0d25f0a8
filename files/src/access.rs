//! Access control: a session may read files beside itself, below, and in the data folder.
//!
//! A session from an untrusted source must not be able to name `../../secret.csv` and show its content in a message or
//! a report. The check uses the real location of a file, with symbolic links and `..` resolved.

use std::path::{Path, PathBuf};

use abbe_model::document::Fault;

use super::store::Store;

/// Options for reading a session.
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// The folder of the data files, if they are not beside the session file.
    pub data_directory: Option<PathBuf>,
    /// Whether the data files are read; otherwise the session is only a plan.
    pub read_data: bool,
    /// Whether the session may read files outside its own folder, the folders below and the data directory.
    pub allow_outside: bool,
    /// Where the session, its machine and its data lie.
    pub store: Store,
}

impl Default for ReadOptions {
    /// Data are read, from the session's folder and below.
    fn default() -> Self {
        ReadOptions { data_directory: None, read_data: true, allow_outside: false, store: Store::Disk }
    }
}

/// The folder to which the names in a session are relative.
pub(crate) fn folder(session: &Path) -> &Path {
    match session.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Returns a fault unless the session may read the file; `(key, named)` says how the session names it.
pub(crate) fn check(
    session: &Path,
    options: &ReadOptions,
    (key, named): (&str, &str),
    found: &Path,
) -> Result<(), Fault> {
    if options.allow_outside {
        return Ok(());
    }
    let folders = std::iter::once(folder(session)).chain(options.data_directory.as_deref());
    // A path that cannot be resolved (a pipe in /proc) lies in no folder.
    let canonical = |path: &Path| options.store.canonical(path).ok();
    let real: Option<PathBuf> = canonical(found);
    let inside = real.as_ref().is_some_and(|real| folders.filter_map(canonical).any(|folder| real.starts_with(folder)));
    if inside {
        return Ok(());
    }
    let message = format!(
        "`{key} = \"{named}\"` is outside the session's folder: {}",
        real.as_deref().unwrap_or(found).display()
    );
    let help = "a session may read files in its own folder, below it, and in the data folder; copy the file there, or allow files outside \
                if you trust the session";
    Err(Fault::file(message, help))
}
