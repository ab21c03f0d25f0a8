//! The error type of this crate.

use std::path::PathBuf;

/// Where in the user's files something stands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// The file as the user named it.
    pub file: PathBuf,
    /// Line, from 1; 0 where the whole file is meant.
    pub line: usize,
    /// Bytes of the file that the message points at, where known.
    pub span: Option<std::ops::Range<usize>>,
}

impl Place {
    /// A file as a whole.
    pub fn file(file: &std::path::Path) -> Place {
        Place {
            file: file.to_path_buf(),
            ..Place::default()
        }
    }

    /// A line of a file.
    pub fn line(file: &std::path::Path, line: usize) -> Place {
        Place {
            line,
            ..Place::file(file)
        }
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}", self.file.display())?;
        if self.line > 0 {
            write!(formatter, ":{}", self.line)?;
        }
        Ok(())
    }
}

/// What can be wrong with a machine, a session or its readings.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A structural code that cannot be read.
    #[error(
        "structural code `{code}`: {found}; a code goes from workpiece over bed to tool, as in `w C A b Y X Z t`"
    )]
    StructuralCode {
        /// The code as given.
        code: String,
        /// What is wrong with it.
        found: String,
    },
    /// An axis whose kind its name does not tell.
    #[error(
        "axis `{axis}` is no ISO 841 letter; state its `kind` (\"rotary\" or \"linear\") and `direction`"
    )]
    UnknownAxisKind {
        /// The axis.
        axis: String,
    },
    /// Input that cannot be used, with its place and the way out.
    #[error("{place}: {message}")]
    Input {
        /// File and line.
        place: Place,
        /// What was found and what was expected.
        message: String,
        /// What to do.
        help: Option<String>,
    },
    /// A plan that the machine cannot carry out.
    #[error("{message}")]
    Plan {
        /// Which test, and what keeps it from being carried out.
        message: String,
        /// What to do.
        help: String,
    },
    /// A file that could not be written.
    #[error("{}: cannot be written: {cause}", file.display())]
    Output {
        /// The file.
        file: PathBuf,
        /// What the system said.
        cause: String,
    },
}

impl ModelError {
    /// Where the fault lies in the user's files, where it lies in one.
    pub fn place(&self) -> Option<&Place> {
        match self {
            ModelError::Input { place, .. } => Some(place),
            _ => None,
        }
    }

    /// What to do about it, where more can be said than the message does.
    pub fn help(&self) -> Option<&str> {
        match self {
            ModelError::Input { help, .. } => help.as_deref(),
            ModelError::Plan { help, .. } => Some(help),
            _ => None,
        }
    }
}
