//! Withdraws effects that explain nothing.

use abbe_model::Diagnostic;
use abbe_model::driver::Driver;

use super::{Move, Proposal};
use crate::constants::INTERVALS;
use crate::state::SearchState;

/// Withdraws effects that follow one axis if curves over that axis, one for each test and without a component, explain
/// as much with a shorter description. A single simple effect is compared only if significant structure remains.
pub struct Withdraw {
    /// Whether significant structure remains.
    pub structured: bool,
}

impl Move for Withdraw {
    fn try_on(&self, search: &mut SearchState<'_>, branch: usize) -> Result<bool, Diagnostic> {
        let mut changed = false;
        for driver in search.axes_followed(branch) {
            let (group, rest) = search.following(&driver, branch);
            let is_curve = |c: &usize| search.effect(*c).shape.curve_ends().is_some();
            let few = group.len() < 2 && !search.is_composed(&group) && !self.structured;
            if few || group.iter().all(is_curve) {
                continue;
            }
            let folds = search.selection.branches[branch].folds.clone();
            let of_group = search.objective(&group, &rest, &folds)?;
            let mut of_curves = f64::NEG_INFINITY;
            for intervals in INTERVALS {
                let one = objective_of_test_curves(search, &driver, intervals, &rest, &folds)?;
                of_curves = one.map_or(of_curves, |one| of_curves.max(one));
            }
            let mut selected = search.selection.branches[branch].selected.clone();
            selected.retain(|selected| !group.contains(&selected.candidate));
            changed |= Proposal { selected, increase: of_curves - of_group, margin: 0.0 }.accept(search, branch);
        }
        Ok(changed)
    }
}

/// The objective of curves over an axis, one for each test. `None` if no test permits such a curve. They count as one
/// choice, that of the axis.
fn objective_of_test_curves(
    search: &mut SearchState<'_>,
    driver: &Driver,
    intervals: usize,
    rest: &[usize],
    folds: &[usize],
) -> Result<Option<f64>, Diagnostic> {
    let curves = search.test_curves(driver, intervals);
    if curves.is_empty() {
        return Ok(None);
    }
    Ok(Some(search.evidence_of(&curves, rest, folds)? - search.choice()))
}
