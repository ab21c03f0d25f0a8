//! What it takes to do the same again: inputs with checksums, version, command line, seed.

use std::path::PathBuf;

use abbe::model::files::SourceMap;
use abbe::model::session::Session;
use sha2::{Digest, Sha256};

/// An input file.
pub struct Input {
    /// Where it lies, as the command was given it.
    pub path: String,
    /// Bytes.
    pub bytes: usize,
    /// SHA-256, in hexadecimal.
    pub sha256: String,
}

/// Where a report comes from.
pub struct Provenance {
    /// The command line.
    pub command: String,
    /// The seed.
    pub seed: u64,
    /// The inputs.
    pub inputs: Vec<Input>,
    /// Notes of the session file's `[about]`, by name.
    pub about: Vec<(String, String)>,
}

impl Provenance {
    /// Of a session that was read, with its sources.
    ///
    /// # Errors
    /// If a file is not what was read a moment ago, so that a checksum would be that of something else: its path, and why.
    pub fn of(
        (session, sources): (&Session, &SourceMap),
        seed: u64,
    ) -> Result<Provenance, (PathBuf, String)> {
        let inputs = sources
            .files
            .iter()
            .map(|stamp| {
                let same = || stamp.changed().map_or(Ok(()), Err);
                same()?;
                let found = input(stamp.file.clone()).map_err(|cause| cause.to_string())?;
                same()?;
                Ok(found)
            })
            .zip(&sources.files)
            .map(|(found, stamp)| found.map_err(|fault| (stamp.file.clone(), fault)))
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

fn input(path: PathBuf) -> std::io::Result<Input> {
    let contents = std::fs::read(&path)?;
    Ok(Input {
        path: path.display().to_string(),
        bytes: contents.len(),
        sha256: Sha256::digest(&contents)
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect(),
    })
}

/// An argument as a shell takes it.
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
    fn a_checksum_is_that_of_the_standard() {
        // FIPS 180-4, example of the message "abc".
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("abc");
        std::fs::write(&path, "abc").unwrap();
        let found = input(path).unwrap();
        assert_eq!(
            found.sha256,
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }

    #[test]
    fn arguments_come_back_as_a_shell_takes_them() {
        assert_eq!(quoted("a b'c".to_string()), r"'a b'\''c'");
        assert_eq!(quoted("--data=/x/y.csv".to_string()), "--data=/x/y.csv");
    }
}
