//! Files that are written whole or not at all.

use std::io::Write;
use std::path::Path;

use super::failure::Failure;

/// Writes a file through a temporary one beside it, so that a reader finds the old file or the whole new one.
pub fn write_whole(path: &Path, contents: &[u8]) -> Result<(), Failure> {
    let fault = |source| Failure::Write {
        path: path.display().to_string(),
        source,
    };
    let folder = check(path)?;
    let mut builder = tempfile::Builder::new();
    // As any other new file: what the user's mask lets through.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder).map_err(fault)?;
    file.write_all(contents).map_err(fault)?;
    file.as_file().sync_all().map_err(fault)?;
    file.persist(path).map_err(|error| fault(error.error))?;
    Ok(())
}

/// The folder that a file is to lie in; an error where there is none.
pub fn check(path: &Path) -> Result<&Path, Failure> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if path.is_dir() {
        return Err(Failure::Other(format!(
            "{}: cannot be written: this is a folder; name a file in it",
            path.display()
        )));
    }
    if !folder.is_dir() {
        return Err(Failure::Other(format!(
            "{}: cannot be written: there is no folder {}; make it first, or name another",
            path.display(),
            folder.display()
        )));
    }
    Ok(folder)
}

/// Writes a line to standard output; the end of the program where nobody reads on.
pub fn line(text: std::fmt::Arguments<'_>) {
    let mut out = std::io::stdout().lock();
    if writeln!(out, "{text}").is_err() {
        std::process::exit(0);
    }
}

/// A table as CSV: cells that hold a separator stand in quotes.
pub fn csv(header: &[String], rows: impl IntoIterator<Item = Vec<String>>) -> Result<Vec<u8>, Failure> {
    let fault = |error: String| Failure::Other(format!("the table cannot be written as CSV: {error}"));
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer
        .write_record(header)
        .map_err(|error| fault(error.to_string()))?;
    for row in rows {
        writer
            .write_record(row)
            .map_err(|error| fault(error.to_string()))?;
    }
    writer.into_inner().map_err(|error| fault(error.to_string()))
}

/// Writes a result as JSON.
pub fn write_json<T: serde::Serialize>(path: &Path, result: &T) -> Result<(), Failure> {
    let mut text = serde_json::to_string_pretty(result)
        .map_err(|error| Failure::Other(format!("the result cannot be written as JSON: {error}")))?;
    text.push('\n');
    write_whole(path, text.as_bytes())
}
