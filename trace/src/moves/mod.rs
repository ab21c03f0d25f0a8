//! The moves of the search. A move proposes other effects for one branch. One rule accepts or rejects every proposal.
//!
//! The objective of a group of effects `G` beside the other selected effects `R` is
//!
//! ```text
//! J(G | R) = −ln P(χ²) − Σ (cost + penalty + ln n)
//! ```
//!
//! with the joint gain of the group as `χ²` and the number `n` of detectable effects in the library. A proposal is
//! accepted if `J` increases by more than the margin of the move:
//!
//! | move | replaces | margin |
//! |---|---|---|
//! | [`add`] | nothing by one effect | none: the p-value of the branch on all readings decides for all branches |
//! | [`remove`] | one effect by nothing | the best score of readings without structure, negative; it stands for `ln n` |
//! | [`swap`] | one effect by another | the confounding margin |
//! | [`refine`] | all by a set with an effect tuned again | the confounding margin |
//! | [`pair`] | all by a set with two other effects | the confounding margin |
//! | [`merge`] | effects that follow one axis by one effect | 0 |
//! | [`withdraw`] | effects that follow one axis by nothing | the objective of curves of the tests |

pub mod add;
mod comparison;
pub mod merge;
pub mod pair;
pub mod refine;
pub mod remove;
pub mod swap;
pub mod withdraw;

use std::sync::atomic::{AtomicUsize, Ordering};

use abbe_identify::numerics::parallel;
use abbe_model::Diagnostic;

use super::Progress;
use super::interrupt::Interrupt;
use super::policy::MoveName;
use super::state::{ALL, SearchState, SelectedEffect};

/// A move of the search.
pub trait Move: Sync {
    /// Tries the move on one branch. Returns whether its selected effects changed.
    ///
    /// # Errors
    /// If products are not finite, or `INTERRUPTED` if the caller stopped the trace.
    fn try_on(&self, search: &mut SearchState<'_>, branch: usize) -> Result<bool, Diagnostic>;

    /// Whether the branches without a fold are tried only if the branch on all readings changed.
    fn follows_all_readings(&self) -> bool {
        false
    }

    /// Whether the move is tried with this number of selected effects.
    fn is_due(&self, selected: usize) -> bool {
        let _ = selected;
        true
    }
}

/// Other selected effects for a branch.
pub struct Proposal {
    /// The selected effects.
    pub selected: Vec<SelectedEffect>,
    /// Increase of the objective.
    pub increase: f64,
    /// What the increase has to exceed.
    pub margin: f64,
}

impl Proposal {
    /// The rule of acceptance: selects the proposed effects if the objective increases by more than the margin. Returns
    /// whether it does.
    fn accept(self, search: &mut SearchState<'_>, branch: usize) -> bool {
        let accepted = self.increase > self.margin;
        if accepted {
            search.selection.branches[branch].selected = self.selected;
        }
        accepted
    }
}

/// The move of a name.
pub fn named(name: MoveName) -> &'static dyn Move {
    match name {
        MoveName::Swap => &swap::Swap,
        MoveName::Merge => &merge::Merge,
        MoveName::Refine => &refine::Refine,
        MoveName::Pair => &pair::Pair,
    }
}

/// Tries a move on every branch, on those without a fold at the same time. Returns whether the branch on all readings changed.
///
/// # Errors
/// See [`Move::try_on`].
pub fn on_every_branch(tried: &dyn Move, search: &mut SearchState<'_>) -> Result<bool, Diagnostic> {
    let all = tried.try_on(search, ALL)?;
    search.forget_unselected(ALL);
    if search.policy.folds_follow {
        search.follow_all_readings();
        return Ok(all);
    }
    if all || !tried.follows_all_readings() {
        search.prepare_branches()?;
        let (folds, common) = (search.selection.branches.len() - 1, search.candidates.len());
        let ended = AtomicUsize::new(0);
        let tried = parallel::map(folds, &|fold| {
            let mut own = search.clone();
            tried.try_on(&mut own, ALL + 1 + fold)?;
            own.forget_unselected(ALL + 1 + fold);
            if let Some(Interrupt(progress)) = search.interrupt {
                progress(Progress::Folds(1 + ended.fetch_add(1, Ordering::Relaxed), folds));
            }
            Ok(own)
        });
        let tried: Vec<SearchState<'_>> = tried.into_iter().collect::<Result<_, Diagnostic>>()?;
        for (fold, own) in tried.into_iter().enumerate() {
            search.adopt(ALL + 1 + fold, &own, common);
        }
    }
    Ok(all)
}

/// Tries a move on every branch if it is due. Returns whether the branch on all readings changed.
///
/// # Errors
/// See [`Move::try_on`].
pub fn run(name: MoveName, search: &mut SearchState<'_>) -> Result<bool, Diagnostic> {
    let tried = named(name);
    if !tried.is_due(search.selected().len()) {
        return Ok(false);
    }
    on_every_branch(tried, search)
}
