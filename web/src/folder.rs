//! A folder of files in memory, and the sessions in it.

use std::path::Path;

use abbe::document::Origin;
use abbe::files::store::Store;
use abbe::files::{self, ReadOptions, SourceMap};
use abbe::model::session::Session;
use serde_json::json;
use wasm_bindgen::prelude::*;

use crate::failed::Failed;

/// Files in memory.
#[wasm_bindgen]
#[derive(Default)]
pub struct Folder {
    files: Vec<(String, Vec<u8>)>,
}

/// A session that was read, with its files.
pub struct Read {
    pub session: Session,
    pub sources: SourceMap,
    pub origin: Origin,
}

#[wasm_bindgen]
impl Folder {
    /// An empty folder.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Folder {
        Folder::default()
    }

    /// Adds a file by its relative path.
    pub fn add(&mut self, path: String, contents: Vec<u8>) {
        self.files.push((path, contents));
    }

    /// Reads a session: its tests with the number of their readings, its warnings.
    ///
    /// # Errors
    /// If the session cannot be used: JSON with message, help, file, line and column.
    pub fn check(&self, session: &str) -> Result<String, Failed> {
        let read = self.read(session, true)?;
        let tests = read.session.tests.iter().map(|test| {
            let readings = test.readings.as_ref().map_or(0, |readings| readings.rows());
            // What the axes do without data, which a plan needs.
            let moves = test.motion.is_some();
            json!({ "name": test.name, "readings": readings, "moves": moves })
        });
        let files: Vec<String> = read.sources.files.iter().map(|stamp| stamp.file.display().to_string()).collect();
        let found = json!({
            "machine": read.session.machine.name,
            "instrument": read.session.instrument.word(),
            "tests": tests.collect::<Vec<_>>(),
            "effects": read.session.effects.iter().map(abbe::model::effect::Effect::id).collect::<Vec<_>>(),
            "warnings": read.session.warnings,
            "files": files,
        });
        Ok(found.to_string())
    }
}

impl Folder {
    /// Its files, as the library reads them.
    pub fn store(&self) -> Store {
        Store::in_memory(self.files.iter().map(|(path, contents)| (path, contents.clone())))
    }

    /// Reads a session, with its data if they are wanted.
    pub fn read(&self, session: &str, read_data: bool) -> Result<Read, Failed> {
        let store = self.store();
        let options = ReadOptions { read_data, store: store.clone(), ..ReadOptions::default() };
        let read = files::session_with_sources(Path::new(session), &options);
        let (session, sources) = read.map_err(|fault| Failed::from(fault).within(&store))?;
        let origin = Origin::of_session(&sources);
        Ok(Read { session, sources, origin })
    }
}
