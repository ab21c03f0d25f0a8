//! Rounds of the search until no addition is significant or lowers the held-out error any more, and an account of them for those who wait.

use super::search::{Round, Search};
use super::{Progress, Step};
use crate::error::IdentifyError;

/// Up to this many effects exchanges are tried after each addition, beyond it after each eighth.
const SWAP_EVERY_ROUND_UP_TO: usize = 14;
const SWAP_EVERY: usize = 8;

/// What is told of a search as it goes.
pub(super) struct Account<'t> {
    /// The additions so far.
    pub steps: Vec<Step>,
    /// Standard deviation of a reading, µm.
    pub noise_um: f64,
    /// Whom it is told; they say whether they want more.
    pub progress: &'t (dyn Fn(Progress) -> bool + Sync),
}

impl Account<'_> {
    /// Notes additions that are claimed.
    fn note(&mut self, search: &Search<'_>, added: impl Iterator<Item = usize>) {
        let held_out = search.held_out.last().copied().unwrap_or(0.0);
        let heldout_rms_um = (held_out / search.columns.rows().max(1) as f64).sqrt() * self.noise_um;
        let effects = search.taken().len();
        for candidate in added {
            let id = search.candidates[candidate].effect.id();
            self.steps.push(Step {
                id: id.clone(),
                effects,
                heldout_rms_um,
            });
            (self.progress)(Progress::SelectedEffect(effects, id, heldout_rms_um));
        }
    }
}

/// How many additions in a row may fail to lower the held-out error before they are withdrawn: of two effects that undo part of each other the first alone
/// explains little.
const UNCLAIMED_IN_A_ROW: usize = 2;

/// Rounds until no candidate is significant, or until additions do not lower the held-out error: the p-value of the best that was not added. What remains
/// is what is claimed.
///
/// # Errors
/// [`IdentifyError::Interrupted`] if the user has seen enough; [`Search::roll_back`] then leads to what was claimed until then.
pub(super) fn search_on(search: &mut Search<'_>, account: &mut Account<'_>) -> Result<f64, IdentifyError> {
    let p_value = rounds(search, account)?;
    search.withdraw_unclaimed();
    Ok(p_value)
}

fn rounds(search: &mut Search<'_>, account: &mut Account<'_>) -> Result<f64, IdentifyError> {
    // Additions since the last that was claimed.
    let mut unclaimed = Vec::new();
    // Effects that are attributed to one make room for others; that must end.
    for _ in 0..search.most_rounds() {
        let mut ended = None;
        match search.round()? {
            Round::Done { .. } if search.retune_all()? || search.merge_groups()? => unclaimed.push(None),
            Round::Done { p_value } => ended = Some(p_value),
            Round::Added { candidate } => {
                // Every exchange costs a model an effect; among many effects the gain is small and a sweep now and then will do.
                let taken = search.taken().len();
                if taken <= SWAP_EVERY_ROUND_UP_TO || taken.is_multiple_of(SWAP_EVERY) {
                    search.exchange()?;
                }
                search.merge()?;
                unclaimed.push(Some(candidate));
            }
        }
        if search.claim() {
            account.note(search, unclaimed.drain(..).flatten());
        }
        if let Some(p_value) = ended {
            return Ok(p_value);
        }
        if unclaimed.len() >= UNCLAIMED_IN_A_ROW {
            // No p-value tells how many more would be added.
            return Ok(1.0);
        }
    }
    Ok(1.0)
}
