//! Studies: sessions simulated by plans × effects × noise, and analysed. A draw is one piece of work: it follows from
//! the study file, the plans and its number alone.
//!
//! - [`file`](mod@file): the study file; [`draw`]: one simulated session and what the analysis makes of it;
//! - `truth`: the true effect of a draw, and what equals it;
//! - [`summary`]: power, false claims and coverage with their sampling errors.

pub mod draw;
pub mod file;
pub mod summary;
mod truth;

use abbe_model::Diagnostic;
use draw::Draw;
use file::Study;

use super::interrupted;
use super::store::{IfClaimed, Search, Store, found_or_claimed};
use super::unit::Done;

/// Makes a draw if the store has none of its number. `None` if another process makes it and `if_claimed` says to skip it.
///
/// # Errors
/// If the store cannot be read or written, or `should_continue` returned `false`.
pub fn run(
    study: &Study,
    number: usize,
    store: &Store,
    if_claimed: IfClaimed,
    should_continue: &(dyn Fn() -> bool + Sync),
) -> Result<Option<(Done, Draw)>, Diagnostic> {
    let found = || store.draw(&study.key, number);
    let claim = || store.claim_draw(&study.key, number);
    let _claim = match found_or_claimed(found, claim, if_claimed, should_continue)? {
        Search::Found(draw) => return Ok(Some((Done::Kept, draw))),
        Search::Skipped => return Ok(None),
        Search::Claimed(claim) => claim,
    };
    let draw = if should_continue() { study.draw(number, should_continue) } else { None };
    let draw = draw.ok_or_else(interrupted)?;
    store.write_draw(&study.key, &draw)?;
    Ok(Some((Done::Computed, draw)))
}
