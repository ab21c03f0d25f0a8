//! Where a session comes from: its files, and their texts.

use std::path::PathBuf;
use std::sync::Arc;

use abbe_model::document::edit::SessionText;

use super::stamp::FileStamp;

/// The sources of a session that was read from files. A program that writes a changed session edits its text, so that
/// comments and everything else remain, and it refers to the files for provenance. The lines of single readings are in
/// [`Readings::origin`](abbe_model::session::readings::Readings::origin).
#[derive(Clone, Debug)]
pub struct SourceMap {
    /// The session file.
    pub file: PathBuf,
    /// The text of the session file, for edits.
    pub text: SessionText,
    /// The text of the machine file, if the session names one.
    pub machine_text: Option<String>,
    /// The files of the machine's bodies.
    pub bodies: Vec<BodyFile>,
    /// All files that were read, each once: the session, its machine, its bodies, its data.
    pub files: Vec<FileStamp>,
}

/// The file of a body of the machine.
#[derive(Clone, Debug)]
pub struct BodyFile {
    /// As it is named, relative to the file that names it.
    pub name: String,
    /// The file when it was read.
    pub stamp: FileStamp,
    /// Its content.
    pub contents: Arc<[u8]>,
}
