//! Files that are written as a whole or not at all.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use crate::error::ModelError;

/// Writes a file atomically: a temporary file in the same folder is renamed.
///
/// # Errors
/// If it cannot be written; the previous file then remains.
pub fn write(path: &Path, text: &str) -> Result<(), ModelError> {
    let fault = |cause: std::io::Error| ModelError::Output { file: path.to_path_buf(), cause: cause.to_string() };
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.part", std::process::id()));
    let part: PathBuf = path.with_file_name(name);
    let written = std::fs::File::create(&part).and_then(|mut file| {
        file.write_all(text.as_bytes())?;
        file.sync_all()
    });
    let renamed = written.and_then(|()| std::fs::rename(&part, path));
    renamed.map_err(|cause| {
        // Remove the incomplete file; a failure to remove it is not reported.
        let _ = std::fs::remove_file(&part);
        fault(cause)
    })
}
