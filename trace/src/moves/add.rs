//! Adds the best candidate.

use abbe_model::Diagnostic;

use super::{Move, Proposal};
use crate::state::{ALL, SearchBranch, SearchState, SelectedEffect};

/// Adds to each branch its best candidate. On all readings it is the candidate with the shortest description among
/// those confounded with the best. With one fold left out, prediction matters and not the name, so it is the best.
///
/// The p-value on all readings decides for every branch. A threshold for each branch would leave the branches without
/// the effect if its score is near the threshold, and the held-out error would then not decrease in their folds.
pub struct Add {
    /// The p-value of the best candidate on all readings.
    pub p_value: f64,
}

impl Move for Add {
    fn try_on(&self, search: &mut SearchState<'_>, branch: usize) -> Result<bool, Diagnostic> {
        let SearchBranch { folds, mut selected } = search.selection.branches[branch].clone();
        let chosen = search.selection.branches[branch].chosen();
        let known = search.tune_near_best(&chosen, &folds)?;
        let (candidate, score) = {
            let model = search.model_of(&chosen, &folds)?;
            let gains = search.remaining_gains(&model, known)?;
            let Some((best, score)) = search.best_of(&model, &gains, &chosen) else {
                return Ok(false);
            };
            match branch {
                ALL => (search.simplest_confounded(&model, &gains, best, &chosen), score),
                _ => (best, score),
            }
        };
        selected.push(SelectedEffect { candidate, p_value: self.p_value });
        Ok(Proposal { selected, increase: score, margin: f64::NEG_INFINITY }.accept(search, branch))
    }

    fn follows_all_readings(&self) -> bool {
        true
    }
}
