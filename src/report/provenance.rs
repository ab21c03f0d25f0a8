//! Provenance of a report: input files with checksums, version, command line and seed.

use abbe::files::SourceMap;
use abbe::files::stamp::FileStamp;
use abbe::model::session::Session;

/// An input file.
pub struct Input {
    /// Path, as given to the command.
    pub path: String,
    /// Size, bytes.
    pub bytes: u64,
    /// SHA-256, in hexadecimal.
    pub sha256: String,
}

/// Provenance of a report.
pub struct Provenance {
    /// Command line.
    pub command: String,
    /// Seed, if there are random numbers.
    pub seed: Option<u64>,
    /// Input files.
    pub inputs: Vec<Input>,
    /// Notes of the table `[about]` of the session file, with their names.
    pub about: Vec<(String, String)>,
}

impl Provenance {
    /// Provenance of the command line of this process, without files.
    pub fn of_command(seed: Option<u64>) -> Provenance {
        let arguments = std::env::args_os().map(|argument| quoted(argument.to_string_lossy().into_owned()));
        let command = arguments.collect::<Vec<_>>().join(" ");
        Provenance { command, seed, inputs: Vec::new(), about: Vec::new() }
    }

    /// Provenance of a session with its sources.
    pub fn of(read: (&Session, &SourceMap), seed: u64) -> Provenance {
        let mut found = Provenance::of_command(Some(seed));
        found.add(read);
        found
    }

    /// Adds a session: its files, and the notes of the first one.
    pub fn add(&mut self, (session, sources): (&Session, &SourceMap)) {
        if self.inputs.is_empty() {
            self.about.clone_from(&session.about);
        }
        self.inputs.extend(sources.files.iter().map(Input::of));
    }
}

impl Input {
    /// A file with the size and the checksum of the bytes that were read.
    pub fn of(stamp: &FileStamp) -> Input {
        Input {
            path: stamp.file.display().to_string(),
            bytes: stamp.read().map_or(0, |read| read.count),
            sha256: stamp.sha256().unwrap_or_default(),
        }
    }
}

/// Quotes an argument for a shell.
pub(super) fn quoted(argument: String) -> String {
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
    fn arguments_are_quoted_for_a_shell() {
        assert_eq!(quoted("a b'c".to_string()), r"'a b'\''c'");
        assert_eq!(quoted("--data=/x/y.csv".to_string()), "--data=/x/y.csv");
    }
}
