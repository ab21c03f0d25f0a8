//! State of input files when they were read, so that a result refers to exactly these inputs.

use std::fs::{File, Metadata};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::error::{Location, ModelError};

/// The state of a file when it was opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileStamp {
    /// The file as named by the user or a session.
    pub file: PathBuf,
    bytes: u64,
    modified: Option<SystemTime>,
    regular: bool,
}

impl FileStamp {
    pub(crate) fn of(file: &Path, found: &Metadata) -> FileStamp {
        FileStamp {
            file: file.to_path_buf(),
            bytes: found.len(),
            modified: found.modified().ok(),
            regular: found.is_file(),
        }
    }

    /// Whether it is a regular file, not a pipe or a device whose bytes can be read only once.
    pub fn is_regular(&self) -> bool {
        self.regular
    }

    /// Returns an error if the open file has changed since it was opened.
    pub(crate) fn check(&self, opened: &File) -> Result<(), ModelError> {
        match opened.metadata() {
            Ok(found) if FileStamp::of(&self.file, &found) == *self || !self.regular => Ok(()),
            _ => Err(ModelError::Input {
                location: Location::file(&self.file),
                message: "the file changed while it was read".into(),
                help: Some("wait until it is written and try again".into()),
            }),
        }
    }

    /// A description of the change if the file has changed since it was read.
    pub fn changed(&self) -> Option<String> {
        match std::fs::metadata(&self.file) {
            _ if !self.regular => Some("it is a pipe or a device, which can be read only once".into()),
            Err(cause) => Some(format!("it no longer exists: {cause}")),
            Ok(found) if FileStamp::of(&self.file, &found) == *self => None,
            Ok(_) => Some("it has changed since it was read".into()),
        }
    }
}
