//! The error type of this crate.

use std::path::PathBuf;

use crate::words::{MAX_QUOTED, cut, shortened};

/// A location in the user's files.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Location {
    /// The file as the user named it.
    pub file: PathBuf,
    /// Line, from 1; 0 for the whole file.
    pub line: usize,
    /// The bytes of the file to which the message refers, if known.
    pub span: Option<std::ops::Range<usize>>,
}

impl Location {
    /// The whole file.
    pub fn file(file: &std::path::Path) -> Location {
        Location { file: file.to_path_buf(), ..Location::default() }
    }

    /// A line of the file.
    pub fn line(file: &std::path::Path, line: usize) -> Location {
        Location { line, ..Location::file(file) }
    }

    /// The column, from 1, in the content of the file: characters from the start of the line.
    pub fn column(&self, contents: &[u8]) -> Option<usize> {
        let before = contents.get(..self.span.as_ref()?.start)?;
        let line = before.rsplit(|byte| *byte == b'\n').next().unwrap_or(before);
        Some(String::from_utf8_lossy(line).chars().count() + 1)
    }
}

impl std::fmt::Display for Location {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}", self.file.display())?;
        if self.line > 0 {
            write!(formatter, ":{}", self.line)?;
        }
        Ok(())
    }
}

/// Errors of a machine, a session or its readings.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// An invalid structural code.
    #[error(
        "structural code `{}`: {}; a code goes from workpiece over bed to tool, as in `w C A b Y X Z t`",
        cut(code, MAX_QUOTED),
        shortened(found)
    )]
    StructuralCode {
        /// The code as given.
        code: String,
        /// The fault.
        found: String,
    },
    /// An axis whose kind does not follow from its name.
    #[error(
        "axis `{}` is not an ISO 841 letter; state its `kind` (\"rotary\" or \"linear\") and `direction`",
        cut(axis, MAX_QUOTED)
    )]
    UnknownAxisKind {
        /// The axis.
        axis: String,
    },
    /// Unusable input, with its location and a remedy.
    #[error("{location}: {}", shortened(message))]
    Input {
        /// File and line.
        location: Location,
        /// What was found and what was expected.
        message: String,
        /// What to do.
        help: Option<String>,
    },
    /// A file that does not exist in the searched folders, or lies outside the folders that a session may read. Other
    /// options for reading (a data folder, files outside allowed) may remedy it.
    #[error("{location}: {}", shortened(message))]
    FileAccess {
        /// File and line that name it.
        location: Location,
        /// What was found and what was expected.
        message: String,
        /// What to do.
        help: String,
    },
    /// A foreign file of readings that is not understood. What the caller says of its columns or of the instrument may remedy
    /// it.
    #[error("{location}: {}", shortened(message))]
    Foreign {
        /// The file.
        location: Location,
        /// What was found, and the layout in which the file was read.
        message: String,
        /// What to do.
        help: String,
    },
    /// An invalid part of a session that is built in memory.
    #[error("{}", shortened(message))]
    Session {
        /// What was found and what was expected.
        message: String,
        /// What to do.
        help: String,
    },
    /// A plan that the machine cannot carry out.
    #[error("{}", shortened(message))]
    Plan {
        /// The test and the obstacle.
        message: String,
        /// What to do.
        help: String,
    },
    /// A file that could not be written.
    #[error("{}: cannot be written: {cause}", file.display())]
    Output {
        /// The file.
        file: PathBuf,
        /// The message of the operating system.
        cause: String,
    },
}

impl ModelError {
    /// The location of the fault in the user's files, if it is in one.
    pub fn location(&self) -> Option<&Location> {
        match self {
            ModelError::Input { location, .. }
            | ModelError::FileAccess { location, .. }
            | ModelError::Foreign { location, .. } => Some(location),
            _ => None,
        }
    }

    /// The remedy, if it is not part of the message.
    pub fn help(&self) -> Option<&str> {
        match self {
            ModelError::Input { help, .. } => help.as_deref(),
            ModelError::FileAccess { help, .. }
            | ModelError::Foreign { help, .. }
            | ModelError::Plan { help, .. }
            | ModelError::Session { help, .. } => Some(help),
            _ => None,
        }
    }
}
