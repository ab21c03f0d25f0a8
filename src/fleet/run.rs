//! What a run did, as JSON has it.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use super::store::Pointer;
use super::unit::Done;

/// What a run did.
#[derive(Serialize, JsonSchema)]
pub struct RunResult {
    /// Folder of the results.
    pub out: String,
    /// Number of sessions.
    pub sessions: usize,
    /// Sessions that were analysed.
    pub computed: usize,
    /// Sessions whose result was there.
    pub kept: usize,
    /// Sessions without a result, with the reason.
    pub failed: Vec<FailedSession>,
    /// Identifiers that several sessions of different content have.
    pub shared_ids: Vec<SharedId>,
    /// Session files of earlier runs that are no longer there: they have left history and data set.
    pub forgotten: Vec<String>,
}

/// A session without a result.
#[derive(Serialize, JsonSchema)]
pub struct FailedSession {
    /// The session file.
    pub file: String,
    /// What was found and what was expected.
    pub message: String,
}

/// An identifier of several sessions.
#[derive(Serialize, JsonSchema)]
pub struct SharedId {
    /// The identifier.
    pub session_id: String,
    /// The session files.
    pub files: Vec<String>,
}

impl RunResult {
    /// Of the sessions that were done.
    pub fn of(out: &Path, sessions: usize, done: &[(Done, Pointer)], forgotten: Vec<String>) -> RunResult {
        let mut by_id: BTreeMap<&str, Vec<&Pointer>> = BTreeMap::new();
        for (_, pointer) in done {
            by_id.entry(&pointer.session_id).or_default().push(pointer);
        }
        let shared =
            by_id.into_iter().filter(|(_, pointers)| pointers.iter().any(|other| other.key != pointers[0].key));
        let failed = done.iter().filter_map(|(_, pointer)| {
            Some(FailedSession { file: pointer.file.clone(), message: pointer.error.clone()? })
        });
        let computed = done.iter().filter(|(done, _)| *done == Done::Computed).count();
        RunResult {
            out: out.display().to_string(),
            sessions,
            computed,
            kept: done.len() - computed,
            failed: failed.collect(),
            shared_ids: shared
                .map(|(id, pointers)| SharedId {
                    session_id: id.to_string(),
                    files: pointers.iter().map(|pointer| pointer.file.clone()).collect(),
                })
                .collect(),
            forgotten,
        }
    }
}
