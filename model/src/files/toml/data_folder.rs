//! Access control: a session may read files beside itself, below, and in the data folder.
//!
//! A session from an untrusted source must not be able to name `../../secret.csv` and show its content in a message or
//! a report. The check uses the real location of a file, with symbolic links and `..` resolved.

use std::path::{Path, PathBuf};

use super::ReadOptions;
use crate::error::ModelError;
use crate::files::toml::document::Value;

/// The folder to which the names in a session are relative.
pub(super) fn folder(session: &Path) -> &Path {
    match session.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Returns an error unless the session may read the file.
pub(super) fn check(session: &Path, options: &ReadOptions, named: &Value<'_>, found: &Path) -> Result<(), ModelError> {
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
        "`{} = \"{}\"` is outside the session's folder: {}",
        named.key,
        named.as_text().unwrap_or(""),
        real.as_deref().unwrap_or(found).display()
    );
    let help = "a session may read files in its own folder, below it, and in the data folder; copy the file there, or allow files outside \
                if you trust the session";
    Err(named.file_error(message, help))
}
