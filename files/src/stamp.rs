//! Input files as they were read: a result refers to exactly the bytes from which it follows.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use abbe_model::diagnostic::{Diagnostic, Location};

use super::store::{FileState, OpenFile, ReadBytes};

/// A file that was read once: a regular file, a pipe or a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileStamp {
    /// The file as named by the user or a session.
    pub file: PathBuf,
    /// Its state when it was opened.
    state: FileState,
    /// What was read, from the end of reading on.
    read: Arc<OnceLock<ReadBytes>>,
}

impl FileStamp {
    pub(crate) fn of(file: &Path, state: FileState) -> FileStamp {
        FileStamp { file: file.to_path_buf(), state, read: Arc::default() }
    }

    /// The bytes that were read; `None` while the file is being read.
    pub fn read(&self) -> Option<ReadBytes> {
        self.read.get().copied()
    }

    /// SHA-256 of the bytes that were read, in hexadecimal; `None` while the file is being read.
    pub fn sha256(&self) -> Option<String> {
        Some(self.read()?.sha256.iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// Notes what was read. Returns an error if the open file has changed since it was opened.
    pub(crate) fn finish(&self, opened: &OpenFile) -> Result<(), Diagnostic> {
        match opened.state() {
            Ok(found) if found == self.state || !self.state.regular => {
                let _ = self.read.set(opened.read_bytes());
                Ok(())
            }
            _ => Err(Diagnostic::input(
                Location::file(&self.file),
                "the file changed while it was read",
                "wait until it is written and try again",
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;
    use crate::store::Store;

    #[test]
    fn the_checksum_is_that_of_the_bytes_that_were_read() {
        // FIPS 180-4, example of the message "abc".
        let store = Store::in_memory([("abc", b"abc".to_vec())]);
        let mut opened = store.open("abc".as_ref()).unwrap();
        let stamp = FileStamp::of("abc".as_ref(), opened.state().unwrap());
        assert_eq!(stamp.sha256(), None);
        let mut text = String::new();
        opened.read_to_string(&mut text).unwrap();
        stamp.clone().finish(&opened).unwrap();
        assert_eq!(stamp.read().unwrap().count, 3);
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(stamp.sha256().as_deref(), Some(expected));
    }
}
