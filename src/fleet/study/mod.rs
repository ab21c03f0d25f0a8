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

use super::FleetError;
use super::store::Store;
use super::unit::Done;
use draw::Draw;
use file::Study;

/// Makes a draw if the store has none of its number.
///
/// # Errors
/// If the store cannot be read or written, or `goes_on` returned `false`.
pub fn run(
    study: &Study,
    number: usize,
    store: &Store,
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Result<(Done, Draw), FleetError> {
    if let Some(draw) = store.draw(&study.key, number)? {
        return Ok((Done::Kept, draw));
    }
    let draw = if goes_on() { study.draw(number, goes_on) } else { None };
    let draw = draw.ok_or(FleetError::Interrupted)?;
    store.write_draw(&study.key, &draw)?;
    Ok((Done::Computed, draw))
}
