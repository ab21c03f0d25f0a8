//! State of input files when they were read, so that a result refers to exactly these inputs.

use std::path::{Path, PathBuf};

use super::store::{FileState, OpenFile, Store};
use crate::error::{Location, ModelError};

/// The state of a file when it was opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileStamp {
    /// The file as named by the user or a session.
    pub file: PathBuf,
    state: FileState,
    store: Store,
}

impl FileStamp {
    pub(crate) fn of(file: &Path, state: FileState, store: &Store) -> FileStamp {
        FileStamp { file: file.to_path_buf(), state, store: store.clone() }
    }

    /// The content of the file.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(&self) -> std::io::Result<Vec<u8>> {
        self.store.read(&self.file)
    }

    /// Whether it is a regular file, not a pipe or a device whose bytes can be read only once.
    pub fn is_regular(&self) -> bool {
        self.state.regular
    }

    /// Returns an error if the open file has changed since it was opened.
    pub(crate) fn check(&self, opened: &OpenFile) -> Result<(), ModelError> {
        match opened.state() {
            Ok(found) if found == self.state || !self.state.regular => Ok(()),
            _ => Err(ModelError::Input {
                location: Location::file(&self.file),
                message: "the file changed while it was read".into(),
                help: Some("wait until it is written and try again".into()),
            }),
        }
    }

    /// A description of the change if the file has changed since it was read.
    pub fn changed(&self) -> Option<String> {
        match self.store.state(&self.file) {
            _ if !self.state.regular => Some("it is a pipe or a device, which can be read only once".into()),
            Err(cause) => Some(format!("it no longer exists: {cause}")),
            Ok(found) if found == self.state => None,
            Ok(_) => Some("it has changed since it was read".into()),
        }
    }
}
