//! Provenance of a report: input files with checksums, version, command line and seed.

use std::path::{Path, PathBuf};

use abbe::model::files::SourceMap;
use abbe::model::files::stamp::FileStamp;
use abbe::model::session::Session;
use sha2::{Digest, Sha256};

/// An input file.
pub struct Input {
    /// Path, as given to the command.
    pub path: String,
    /// Size, bytes.
    pub bytes: usize,
    /// SHA-256, in hexadecimal.
    pub sha256: String,
}

/// Provenance of a report.
pub struct Provenance {
    /// Command line.
    pub command: String,
    /// Seed.
    pub seed: u64,
    /// Input files.
    pub inputs: Vec<Input>,
    /// Notes of the table `[about]` of the session file, with their names.
    pub about: Vec<(String, String)>,
}

impl Provenance {
    /// Provenance of a session with its sources.
    ///
    /// # Errors
    /// If a file changed after it was read, or cannot be read. The error holds the path and the cause.
    pub fn of((session, sources): (&Session, &SourceMap), seed: u64) -> Result<Provenance, (PathBuf, String)> {
        let inputs = sources
            .files
            .iter()
            .map(stamped)
            .zip(&sources.files)
            .map(|(input, stamp)| input.map_err(|cause| (stamp.file.clone(), cause)))
            .collect::<Result<_, _>>()?;
        Ok(Provenance {
            command: std::env::args_os()
                .map(|argument| quoted(argument.to_string_lossy().into_owned()))
                .collect::<Vec<_>>()
                .join(" "),
            seed,
            inputs,
            about: session.about.clone(),
        })
    }
}

/// A file of a session with its checksum.
///
/// # Errors
/// If the file has changed since the session was read: the change, or why it cannot be read.
pub fn stamped(stamp: &FileStamp) -> Result<Input, String> {
    let unchanged = || stamp.changed().map_or(Ok(()), Err);
    unchanged()?;
    let contents = stamp.read().map_err(|cause| cause.to_string())?;
    unchanged()?;
    Ok(of_contents(&stamp.file, &contents))
}

/// A file with its checksum.
///
/// # Errors
/// If it cannot be read.
pub fn input(path: PathBuf) -> std::io::Result<Input> {
    let contents = std::fs::read(&path)?;
    Ok(of_contents(&path, &contents))
}

/// A file with this content.
fn of_contents(path: &Path, contents: &[u8]) -> Input {
    Input {
        path: path.display().to_string(),
        bytes: contents.len(),
        sha256: Sha256::digest(contents).iter().map(|byte| format!("{byte:02x}")).collect(),
    }
}

/// Quotes an argument for a shell.
fn quoted(argument: String) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+%@~".contains(c);
    if !argument.is_empty() && argument.chars().all(plain) {
        argument
    } else {
        format!("'{}'", argument.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_agree_with_the_standard() {
        // FIPS 180-4, example of the message "abc".
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("abc");
        std::fs::write(&path, "abc").unwrap();
        let found = input(path).unwrap();
        assert_eq!(found.sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }

    #[test]
    fn arguments_are_quoted_for_a_shell() {
        assert_eq!(quoted("a b'c".to_string()), r"'a b'\''c'");
        assert_eq!(quoted("--data=/x/y.csv".to_string()), "--data=/x/y.csv");
    }
}
