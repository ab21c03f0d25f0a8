//! Description length: merges effects that follow one axis into one effect, and withdraws effects that explain nothing.
//!
//! The value of a group of effects is its joint evidence `−ln P(χ²)` less its description length. The description
//! length of an effect is its cost plus `ln n`, where `n` is the number of detectable effects in the library.

use abbe_model::driver::Driver;
use abbe_model::effect::Shape;
use abbe_model::effect::shape::Steps;

use super::search::{Search, SearchBranch, SelectedEffect};
use crate::candidates::columns::EffectColumns;
use crate::candidates::gain::Gain;
use crate::candidates::library::Candidate;
use crate::error::IdentifyError;
use crate::numerics::parallel;

/// Numbers of intervals of the nonparametric curves.
const INTERVALS: [usize; 3] = [8, 16, 32];

impl Search<'_> {
    /// Merges several effects that follow one axis into one effect, if it explains as much with a shorter description.
    /// For three or more effects or positions, a nonparametric curve is a candidate too.
    pub fn merge(&mut self) -> Result<(), IdentifyError> {
        if self.stop.in_residual_variance {
            return Ok(());
        }
        let mut merged = false;
        for branch in 0..self.branches.len() {
            for driver in self.axes_followed(branch) {
                let whole = self.following(&driver, &self.branches[branch].chosen()).0;
                let mut groups = vec![whole.clone()];
                if whole.len() > 2 {
                    let without = |left_out: &usize| whole.iter().copied().filter(|c| c != left_out).collect();
                    groups.extend(whole.iter().map(without));
                }
                for group in groups {
                    if self.merge_group(branch, &group)? {
                        merged = true;
                        break;
                    }
                }
            }
        }
        if merged {
            self.note_held_out()?;
        }
        Ok(())
    }

    /// The axes that the selected effects follow, each once.
    fn axes_followed(&self, branch: usize) -> Vec<Driver> {
        let mut drivers: Vec<Driver> = Vec::new();
        for candidate in self.branches[branch].chosen() {
            let driver = &self.candidates[candidate].effect.driver;
            if matches!(driver, Driver::Axis(_)) && !drivers.contains(driver) {
                drivers.push(driver.clone());
            }
        }
        drivers
    }

    /// Merges a group of effects into one effect, if it explains as much with a shorter description. Returns whether it
    /// did.
    fn merge_group(&mut self, branch: usize, group: &[usize]) -> Result<bool, IdentifyError> {
        let columns: usize = group.iter().map(|c| self.moments.count[*c]).sum();
        let curves = group.len() > 2 || columns > 2 && self.is_composed(group);
        if group.len() < 2 && !curves {
            return Ok(false);
        }
        let SearchBranch { folds, selected } = self.branches[branch].clone();
        let (grouped, kept): (Vec<SelectedEffect>, Vec<SelectedEffect>) =
            selected.into_iter().partition(|selected| group.contains(&selected.candidate));
        let rest: Vec<usize> = kept.iter().map(|selected| selected.candidate).collect();
        if group.len() > 1 {
            self.refine(&rest, &folds)?;
        }
        if curves {
            self.add_reserve_candidates();
        }
        let may_be_added = |c: &usize| {
            self.may_be_added(*c, &folds) || curves && self.candidates[*c].last_resort && self.may_be_used(*c, &folds)
        };
        let pool: Vec<usize> = (0..self.candidates.len()).filter(may_be_added).filter(|c| !rest.contains(c)).collect();
        let Some(candidate) = self.shorter_description(group, &rest, &pool, &folds)? else {
            return Ok(false);
        };
        self.add_to_base(&[candidate]);
        let p_value = grouped.iter().map(|selected| selected.p_value).fold(1.0, f64::min);
        self.branches[branch].selected = kept;
        self.branches[branch].selected.push(SelectedEffect { candidate, p_value });
        Ok(true)
    }

    fn is_composed(&self, group: &[usize]) -> bool {
        let composed =
            |c: &usize| matches!(&self.candidates[*c].effect.shape, Shape::Steps(Steps { at }) if at.len() > 2);
        group.iter().any(composed)
    }

    /// Withdraws effects that follow one axis if curves over that axis, one for each test and without a component,
    /// explain as much with a shorter description. A single simple effect is compared only if significant structure
    /// remains.
    pub fn withdraw(&mut self, structured: bool) -> Result<(), IdentifyError> {
        for branch in 0..self.branches.len() {
            for driver in self.axes_followed(branch) {
                let (group, rest) = self.following(&driver, &self.branches[branch].chosen());
                let is_curve = |c: &usize| matches!(self.candidates[*c].effect.shape, Shape::Curve { .. });
                let few = group.len() < 2 && !self.is_composed(&group) && !structured;
                if few || group.iter().all(is_curve) {
                    continue;
                }
                let folds = self.branches[branch].folds.clone();
                let of_group = self.evidence_of(&group, &rest, &folds)? - self.description_length(&group);
                let mut of_curves = f64::NEG_INFINITY;
                for intervals in INTERVALS {
                    let one = self.evidence_of_test_curves(&driver, intervals, &rest, &folds)?;
                    of_curves = one.map_or(of_curves, |one| of_curves.max(one));
                }
                if of_curves > of_group {
                    self.branches[branch].selected.retain(|selected| !group.contains(&selected.candidate));
                }
            }
        }
        self.note_held_out()
    }

    /// The joint evidence of curves over an axis, one for each test, less their description length. `None` if no test
    /// permits such a curve. They count as one choice, that of the axis.
    fn evidence_of_test_curves(
        &mut self,
        driver: &Driver,
        intervals: usize,
        rest: &[usize],
        folds: &[usize],
    ) -> Result<Option<f64>, IdentifyError> {
        let curves = self.test_curve(driver, intervals);
        if curves.is_empty() {
            return Ok(None);
        }
        self.add_to_base(&curves);
        Ok(Some(self.evidence_of(&curves, rest, folds)? - self.choice()))
    }

    /// Curves over an axis, one for each test. Their columns are computed at the first call.
    fn test_curve(&mut self, driver: &Driver, intervals: usize) -> Vec<usize> {
        let fresh = self.columns.curves_of_tests(driver, intervals);
        let effects: Vec<_> = fresh.iter().map(|(effect, _)| effect.clone()).collect();
        let present: Vec<usize> =
            (0..self.candidates.len()).filter(|c| effects.contains(&self.candidates[*c].effect)).collect();
        if !present.is_empty() {
            return present;
        }
        let first = self.candidates.len();
        let test_curve: Vec<(Candidate, EffectColumns)> =
            fresh.into_iter().map(|(effect, column_set)| (Candidate::test_curve(effect), column_set)).collect();
        self.append(test_curve, &[]);
        (first..self.candidates.len()).collect()
    }

    /// Description length of the choice of one effect in the library.
    fn choice(&self) -> f64 {
        (self.detectable_effects().max(1) as f64).ln()
    }

    pub(super) fn description_length(&self, group: &[usize]) -> f64 {
        group.iter().map(|c| self.candidates[*c].description_length() + self.choice()).sum()
    }

    /// `−ln P` of the joint gain of candidates.
    pub(super) fn evidence_of(&self, group: &[usize], rest: &[usize], folds: &[usize]) -> Result<f64, IdentifyError> {
        let all: Vec<usize> = rest.iter().chain(group).copied().collect();
        self.evidence_of_gain(self.projection_of(&all, folds)?.explained(), group, rest, folds)
    }

    /// `−ln P` of the joint gain of candidates and one more, which need not be in the base.
    pub(super) fn evidence_with(&self, some: &[usize], one: usize, folds: &[usize]) -> Result<f64, IdentifyError> {
        let model = self.projection_of(some, folds)?;
        let all: Vec<usize> = some.iter().copied().chain([one]).collect();
        self.evidence_of_gain(model.explained() + model.gain(one).gain, &all, &[], folds)
    }

    fn evidence_of_gain(
        &self,
        explained: f64,
        group: &[usize],
        rest: &[usize],
        folds: &[usize],
    ) -> Result<f64, IdentifyError> {
        let without = self.projection_of(rest, folds)?;
        let gain = Gain {
            gain: explained - without.explained(),
            freedom: group.iter().map(|c| self.moments.count[*c] + self.moments.numbers[*c]).sum(),
        };
        Ok(self.evidence(&gain, self.variance(&without)))
    }

    /// Divides the chosen candidates into those that follow a driver and the others.
    fn following(&self, driver: &Driver, chosen: &[usize]) -> (Vec<usize>, Vec<usize>) {
        chosen.iter().partition(|candidate| self.candidates[**candidate].effect.driver == *driver)
    }

    /// The candidate of a pool with a larger value than a group, if there is one.
    fn shorter_description(
        &self,
        group: &[usize],
        rest: &[usize],
        pool: &[usize],
        folds: &[usize],
    ) -> Result<Option<usize>, IdentifyError> {
        let without = self.model_of(rest, folds)?;
        let variance = self.variance(&without);
        let choice = self.choice();
        let of_group = self.evidence_of(group, rest, folds)? - self.description_length(group);
        let others: Vec<usize> = pool.iter().copied().filter(|c| !group.contains(c)).collect();
        let scores =
            parallel::map(others.len(), &|k| self.score(others[k], &without.gain(others[k]), variance) - choice);
        let better = others.into_iter().zip(scores).filter(|(_, one)| *one > of_group);
        Ok(better.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(c, _)| c))
    }
}
