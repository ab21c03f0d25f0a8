//! Rounds of the search until nothing earns its place any more, and an account of them for those who wait.

use super::search::{Round, Search};
use super::{Progress, Step};
use crate::error::IdentifyError;

/// Up to this many effects exchanges are tried after each addition, beyond it after each eighth.
const EXCHANGED_EACH_ROUND: usize = 14;
const EXCHANGED_EACH: usize = 8;

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
    /// Notes an addition.
    fn note(&mut self, search: &Search<'_>, candidate: usize) {
        let held_out = search.held_out.last().copied().unwrap_or(0.0);
        let heldout_rms_um = (held_out / search.columns.rows().max(1) as f64).sqrt() * self.noise_um;
        let id = search.candidates[candidate].effect.id();
        let effects = search.taken().len();
        self.steps.push(Step {
            id: id.clone(),
            effects,
            heldout_rms_um,
        });
        (self.progress)(Progress::Taken(effects, id, heldout_rms_um));
    }
}

/// Rounds until nothing earns its place any more: the p-value of the best that was not taken.
///
/// # Errors
/// [`IdentifyError::Interrupted`] if the user has seen enough; [`Search::roll_back`] then leads to what was taken until then.
pub(super) fn search_on(search: &mut Search<'_>, account: &mut Account<'_>) -> Result<f64, IdentifyError> {
    // Effects that are put down to one make room for others; that must end.
    for _ in 0..search.most_rounds() {
        search.keep();
        match search.round()? {
            Round::Done { .. } if search.retune()? || search.regroup()? => {}
            Round::Done { p_value } => return Ok(p_value),
            Round::Added { candidate } => {
                // Every exchange costs a model an effect; among many effects the gain is small and a sweep now and then will do.
                let taken = search.taken().len();
                if taken <= EXCHANGED_EACH_ROUND || taken.is_multiple_of(EXCHANGED_EACH) {
                    search.exchange()?;
                }
                search.merge()?;
                account.note(search, candidate);
            }
        }
    }
    search.keep();
    Ok(1.0)
}
