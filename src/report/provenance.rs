//! What it takes to do the same again: inputs with checksums, version, command line, seed.

use std::path::{Path, PathBuf};

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
}

impl Provenance {
    /// Of a session that was read.
    ///
    /// # Errors
    /// If a file that was read a moment ago can no longer be read: its path, and why.
    pub fn of(session: &Session, seed: u64) -> Result<Provenance, (PathBuf, std::io::Error)> {
        let mut paths = vec![session.file.clone()];
        paths.extend(machine_file(&session.file));
        for test in &session.tests {
            let file = test.readings.as_ref().map(|readings| readings.file.clone());
            // Planned states come from no file.
            if let Some(file) = file.filter(|file| !file.as_os_str().is_empty() && !paths.contains(file)) {
                paths.push(file);
            }
        }
        let inputs = paths.into_iter().map(input).collect::<Result<_, _>>()?;
        Ok(Provenance {
            command: std::env::args().map(quoted).collect::<Vec<_>>().join(" "),
            seed,
            inputs,
        })
    }
}

fn input(path: PathBuf) -> Result<Input, (PathBuf, std::io::Error)> {
    let contents = std::fs::read(&path).map_err(|error| (path.clone(), error))?;
    Ok(Input {
        path: path.display().to_string(),
        bytes: contents.len(),
        sha256: Sha256::digest(&contents)
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect(),
    })
}

/// The machine's file, where the session names one: it says so in `[machine] file`.
fn machine_file(session: &Path) -> Option<PathBuf> {
    let text = std::fs::read_to_string(session).ok()?;
    let table: toml::Table = text.parse().ok()?;
    let name = table.get("machine")?.get("file")?.as_str()?;
    Some(session.parent().unwrap_or(Path::new("")).join(name))
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
