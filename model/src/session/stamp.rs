//! Files as they were when they were read: a result that names its inputs has to mean those.

use std::fs::{File, Metadata};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::error::{ModelError, Place};

/// A file as it was when it was opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileStamp {
    /// The file as the user or a session named it.
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

    /// Whether a whole file lies there, rather than a pipe or a device whose bytes are gone once they are read.
    pub fn is_regular(&self) -> bool {
        self.regular
    }

    /// An error unless the open file still is what it was when it was opened.
    pub(crate) fn check(&self, opened: &File) -> Result<(), ModelError> {
        match opened.metadata() {
            Ok(found) if FileStamp::of(&self.file, &found) == *self || !self.regular => Ok(()),
            _ => Err(ModelError::Input {
                place: Place::file(&self.file),
                message: "the file changed while it was read".into(),
                help: Some("wait until it is written, and try again".into()),
            }),
        }
    }

    /// What the file is now, if it is no longer what was read.
    pub fn changed(&self) -> Option<String> {
        match std::fs::metadata(&self.file) {
            _ if !self.regular => {
                Some("it is no file but a pipe or a device, which can be read only once".into())
            }
            Err(cause) => Some(format!("it is no longer there: {cause}")),
            Ok(found) if FileStamp::of(&self.file, &found) == *self => None,
            Ok(_) => Some("it has changed since it was read".into()),
        }
    }
}
