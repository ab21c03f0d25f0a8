//! Units of work on several threads, shared with other processes that work on the same folder.

use std::sync::atomic::{AtomicBool, Ordering};

use super::INTERRUPTED;
use abbe_model::Diagnostic;
use rayon::prelude::*;

use super::interrupted;
use super::store::IfClaimed;

/// What was done, in the order of the units, and why the work ended early.
pub struct Pooled<T> {
    /// Done.
    pub done: Vec<T>,
    /// Why it ended early.
    pub ended: Option<Diagnostic>,
}

/// What a unit asks before each of its steps: whether the work goes on.
pub type ShouldContinue<'g> = &'g (dyn Fn() -> bool + Sync);

/// Does all units. The first error ends the work: the next unit would meet it too. A unit on which another process is
/// at work gives `None`; it is asked for again when the others are done. `did` hears of each unit that is done.
pub fn all<U: Sync, T: Send>(
    units: &[U],
    threads: usize,
    should_continue: ShouldContinue<'_>,
    unit: impl Fn(&U, IfClaimed, ShouldContinue<'_>) -> Result<Option<T>, Diagnostic> + Sync,
    did: &(dyn Fn() + Sync),
) -> Pooled<T> {
    let stopped = AtomicBool::new(false);
    let should_continue = || should_continue() && !stopped.load(Ordering::Relaxed);
    let one = |own: &U, if_claimed: IfClaimed| {
        if !should_continue() {
            return Err(interrupted());
        }
        let outcome = unit(own, if_claimed, &should_continue);
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
            return Pooled {
                done: Vec::new(),
                ended: Some(Diagnostic::other(format!("the threads cannot be started: {cause}"))),
            };
        }
    };
    let mut outcomes: Vec<Result<Option<T>, Diagnostic>> =
        pool.install(|| units.par_iter().with_max_len(1).map(|own| one(own, IfClaimed::Skip)).collect());
    // Those on which other processes are at work: they are done, or the processes have ended.
    let claimed = units.iter().zip(&mut outcomes).filter(|(_, outcome)| matches!(outcome, Ok(None)));
    let claimed: Vec<_> = claimed.collect();
    pool.install(|| {
        claimed.into_par_iter().with_max_len(1).for_each(|(own, outcome)| *outcome = one(own, IfClaimed::Wait));
    });
    let (mut done, mut ended) = (Vec::with_capacity(units.len()), None);
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
    Pooled { done, ended }
}
