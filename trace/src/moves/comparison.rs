//! Compares sets of effects with the selected set.

use abbe_model::Diagnostic;

use super::Proposal;
use crate::constants::{INDISTINGUISHABLE, MAX_COMPARED};
use crate::state::{SearchState, SelectedEffect};

/// The best of the sets that were compared with the selected set of a branch.
pub struct SetComparison {
    /// The training folds of the branch.
    pub folds: Vec<usize>,
    /// The selected effects.
    pub chosen: Vec<usize>,
    branch: usize,
    /// The score that readings without structure exceed with the probability of the significance level.
    threshold: f64,
    /// The objective of the selected set.
    present: f64,
    /// The best set, and its objective. At first no set, with the objective that a set has to exceed.
    best: (Vec<usize>, f64),
}

impl SetComparison {
    /// Starts a comparison with the selected set. `None` if the set is empty or too large.
    pub fn with_selected(search: &SearchState<'_>, branch: usize) -> Result<Option<SetComparison>, Diagnostic> {
        let folds = search.selection.branches[branch].folds.clone();
        let chosen = search.selection.branches[branch].chosen();
        if !(1..=MAX_COMPARED).contains(&chosen.len()) {
            return Ok(None);
        }
        let present = search.objective(&chosen, &[], &folds)?;
        Ok(Some(SetComparison {
            branch,
            threshold: search.thresholds.last().copied().unwrap_or(f64::INFINITY),
            present,
            best: (Vec::new(), present + INDISTINGUISHABLE),
            folds,
            chosen,
        }))
    }

    /// Compares the set of some effects and one more. Each of the effects `added` has to be significant against
    /// readings without structure.
    pub fn compare(
        &mut self,
        search: &SearchState<'_>,
        beside: &[usize],
        one: usize,
        added: &[usize],
    ) -> Result<(), Diagnostic> {
        let value = search.objective_with(beside, one, &self.folds)?;
        if value <= self.best.1 {
            return Ok(());
        }
        let set: Vec<usize> = beside.iter().copied().chain([one]).collect();
        for added in added {
            let others: Vec<usize> = set.iter().copied().filter(|c| c != added).collect();
            if search.score_beside(*added, &others, &self.folds)? < self.threshold {
                return Ok(());
            }
        }
        self.best = (set, value);
        Ok(())
    }

    /// Selects the best set, if one is better than the selected set. The largest p-value of the replaced effects
    /// applies to all of the set.
    pub fn accept(self, search: &mut SearchState<'_>) -> bool {
        let (set, value) = self.best;
        if set.is_empty() {
            return false;
        }
        let replaced = search.selection.branches[self.branch].selected.iter();
        let p_value = replaced.map(|selected| selected.p_value).fold(0.0, f64::max);
        let selected = set.into_iter().map(|candidate| SelectedEffect { candidate, p_value }).collect();
        Proposal { selected, increase: value - self.present, margin: INDISTINGUISHABLE }.accept(search, self.branch)
    }
}
