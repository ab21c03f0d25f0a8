//! Searches two effects jointly in place of one or two.

use abbe_model::Diagnostic;

use super::Move;
use super::comparison::SetComparison;
use crate::state::SearchState;

/// Searches two effects jointly in place of two selected effects or of one. If two effects partly cancel each other,
/// neither is significant alone, and the search finds a single effect that approximates both. If all readings do not
/// prefer another pair, the folds are not searched.
pub struct Pair;

impl Move for Pair {
    fn try_on(&self, search: &mut SearchState<'_>, branch: usize) -> Result<bool, Diagnostic> {
        let Some(mut comparison) = SetComparison::with_selected(search, branch)? else {
            return Ok(false);
        };
        let (folds, chosen) = (comparison.folds.clone(), comparison.chosen.clone());
        let effort = search.effort(&folds);
        let places = 0..chosen.len();
        let removed = places.clone().flat_map(|i| places.clone().filter(move |j| i <= *j).map(move |j| (i, j)));
        for (i, j) in removed {
            if i == j && chosen.len() >= search.policy.max_effects {
                continue;
            }
            let base: Vec<usize> = places.clone().filter(|k| *k != i && *k != j).map(|k| chosen[k]).collect();
            let mut firsts = search.ranked(&base, &folds, |candidate| !search.is_tunable(candidate))?;
            firsts.truncate(if i == j { effort.first_of_one } else { effort.first_of_two });
            for first in firsts {
                let beside: Vec<usize> = base.iter().copied().chain([first]).collect();
                let second = {
                    let model = search.model_of(&beside, &folds)?;
                    let gains = search.gains(&model)?;
                    let best = search.best_of(&model, &gains, &beside);
                    best.map(|(best, _)| search.simplest_confounded(&model, &gains, best, &beside))
                };
                if let Some(second) = second {
                    comparison.compare(search, &beside, second, &[first, second])?;
                }
            }
        }
        Ok(comparison.accept(search))
    }

    fn follows_all_readings(&self) -> bool {
        true
    }
}
