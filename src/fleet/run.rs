//! A run: the sessions on several threads, shared with other processes that work on the same folder, and what was done,
//! as JSON has it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use abbe_model::Diagnostic;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::store::{IfClaimed, Pointer};
use super::unit::Done;
use super::{INTERRUPTED, ShouldContinue, interrupted};

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

/// Analyses all sessions by `unit`: what was done, in their order, and why the work ended early. The first error ends
/// the work: the next session would meet it too. A session on which another process is at work gives `None`; it is asked
/// for again when the others are done. `did` hears of each session that is done.
pub fn all(
    files: &[PathBuf],
    threads: usize,
    should_continue: ShouldContinue<'_>,
    unit: impl Fn(&Path, IfClaimed, ShouldContinue<'_>) -> Result<Option<(Done, Pointer)>, Diagnostic> + Sync,
    did: &(dyn Fn() + Sync),
) -> (Vec<(Done, Pointer)>, Option<Diagnostic>) {
    let stopped = AtomicBool::new(false);
    let should_continue = || should_continue() && !stopped.load(Ordering::Relaxed);
    let one = |file: &PathBuf, if_claimed: IfClaimed| {
        if !should_continue() {
            return Err(interrupted());
        }
        let outcome = unit(file, if_claimed, &should_continue);
        match outcome {
            Ok(None) => {}
            Ok(Some(_)) => did(),
            Err(_) => stopped.store(true, Ordering::Relaxed),
        }
        outcome
    };
    let pool = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool,
        Err(cause) => {
            return (Vec::new(), Some(Diagnostic::other(format!("the threads cannot be started: {cause}"))));
        }
    };
    let mut outcomes: Vec<_> =
        pool.install(|| files.par_iter().with_max_len(1).map(|file| one(file, IfClaimed::Skip)).collect());
    // Those on which other processes are at work: they are done, or the processes have ended.
    let claimed = files.iter().zip(&mut outcomes).filter(|(_, outcome)| matches!(outcome, Ok(None)));
    let claimed: Vec<_> = claimed.collect();
    pool.install(|| {
        claimed.into_par_iter().with_max_len(1).for_each(|(file, outcome)| *outcome = one(file, IfClaimed::Wait));
    });
    let (mut done, mut ended) = (Vec::with_capacity(files.len()), None);
    for outcome in outcomes {
        match outcome {
            Ok(outcome) => done.extend(outcome),
            // A fault of the store, rather than the interruption that follows from it.
            Err(error) if ended.as_ref().is_none_or(|earlier: &Diagnostic| earlier.code == INTERRUPTED) => {
                ended = Some(error)
            }
            Err(_) => {}
        }
    }
    (done, ended)
}
