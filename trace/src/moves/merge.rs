//! Merges effects that follow one axis, or waves along several axes, into one effect.

use abbe_identify::numerics::parallel;
use abbe_model::Diagnostic;

use super::{Move, Proposal};
use crate::state::{SearchBranch, SearchState, SelectedEffect};

/// Merges several effects that follow one axis, or all of them but one, into one effect, if it explains as much with a
/// shorter description. For three or more effects or positions, a nonparametric curve is a candidate too. Several waves with
/// periods, along any axes, are one group too: a harmonic of a rotary axis that linear axes follow looks like waves of theirs.
pub struct Merge;

impl Move for Merge {
    fn try_on(&self, search: &mut SearchState<'_>, branch: usize) -> Result<bool, Diagnostic> {
        let mut changed = false;
        for driver in search.axes_followed(branch) {
            let (whole, _) = search.following(&driver, branch);
            let mut groups = vec![whole.clone()];
            if whole.len() > 2 {
                let without = |left_out: &usize| whole.iter().copied().filter(|c| c != left_out).collect();
                groups.extend(whole.iter().map(without));
            }
            for group in groups {
                if let Some(proposal) = merged(search, branch, &group)?
                    && proposal.accept(search, branch)
                {
                    changed = true;
                    break;
                }
            }
        }
        let waves = search.waves(branch);
        if let Some(proposal) = (waves.len() > 1).then(|| merged(search, branch, &waves)).transpose()?.flatten() {
            changed |= proposal.accept(search, branch);
        }
        Ok(changed)
    }
}

/// A group of effects merged into the one effect with the largest objective.
fn merged(search: &mut SearchState<'_>, branch: usize, group: &[usize]) -> Result<Option<Proposal>, Diagnostic> {
    let columns: usize = group.iter().map(|c| search.gram.count(*c)).sum();
    let curves = group.len() > 2 || columns > 2 && search.is_composed(group);
    if group.len() < 2 && !curves {
        return Ok(None);
    }
    let SearchBranch { folds, selected } = search.selection.branches[branch].clone();
    let (grouped, mut selected): (Vec<SelectedEffect>, Vec<SelectedEffect>) =
        selected.into_iter().partition(|selected| group.contains(&selected.candidate));
    let rest: Vec<usize> = selected.iter().map(|selected| selected.candidate).collect();
    if group.len() > 1 {
        search.tune_near_best(&rest, &folds)?;
    }
    let may_be_added = |c: &usize| {
        search.may_be_added(*c, &folds) || curves && search.candidates[*c].last_resort && search.may_be_used(*c, &folds)
    };
    let pool: Vec<usize> =
        (0..search.candidates.len()).filter(may_be_added).filter(|c| !rest.contains(c) && !group.contains(c)).collect();
    let without = search.model_of(&rest, &folds)?;
    let variance = search.variance(&without);
    let present = search.objective(group, &rest, &folds)?;
    let one = |k: usize| Ok(search.score(pool[k], &without.gain(pool[k])?, variance) - search.choice());
    let values = parallel::map(pool.len(), &one).into_iter().collect::<Result<Vec<f64>, Diagnostic>>()?;
    let best = pool.iter().copied().zip(values).max_by(|a, b| a.1.total_cmp(&b.1));
    let p_value = grouped.iter().map(|selected| selected.p_value).fold(1.0, f64::min);
    Ok(best.map(|(candidate, one)| {
        selected.push(SelectedEffect { candidate, p_value });
        Proposal { selected, increase: one - present, margin: 0.0 }
    }))
}
