//! A foreign file: its name and its content.

use std::io::Read;
use std::path::Path;

use abbe_model::diagnostic::{Diagnostic, Location};

use super::MAX_BYTES;
use crate::stamp::FileStamp;
use crate::store::Store;

/// A foreign file.
#[derive(Clone, Debug)]
pub struct Foreign {
    /// Its name, without folders.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

impl Foreign {
    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, or is larger than [`MAX_BYTES`].
    pub fn read(store: &Store, path: &Path) -> Result<(Foreign, FileStamp), Diagnostic> {
        let fault = |message: String| Diagnostic::input(Location::file(path), message, "name a file of readings");
        let cannot = |cause: std::io::Error| fault(format!("cannot be read: {cause}"));
        let mut opened = store.open(path).map_err(cannot)?;
        let found = opened.state().map_err(cannot)?;
        if found.folder {
            return Err(fault("this is a folder".into()));
        }
        let stamp = FileStamp::of(path, found);
        let mut bytes = Vec::new();
        opened.by_ref().take(MAX_BYTES as u64 + 1).read_to_end(&mut bytes).map_err(cannot)?;
        if bytes.len() > MAX_BYTES {
            return Err(fault(format!("more than {MAX_BYTES} bytes, which is the limit")));
        }
        stamp.finish(&opened)?;
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok((Foreign { name, bytes }, stamp))
    }

    /// The name without its extension: the name of a test.
    pub fn stem(&self) -> String {
        Path::new(&self.name).file_stem().map_or_else(|| self.name.clone(), |stem| stem.to_string_lossy().into_owned())
    }
}
