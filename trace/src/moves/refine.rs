//! Tunes an effect again together with another effect.

use std::collections::HashSet;

use abbe_model::Diagnostic;

use super::Move;
use super::comparison::SetComparison;
use crate::state::SearchState;

/// Tunes effects with shape numbers or positions again together with each of the next best candidates, in addition to
/// the others or in place of one. A step table or a warm-up with a free time constant can absorb most of a second
/// effect. The second effect becomes significant only when both are in the model.
pub struct Refine;

impl Move for Refine {
    fn try_on(&self, search: &mut SearchState<'_>, branch: usize) -> Result<bool, Diagnostic> {
        let Some(mut comparison) = SetComparison::with_selected(search, branch)? else {
            return Ok(false);
        };
        let (folds, chosen) = (comparison.folds.clone(), comparison.chosen.clone());
        let tunable: Vec<usize> = chosen.iter().copied().filter(|c| search.is_tunable(*c)).collect();
        for tunable in tunable {
            let removed = chosen.iter().copied().filter(|c| *c != tunable).map(Some);
            for removed in removed.chain([None]) {
                if removed.is_none() && chosen.len() >= search.policy.max_effects {
                    continue;
                }
                let kept = |c: &&usize| **c != tunable && Some(**c) != removed;
                let base: Vec<usize> = chosen.iter().filter(kept).copied().collect();
                let tried = next_best(search, &base, tunable, &folds)?;
                for other in tried {
                    let beside: Vec<usize> = base.iter().copied().chain([other]).collect();
                    if let Some(tuned) = search.tuned_again(tunable, &beside, &folds)? {
                        comparison.compare(search, &beside, tuned, &[other])?;
                    }
                }
            }
        }
        Ok(comparison.accept(search))
    }
}

/// The best candidates beside some effects: one for each identifier other than that of `but`, and one of equivalent
/// candidates.
fn next_best(search: &SearchState<'_>, base: &[usize], but: usize, folds: &[usize]) -> Result<Vec<usize>, Diagnostic> {
    let mut ids = HashSet::from([search.effect(but).id()]);
    let mut ranked = search.ranked(base, folds, |candidate| ids.insert(search.effect(candidate).id()))?;
    ranked.truncate(search.effort(folds).tried);
    Ok(ranked)
}
