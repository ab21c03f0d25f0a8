//! Where files lie: on the disk, or in memory. A page in a browser has no disk.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Cursor, ErrorKind, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use sha2::{Digest, Sha256};

/// Where the files of a session lie.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Store {
    /// On the disk.
    #[default]
    Disk,
    /// In memory, by their paths.
    Memory(Arc<BTreeMap<PathBuf, Arc<[u8]>>>),
}

/// What is known of a file without its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FileState {
    pub bytes: u64,
    pub modified: Option<SystemTime>,
    pub regular: bool,
    pub folder: bool,
}

impl Store {
    /// Files in memory: relative paths with their contents. Of two files with one path, the later one is kept.
    ///
    /// ```
    /// use abbe_files::store::Store;
    ///
    /// let store = Store::in_memory([("data/A.csv", b"a_deg\n".to_vec())]);
    /// assert_eq!(store.read("sessions/../data/A.csv".as_ref())?, b"a_deg\n");
    /// # Ok::<(), std::io::Error>(())
    /// ```
    pub fn in_memory<P: AsRef<Path>>(files: impl IntoIterator<Item = (P, Vec<u8>)>) -> Store {
        let files = files.into_iter().map(|(path, contents)| (plain(path.as_ref()), Arc::from(contents)));
        Store::Memory(Arc::new(files.collect()))
    }

    /// The content of a file.
    ///
    /// # Errors
    /// If there is no such file, or it cannot be read.
    pub fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        match self {
            Store::Disk => std::fs::read(path),
            Store::Memory(files) => Ok(contents(files, path)?.to_vec()),
        }
    }

    /// Opens a file.
    pub(crate) fn open(&self, path: &Path) -> io::Result<OpenFile> {
        match self {
            Store::Disk => File::open(path).map(|file| OpenFile::new(Bytes::Disk(file))),
            Store::Memory(files) => {
                contents(files, path).map(|contents| OpenFile::new(Bytes::Memory(Cursor::new(contents))))
            }
        }
    }

    /// The state of a file or a folder.
    pub(crate) fn state(&self, path: &Path) -> io::Result<FileState> {
        let Store::Memory(files) = self else {
            return std::fs::metadata(path).map(|found| FileState::of_disk(&found));
        };
        let path = plain(path);
        match files.get(&path) {
            Some(contents) => Ok(FileState::in_memory(contents.len())),
            None if files.keys().any(|file| file.starts_with(&path)) => {
                Ok(FileState { regular: false, folder: true, ..FileState::in_memory(0) })
            }
            None => Err(not_found()),
        }
    }

    /// Whether there is a file or a folder of this path.
    pub(crate) fn exists(&self, path: &Path) -> bool {
        self.state(path).is_ok()
    }

    /// The path without links, `.` and `..`.
    pub(crate) fn canonical(&self, path: &Path) -> io::Result<PathBuf> {
        match self {
            Store::Disk => path.canonicalize(),
            // Files in memory have no links, and above their root there is nothing.
            Store::Memory(_) => Ok(plain(path)),
        }
    }
}

impl FileState {
    fn of_disk(found: &std::fs::Metadata) -> FileState {
        FileState {
            bytes: found.len(),
            modified: found.modified().ok(),
            regular: found.is_file(),
            folder: found.is_dir(),
        }
    }

    fn in_memory(bytes: usize) -> FileState {
        FileState { bytes: bytes as u64, modified: None, regular: true, folder: false }
    }
}

/// The bytes that were read from a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadBytes {
    /// Their number.
    pub count: u64,
    /// Their SHA-256.
    pub sha256: [u8; 32],
}

/// A file that is open for reading. It counts and hashes the bytes that are read.
pub(crate) struct OpenFile {
    bytes: Bytes,
    count: u64,
    hash: Sha256,
}

enum Bytes {
    Disk(File),
    Memory(Cursor<Arc<[u8]>>),
}

impl OpenFile {
    fn new(bytes: Bytes) -> OpenFile {
        OpenFile { bytes, count: 0, hash: Sha256::new() }
    }

    /// Its state.
    pub fn state(&self) -> io::Result<FileState> {
        match &self.bytes {
            Bytes::Disk(file) => file.metadata().map(|found| FileState::of_disk(&found)),
            Bytes::Memory(contents) => Ok(FileState::in_memory(contents.get_ref().len())),
        }
    }

    /// What has been read.
    pub fn read_bytes(&self) -> ReadBytes {
        ReadBytes { count: self.count, sha256: self.hash.clone().finalize().into() }
    }
}

impl Read for OpenFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = match &mut self.bytes {
            Bytes::Disk(file) => file.read(buffer)?,
            Bytes::Memory(contents) => contents.read(buffer)?,
        };
        self.hash.update(&buffer[..count]);
        self.count += count as u64;
        Ok(count)
    }
}

/// The content of a file in memory.
fn contents(files: &BTreeMap<PathBuf, Arc<[u8]>>, path: &Path) -> io::Result<Arc<[u8]>> {
    files.get(&plain(path)).cloned().ok_or_else(not_found)
}

fn not_found() -> io::Error {
    io::Error::new(ErrorKind::NotFound, "there is no such file")
}

/// A path without `.` and, as far as it goes, without `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(plain.components().next_back(), Some(Component::Normal(_))) => {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    fn store() -> Store {
        Store::in_memory([("a/session.toml", b"1".to_vec()), ("machine.toml", b"22".to_vec())])
    }

    #[test]
    fn files_in_memory_are_found_by_any_form_of_their_path() {
        for path in ["machine.toml", "./machine.toml", "a/../machine.toml", "a/b/../.././machine.toml"] {
            assert_eq!(store().read(Path::new(path)).unwrap(), b"22", "{path}");
        }
        for path in ["../machine.toml", "/machine.toml", "a", "other.toml", ""] {
            assert_eq!(store().read(Path::new(path)).unwrap_err().kind(), ErrorKind::NotFound, "{path}");
        }
    }

    #[test]
    fn a_folder_in_memory_is_what_files_lie_in() {
        assert!(store().state(Path::new("a")).unwrap().folder);
        assert!(store().state(Path::new("./a/..")).unwrap().folder);
        assert_eq!(store().state(Path::new("machine.toml")).unwrap().bytes, 2);
        assert!(!store().exists(Path::new("b")));
    }
}
