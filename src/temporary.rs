//! Temporary files and folders beside the places that they will take, so that a reader finds the old file or the whole
//! new one.
//!
//! A temporary file is locked while its process writes it. The lock ends with the process, however it ends: what is not
//! locked is stale, and [`remove_stale`] removes it.

use std::cell::Cell;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::{NamedTempFile, TempDir, TempPath};

/// First characters of the name of a temporary file or folder.
const PREFIX: &str = ".abbe-";
/// Random letters and digits of the name: so many that no name of a user is like it.
const RANDOM: usize = 16;
/// Last characters of the name of a temporary file.
const SUFFIX: &str = ".tmp";
/// Last characters of the name of a claim.
const CLAIM: &str = ".claim";
/// Digits of the SHA-256 that a claim is named by.
const DIGITS: usize = 64;
/// The locked file of a temporary folder.
const LOCK: &str = "lock";
/// Attempts to make a file that no other process removes before it is locked, and to remove a folder that grows.
const ATTEMPTS: usize = 100;

/// Time between two attempts.
const WAIT: std::time::Duration = std::time::Duration::from_millis(1);

/// The temporary files and folders of this process. A signal ends the whole process, and so its handler has to know
/// them all.
static OWN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A temporary file. It is removed when it is dropped.
pub struct TemporaryFile {
    file: NamedTempFile,
    _noted: Noted,
}

impl TemporaryFile {
    /// A new file in a folder, with the permissions of any other new file.
    ///
    /// # Errors
    /// If it cannot be made. The message does not name it: the caller knows the file that was asked for.
    pub fn in_folder(folder: &Path) -> io::Result<TemporaryFile> {
        // `tempfile` adds the path of the temporary file to an error, and drops its code.
        let code = Cell::new(None);
        let open = |path: &Path| {
            let file = OpenOptions::new().read(true).write(true).create_new(true).open(path);
            file.inspect_err(|error| code.set(error.raw_os_error()))
        };
        let make = || {
            let made = tempfile::Builder::new().prefix(PREFIX).suffix(SUFFIX).rand_bytes(RANDOM).make_in(folder, open);
            made.map_err(|error| code.get().map_or(error, io::Error::from_raw_os_error))
        };
        for _ in 0..ATTEMPTS {
            let file = TemporaryFile::noted(make)?;
            if is_own(file.as_file(), file.file.path())? {
                return Ok(file);
            }
        }
        Err(io::Error::other("another process removes the temporary files"))
    }

    /// The claim of a SHA-256 in a folder, a locked file: `None` if another process or thread has claimed it. It ends with
    /// its process, on whatever computer. On a file system without locks every claim is granted.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn claim(folder: &Path, sha256: &str) -> io::Result<Option<TemporaryFile>> {
        let place = folder.join(format!(".{sha256}{CLAIM}"));
        let file = OpenOptions::new().create(true).truncate(false).write(true).open(&place)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => Ok(None),
            // Removed before it is unlocked: who has opened it meanwhile looks for the result again.
            Ok(()) | Err(TryLockError::Error(_)) => {
                TemporaryFile::noted(|| Ok(NamedTempFile::from_parts(file, TempPath::try_from_path(place)?))).map(Some)
            }
        }
    }

    fn noted(make: impl FnOnce() -> io::Result<NamedTempFile>) -> io::Result<TemporaryFile> {
        let (file, noted) = noted(make, |file| file.path())?;
        Ok(TemporaryFile { file, _noted: noted })
    }

    /// The file itself.
    pub fn as_file(&self) -> &File {
        self.file.as_file()
    }

    /// Moves the file to its place.
    ///
    /// # Errors
    /// If it cannot be moved; it is removed then.
    pub fn persist(self, place: &Path) -> io::Result<()> {
        self.file.persist(place).map(drop).map_err(|error| error.error)
    }
}

impl Write for TemporaryFile {
    fn write(&mut self, contents: &[u8]) -> io::Result<usize> {
        self.file.as_file_mut().write(contents)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_file_mut().flush()
    }
}

/// A temporary folder. It is removed, with all in it, when it is dropped.
pub struct TemporaryFolder {
    folder: TempDir,
    _lock: File,
    _noted: Noted,
}

impl TemporaryFolder {
    /// A new folder in a folder.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn in_folder(folder: &Path) -> io::Result<TemporaryFolder> {
        for _ in 0..ATTEMPTS {
            // Without the path of the temporary folder, which `tempfile` adds to an error.
            let builder = || {
                let made = tempfile::Builder::new().prefix(PREFIX).rand_bytes(RANDOM).tempdir_in(folder);
                made.map_err(|error| error.kind().into())
            };
            let (made, noted) = noted(builder, TempDir::path)?;
            let place = made.path().join(LOCK);
            let lock = match File::create_new(&place) {
                Ok(lock) => lock,
                // Another process has taken the empty folder for a stale one.
                Err(fault) if fault.kind() == io::ErrorKind::NotFound => continue,
                Err(fault) => return Err(fault),
            };
            if is_own(&lock, &place)? {
                return Ok(TemporaryFolder { folder: made, _lock: lock, _noted: noted });
            }
        }
        Err(io::Error::other("another process removes the temporary folders"))
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// An entry of [`OWN`], which ends with the file.
struct Noted(PathBuf);

impl Drop for Noted {
    fn drop(&mut self) {
        let mut own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
        own.retain(|path| *path != self.0);
    }
}

/// Makes a file or a folder and notes its path, without a moment between in which a signal could end the process.
fn noted<T>(make: impl FnOnce() -> io::Result<T>, path: impl Fn(&T) -> &Path) -> io::Result<(T, Noted)> {
    let mut own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
    let made = make()?;
    let path = path(&made).to_path_buf();
    own.push(path.clone());
    Ok((made, Noted(path)))
}

/// Locks a new file. `false` if another process has taken it for a stale one.
fn is_own(file: &File, path: &Path) -> io::Result<bool> {
    match file.try_lock() {
        Ok(()) => Ok(path.exists()),
        Err(TryLockError::WouldBlock) => Ok(false),
        // A file system without locks: no process removes files there either.
        Err(TryLockError::Error(_)) => Ok(true),
    }
}

/// Removes the temporary files and folders of this process, which must end now: no more can be made.
pub fn remove_own() {
    let own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
    for path in own.iter() {
        for _ in 0..ATTEMPTS {
            // Another thread may move it to its place meanwhile, or add a file to it until it needs a new temporary one.
            let _ = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
            if !path.exists() {
                break;
            }
            std::thread::sleep(WAIT);
        }
    }
    std::mem::forget(own);
}

/// Removes the temporary files, folders and claims in a folder that no process holds. What cannot be removed stays.
pub fn remove_stale(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.filter_map(Result::ok) {
        let name = entry.file_name();
        let Some(name) = name.to_str() else { continue };
        let rest = name.strip_prefix(PREFIX);
        let is_file = || is_claim(name) || rest.and_then(|rest| rest.strip_suffix(SUFFIX)).is_some_and(is_random);
        match entry.file_type() {
            Ok(kind) if kind.is_file() && is_file() => remove_unlocked(&entry.path(), &entry.path()),
            Ok(kind) if kind.is_dir() && rest.is_some_and(is_random) => remove_folder(&entry.path()),
            _ => {}
        }
    }
}

/// Whether a name is that of the claim of a checksum.
fn is_claim(name: &str) -> bool {
    let checksum = name.strip_prefix('.').and_then(|name| name.strip_suffix(CLAIM));
    checksum.is_some_and(|text| text.len() == DIGITS && text.bytes().all(|byte| byte.is_ascii_hexdigit()))
}

/// Whether a part of a name is the random one of a temporary file or folder.
fn is_random(part: &str) -> bool {
    part.len() == RANDOM && part.bytes().all(|byte| byte.is_ascii_alphanumeric())
}

/// Removes a temporary folder if its lock is free. One without its lock is empty: it has just been made, or the process
/// ended then.
fn remove_folder(path: &Path) {
    if std::fs::remove_dir(path).is_err() {
        remove_unlocked(&path.join(LOCK), path);
    }
}

/// Removes a file or a folder if its lock is free.
fn remove_unlocked(lock: &Path, path: &Path) {
    let Ok(file) = OpenOptions::new().read(true).write(true).open(lock) else { return };
    if file.try_lock().is_ok() {
        let _ = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
    }
}

/// All files in a folder and the folders within it, in the order of their names.
///
/// # Errors
/// If a folder cannot be read.
pub fn files_below(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    entries.sort();
    let mut files = Vec::new();
    for entry in entries {
        if entry.is_dir() {
            files.extend(files_below(&entry)?);
        } else {
            files.push(entry);
        }
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_process_holds_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let [file, empty, full] =
            ["aBcDeFgHiJkLmNo1", "aBcDeFgHiJkLmNo2", "aBcDeFgHiJkLmNo3"].map(|r| format!(".abbe-{r}"));
        std::fs::write(at(&format!("{file}.tmp")), "stale").unwrap();
        std::fs::create_dir(at(&empty)).unwrap();
        std::fs::create_dir(at(&full)).unwrap();
        std::fs::write(at(&format!("{full}/lock")), "").unwrap();
        std::fs::write(at(&format!("{full}/readings.csv")), "stale").unwrap();
        // Files of others.
        let others =
            [".notes.claim", ".abbe-notes.txt", ".abbe-1.tmp", ".abbe-report.tmp", ".tmpAbCdEf", "session.toml"];
        for other in others {
            std::fs::write(at(other), "other").unwrap();
        }
        std::fs::create_dir(at(".abbe-results")).unwrap();
        let held = TemporaryFile::in_folder(folder.path()).unwrap();
        let held_folder = TemporaryFolder::in_folder(folder.path()).unwrap();
        remove_stale(folder.path());
        let mut left: Vec<PathBuf> =
            std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
        left.sort();
        let mut kept: Vec<PathBuf> = others.into_iter().chain([".abbe-results"]).map(at).collect();
        kept.extend([held.file.path().to_path_buf(), held_folder.path().to_path_buf()]);
        kept.sort();
        assert_eq!(left, kept);
        held.persist(&at("held")).unwrap();
        drop(held_folder);
        remove_stale(folder.path());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 8);
    }

    #[test]
    fn an_error_does_not_name_the_temporary_file() {
        let missing = Path::new("/nowhere/at/all");
        let Err(fault) = TemporaryFile::in_folder(missing) else { panic!("the folder does not exist") };
        assert!(!fault.to_string().contains(PREFIX), "{fault}");
        assert!(fault.raw_os_error().is_some());
    }
}
