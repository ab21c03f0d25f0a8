//! Removes effects that later additions have made insignificant.

use abbe_model::Diagnostic;

use super::{Move, Proposal};
use crate::state::SearchState;

/// Removes the effect with the lowest score as long as it is below the threshold. The last addition stays.
pub struct Remove {
    /// The score that readings without structure exceed with the probability of the significance level.
    pub threshold: f64,
}

impl Move for Remove {
    fn try_on(&self, search: &mut SearchState<'_>, branch: usize) -> Result<bool, Diagnostic> {
        let folds = search.selection.branches[branch].folds.clone();
        let mut changed = false;
        loop {
            let chosen = search.selection.branches[branch].chosen();
            let scored = (0..chosen.len().saturating_sub(1)).map(|k| {
                let mut others = chosen.clone();
                let candidate = others.remove(k);
                Ok((k, search.score_beside(candidate, &others, &folds)?))
            });
            let scored: Vec<(usize, f64)> = scored.collect::<Result<_, Diagnostic>>()?;
            let Some((k, score)) = scored.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)) else {
                return Ok(changed);
            };
            let mut selected = search.selection.branches[branch].selected.clone();
            selected.remove(k);
            if !(Proposal { selected, increase: -score, margin: -self.threshold }).accept(search, branch) {
                return Ok(changed);
            }
            changed = true;
        }
    }
}
