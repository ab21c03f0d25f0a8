//! Exchanges a wrong effect for the true one.

use abbe_model::Diagnostic;

use super::{Move, Proposal};
use crate::constants::{INDISTINGUISHABLE, SWAP_EVERY, SWAP_EVERY_ROUND_UP_TO};
use crate::state::{SearchBranch, SearchState};

/// Exchanges each effect for a candidate that explains clearly more together with the others. The improvement has to
/// exceed the confounding margin, so that exchanges end.
pub struct Swap;

impl Move for Swap {
    fn try_on(&self, search: &mut SearchState<'_>, branch: usize) -> Result<bool, Diagnostic> {
        let mut changed = false;
        for k in 0..search.selection.branches[branch].selected.len() {
            if let Some(proposal) = exchanged(search, branch, k)? {
                changed |= proposal.accept(search, branch);
            }
        }
        Ok(changed)
    }

    fn is_due(&self, selected: usize) -> bool {
        selected <= SWAP_EVERY_ROUND_UP_TO || selected.is_multiple_of(SWAP_EVERY)
    }
}

/// The `k`-th effect exchanged for the best candidate beside the others, in its simplest form.
fn exchanged(search: &mut SearchState<'_>, branch: usize, k: usize) -> Result<Option<Proposal>, Diagnostic> {
    let SearchBranch { folds, mut selected } = search.selection.branches[branch].clone();
    let mut others = search.selection.branches[branch].chosen();
    let present = others.remove(k);
    let tunes = !others.is_empty() && selected.len() < search.policy.swap_tunes_below;
    let known = if tunes { search.tune_near_best(&others, &folds)? } else { Vec::new() };
    let model = search.model_of(&others, &folds)?;
    let gains = search.remaining_gains(&model, known)?;
    let score = search.score(present, &model.gain(present)?, search.variance(&model));
    let Some((best, most)) = search.best_of(&model, &gains, &others).filter(|(best, _)| *best != present) else {
        return Ok(None);
    };
    selected[k].candidate = search.simplest_confounded(&model, &gains, best, &others);
    Ok(Some(Proposal { selected, increase: most - score, margin: INDISTINGUISHABLE }))
}
