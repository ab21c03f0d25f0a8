//! Runs rounds of the search until no addition is significant or lowers the held-out error, and records the additions.

use super::search::{Round, Search};
use super::{Progress, SearchStep};
use crate::error::IdentifyError;

/// Up to this number of effects, exchanges are tried after each addition. Beyond it they are tried after every eighth.
const SWAP_EVERY_ROUND_UP_TO: usize = 14;
const SWAP_EVERY: usize = 8;

/// The record of a search, and its progress.
pub(super) struct SearchRecord<'t> {
    /// The additions so far.
    pub steps: Vec<SearchStep>,
    /// Standard deviation of a reading, µm.
    pub noise_um: f64,
    /// Receives the progress. Returns whether to continue.
    pub progress: &'t (dyn Fn(Progress) -> bool + Sync),
}

impl SearchRecord<'_> {
    /// Records accepted additions.
    fn note(&mut self, search: &Search<'_>, added: impl Iterator<Item = usize>) {
        let held_out = search.held_out.last().copied().unwrap_or(0.0);
        let heldout_rms_um = (held_out / search.columns.rows().max(1) as f64).sqrt() * self.noise_um;
        let effects = search.selected().len();
        for candidate in added {
            let id = search.candidates[candidate].effect.id();
            self.steps.push(SearchStep { id: id.clone(), effects, heldout_rms_um });
            (self.progress)(Progress::SelectedEffect(effects, id, heldout_rms_um));
        }
    }
}

/// Consecutive additions that may fail to lower the held-out error before they are withdrawn. Of two effects that
/// partly cancel each other, the first alone explains little.
const MAX_REJECTED_IN_A_ROW: usize = 2;

/// Runs rounds until no candidate is significant, or until additions do not lower the held-out error. The accepted
/// effects remain. Returns the p-value of the best candidate that was not added.
///
/// # Errors
/// [`IdentifyError::Interrupted`] if the caller stopped the trace. [`Search::roll_back`] then restores the accepted
/// effects.
pub(super) fn search_on(search: &mut Search<'_>, record: &mut SearchRecord<'_>) -> Result<f64, IdentifyError> {
    let p_value = rounds(search, record)?;
    search.withdraw_rejected();
    Ok(p_value)
}

fn rounds(search: &mut Search<'_>, record: &mut SearchRecord<'_>) -> Result<f64, IdentifyError> {
    // Additions since the last acceptance.
    let mut pending = Vec::new();
    // A merge of effects permits further additions. The limit on rounds guarantees termination.
    for _ in 0..search.max_rounds() {
        let mut ended = None;
        match search.round()? {
            Round::Done { .. } if search.retune_all()? || search.exchange_pairs()? => pending.push(None),
            Round::Done { p_value } => ended = Some(p_value),
            Round::Added { candidate } => {
                // Each exchange trains one model per effect. With many effects the gain is small, and an occasional
                // sweep is enough.
                let selected = search.selected().len();
                if selected <= SWAP_EVERY_ROUND_UP_TO || selected.is_multiple_of(SWAP_EVERY) {
                    search.exchange()?;
                }
                search.merge()?;
                pending.push(Some(candidate));
            }
        }
        if search.accept() {
            record.note(search, pending.drain(..).flatten());
        }
        if let Some(p_value) = ended {
            return Ok(p_value);
        }
        if pending.len() >= MAX_REJECTED_IN_A_ROW {
            // No p-value is available for further additions.
            return Ok(1.0);
        }
    }
    Ok(1.0)
}
