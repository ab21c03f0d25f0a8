//! A folder of records.
//!
//! `results/KEY.json` is the record of the inputs with this key. `sessions/HASH.json` names a session file and the key
//! of its present contents; HASH is that of its absolute path. Each file is written beside its place and renamed, so
//! that a reader finds the whole file or none, whoever writes at the same time. A file that is damaged counts as
//! missing.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use abbe_model::Diagnostic;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::record::{Record, SCHEMA_VERSION};
use super::{ShouldContinue, interrupted, unreadable, unusable, unwritable};
use crate::temporary::{self, TemporaryFile};

/// Records with their sessions, and what has no record: its machine where it is known, and the file.
pub type Records = (Vec<(Pointer, Record)>, Vec<(Option<String>, String)>);

/// A folder of records.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

/// A session file and the record of its present contents.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pointer {
    /// Version of this schema.
    pub schema_version: u32,
    /// The session file, as it was named.
    pub file: String,
    /// Key of its record.
    pub key: String,
    /// Identifier of the session: `session_id` of `[about]`, else the session file.
    pub session_id: String,
    /// Identifier of the machine.
    pub machine_id: String,
    /// Why there is no result; `null` if there is one.
    pub error: Option<String>,
}

impl Pointer {
    /// A session file with its record.
    pub fn new(file: &Path, record: &Record) -> Pointer {
        let file = file.display().to_string();
        Pointer {
            schema_version: SCHEMA_VERSION,
            session_id: record.session_id.clone().unwrap_or_else(|| file.clone()),
            file,
            key: record.key.clone(),
            machine_id: record.machine_id.clone(),
            error: record.error.as_ref().map(|error| error.message.clone()),
        }
    }
}

/// What to do with a session on which another process is at work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IfClaimed {
    /// Skip it.
    Skip,
    /// Wait until the other process has its result, or has ended without it.
    Wait,
}

/// What there is of a record.
pub(crate) enum Search {
    /// The record.
    Found(Box<Record>),
    /// None, and the right to make it.
    Claimed(TemporaryFile),
    /// None, and another process is at work on it.
    Skipped,
}

/// Time between two looks at a record on which another process is at work.
const WAIT: Duration = Duration::from_millis(100);

impl Store {
    /// The folder, made if it does not exist.
    ///
    /// # Errors
    /// If it cannot be made, or is a file.
    pub fn open(folder: impl Into<PathBuf>) -> Result<Store, Diagnostic> {
        let folder = folder.into();
        std::fs::create_dir_all(&folder).map_err(|source| unwritable(&folder, source))?;
        Ok(Store { folder })
    }

    /// An existing folder of records.
    ///
    /// # Errors
    /// If the folder holds no records.
    pub fn existing(folder: impl Into<PathBuf>) -> Result<Store, Diagnostic> {
        let folder = folder.into();
        if !folder.join("sessions").is_dir() {
            let found = "no results of `abbe fleet run` are there";
            return Err(unusable(folder.display(), found, "name its folder of --out"));
        }
        Ok(Store { folder })
    }

    /// The record of a key; `None` if it is missing, damaged or of another schema.
    ///
    /// # Errors
    /// If an existing file cannot be read.
    pub fn record(&self, key: &str) -> Result<Option<Record>, Diagnostic> {
        let Some(contents) = read(&self.place("results", key))? else {
            return Ok(None);
        };
        let record: Option<Record> = serde_json::from_slice(&contents).ok();
        Ok(record.filter(|record| record.key == key && record.schema_version == SCHEMA_VERSION))
    }

    /// Writes a record.
    ///
    /// # Errors
    /// If it cannot be written. Nothing is left of it then.
    pub fn write(&self, record: &Record) -> Result<(), Diagnostic> {
        self.put(&self.place("results", &record.key), record)
    }

    /// Looks for the record of a key, and claims it if it is missing.
    ///
    /// # Errors
    /// If the folder cannot be read or written; `INTERRUPTED` if `should_continue` returned `false` while another process
    /// was at work.
    pub(crate) fn found_or_claimed(
        &self,
        key: &str,
        if_claimed: IfClaimed,
        should_continue: ShouldContinue<'_>,
    ) -> Result<Search, Diagnostic> {
        let place = self.place("results", key);
        let folder = place.parent().unwrap_or(&self.folder);
        let fault = |source| unwritable(&place, source);
        std::fs::create_dir_all(folder).map_err(fault)?;
        let found = || Ok::<_, Diagnostic>(self.record(key)?.map(|record| Search::Found(Box::new(record))));
        loop {
            if let Some(found) = found()? {
                return Ok(found);
            }
            if let Some(claim) = TemporaryFile::claim(folder, key).map_err(fault)? {
                // The other process may have ended its work since the look at the record.
                return Ok(found()?.unwrap_or(Search::Claimed(claim)));
            }
            if if_claimed == IfClaimed::Skip {
                return Ok(Search::Skipped);
            }
            if !should_continue() {
                return Err(interrupted());
            }
            std::thread::sleep(WAIT);
        }
    }

    /// Removes what processes that no longer run have left: temporary files and claims.
    pub fn remove_stale(&self) {
        for kind in ["results", "sessions"] {
            entries(&self.folder.join(kind))
                .unwrap_or_default()
                .iter()
                .for_each(|shard| temporary::remove_stale(shard));
        }
    }

    /// Notes the record of a session file, unless the same note is there. A file has one note, whether it is named by
    /// its relative or its absolute path.
    ///
    /// # Errors
    /// If the note cannot be read or written.
    pub fn note(&self, pointer: &Pointer) -> Result<(), Diagnostic> {
        let place = self.place_of_note(pointer);
        let known = read(&place)?.and_then(|contents| serde_json::from_slice::<Pointer>(&contents).ok());
        if known.as_ref() == Some(pointer) {
            return Ok(());
        }
        self.put(&place, pointer)
    }

    /// The sessions of the folder, by file, and the notes that are damaged or of another version.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn sessions(&self) -> Result<(Vec<Pointer>, Vec<String>), Diagnostic> {
        let (mut found, mut damaged) = (Vec::new(), Vec::new());
        // A file system or its browser may leave files of its own (.DS_Store).
        for shard in entries(&self.folder.join("sessions"))?.into_iter().filter(|shard| shard.is_dir()) {
            for file in entries(&shard)? {
                if file.extension().is_some_and(|extension| extension == "json") {
                    let contents = read(&file)?.unwrap_or_default();
                    let note: Option<Pointer> = serde_json::from_slice(&contents).ok();
                    match note.filter(|note| note.schema_version == SCHEMA_VERSION) {
                        Some(note) => found.push(note),
                        None => damaged.push(file.display().to_string()),
                    }
                }
            }
        }
        found.sort_by(|a, b| a.file.cmp(&b.file));
        damaged.sort();
        Ok((found, damaged))
    }

    /// The records of all sessions, by file, and the files whose record is missing or cannot be read (a killed run left
    /// them), each with its machine, and the damaged notes.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn records(&self) -> Result<Records, Diagnostic> {
        let (sessions, damaged) = self.sessions()?;
        let mut missing: Vec<(Option<String>, String)> = damaged.into_iter().map(|file| (None, file)).collect();
        let mut records = Vec::with_capacity(sessions.len());
        for pointer in sessions {
            match self.record(&pointer.key) {
                Ok(Some(record)) => records.push((pointer, record)),
                Ok(None) | Err(_) => missing.push((Some(pointer.machine_id), pointer.file)),
            }
        }
        Ok((records, missing))
    }

    /// Removes the notes of session files that were in or below these folders, or are these files, and are no longer
    /// there. Returns them. Results stay. A note counts where its file has the absolute path that it had when it was
    /// written.
    ///
    /// # Errors
    /// If the folder cannot be read, or a note cannot be removed.
    pub fn forget_missing(&self, places: &[PathBuf]) -> Result<Vec<String>, Diagnostic> {
        if !self.folder.join("sessions").is_dir() {
            return Ok(Vec::new());
        }
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let places: Vec<PathBuf> = places.iter().map(|place| absolute(place)).collect();
        let mut forgotten = Vec::new();
        for pointer in self.sessions()?.0 {
            let file = absolute(Path::new(&pointer.file));
            let note = self.place_of_note(&pointer);
            let is_gone = matches!(file.try_exists(), Ok(false));
            if is_gone && note.is_file() && places.iter().any(|place| file.starts_with(place)) {
                match std::fs::remove_file(&note) {
                    Err(source) if source.kind() != ErrorKind::NotFound => {
                        return Err(unwritable(&note, source));
                    }
                    _ => forgotten.push(pointer.file),
                }
            }
        }
        Ok(forgotten)
    }

    /// The place of the note of a session file: by its absolute path.
    fn place_of_note(&self, pointer: &Pointer) -> PathBuf {
        let file = std::path::absolute(&pointer.file).unwrap_or_else(|_| PathBuf::from(&pointer.file));
        let digest = Sha256::digest(file.as_os_str().as_encoded_bytes());
        let hash: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        self.place("sessions", &hash)
    }

    fn place(&self, kind: &str, name: &str) -> PathBuf {
        self.folder.join(kind).join(name.get(..2).unwrap_or("00")).join(format!("{name}.json"))
    }

    fn put(&self, place: &Path, contents: &impl Serialize) -> Result<(), Diagnostic> {
        let fault = |source| unwritable(place, source);
        let mut text = serde_json::to_vec(contents).map_err(|error| fault(error.into()))?;
        text.push(b'\n');
        let folder = place.parent().unwrap_or(&self.folder);
        std::fs::create_dir_all(folder).map_err(fault)?;
        let mut file = TemporaryFile::in_folder(folder).map_err(fault)?;
        file.write_all(&text).map_err(fault)?;
        file.persist(place).map_err(fault)
    }
}

/// Largest size of a record or a note, bytes: a thousand parameters with their covariance take a third.
const MAX_BYTES: u64 = 64 << 20;

/// The contents of a file; `None` if there is none. What this program did not write, a device or a file beyond the
/// limit, counts as none.
fn read(file: &Path) -> Result<Option<Vec<u8>>, Diagnostic> {
    let fault = |source| unreadable(file, source);
    // A pipe would block, and a device has no end.
    match std::fs::metadata(file) {
        Ok(found) if !found.is_file() || found.len() > MAX_BYTES => return Ok(None),
        Ok(_) => {}
        Err(source) if source.kind() == ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(fault(source)),
    }
    let mut contents = Vec::new();
    match File::open(file).and_then(|opened| opened.take(MAX_BYTES).read_to_end(&mut contents)) {
        Ok(_) => Ok(Some(contents)),
        Err(source) if source.kind() == ErrorKind::NotFound => Ok(None),
        Err(source) => Err(fault(source)),
    }
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, Diagnostic> {
    let fault = |source| unreadable(folder, source);
    std::fs::read_dir(folder).map_err(fault)?.map(|entry| entry.map(|entry| entry.path()).map_err(fault)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_one_note_and_stray_files_do_no_harm() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let own = std::path::absolute("session.toml").unwrap();
        for file in ["session.toml", "./session.toml", own.to_str().unwrap()] {
            let (file, session_id) = (file.to_string(), file.to_string());
            let (key, machine_id) = ("00".to_string(), "M".to_string());
            let note = Pointer { schema_version: SCHEMA_VERSION, file, key, session_id, machine_id, error: None };
            store.note(&note).unwrap();
        }
        std::fs::write(folder.path().join("sessions/.DS_Store"), "x").unwrap();
        std::fs::create_dir_all(folder.path().join("sessions/zz")).unwrap();
        std::fs::write(folder.path().join("sessions/zz/note.json"), "{").unwrap();
        let (sessions, damaged) = store.sessions().unwrap();
        assert_eq!((sessions.len(), damaged.len()), (1, 1));
        let (records, missing) = store.records().unwrap();
        assert_eq!((records.len(), missing.len()), (0, 2));
    }
}
