//! The candidates that a search may add: the library's detectable effects, and the effects that it has tuned itself.

use std::collections::HashMap;
use std::sync::Arc;

use abbe_identify::numerics::parallel;
use abbe_model::Diagnostic;
use abbe_model::driver::Driver;
use abbe_model::effect::{Component, Effect, Shape};

use super::SearchState;
use super::tuning::Tuned;
use crate::candidates::candidate::Candidate;
use crate::candidates::gain::TrainedModel;
use crate::candidates::step_table::{StepTable, best_step_table};
use crate::constants::MIN_PLAUSIBLE_SIGMA;

/// The range of each shape number over the members of a library, by identifier.
pub(super) fn number_ranges(library: &[Candidate]) -> HashMap<String, Vec<[f64; 2]>> {
    let mut ranges: HashMap<String, Vec<[f64; 2]>> = HashMap::new();
    for member in library {
        let own = member.brackets();
        let all = ranges.entry(member.effect.id()).or_insert_with(|| own.clone());
        all.iter_mut().zip(own).for_each(|(all, [low, high])| *all = [all[0].min(low), all[1].max(high)]);
    }
    ranges
}

impl SearchState<'_> {
    /// Judges for each candidate whether it is detectable at its largest plausible size.
    pub(super) fn judge_detectability(&mut self) -> Result<(), Diagnostic> {
        let model = self.model_without(None)?;
        let detectable: Vec<bool> = parallel::map(self.candidates.len(), &|candidate| {
            let d = model.projected(candidate)?.d;
            let plausible = self.columns.plausible(self.effect(candidate), &self.candidates[candidate].columns);
            let largest = (0..d.nrows()).map(|k| d[(k, k)]).fold(0.0, f64::max);
            Ok(plausible * largest.max(0.0).sqrt() >= MIN_PLAUSIBLE_SIGMA)
        })
        .into_iter()
        .collect::<Result<_, Diagnostic>>()?;
        drop(model);
        self.detectable_effects = detectable.iter().filter(|detectable| **detectable).count();
        for (candidate, detectable) in self.candidates.iter_mut().zip(detectable) {
            Arc::make_mut(candidate).detectable = detectable;
        }
        Ok(())
    }

    /// Whether a branch with some training folds may add a candidate now.
    pub fn may_be_added(&self, candidate: usize, folds: &[usize]) -> bool {
        let Candidate { detectable, forbidden, dictionary, last_resort, .. } = *self.candidates[candidate];
        let possible = !forbidden
            && detectable
            && !dictionary
            && (!last_resort || self.last_resort)
            && self.may_be_used(candidate, folds);
        possible && (self.passed_over.is_empty() || !self.passed_over.contains(&self.kind(candidate)))
    }

    /// Gives every branch the effects of the one on all readings, where the policy says so.
    pub fn follow_all_readings(&mut self) {
        if let (true, [all, folds @ ..]) = (self.policy.folds_follow, &mut self.selection.branches[..]) {
            folds.iter_mut().for_each(|fold| fold.selected.clone_from(&all.selected));
        }
    }

    /// Component and driver of a candidate.
    fn kind(&self, candidate: usize) -> (Component, Driver) {
        let effect = self.effect(candidate);
        (effect.component.clone(), effect.driver.clone())
    }

    /// Passes over the candidates of component and driver of the last selected effect until the list is cleared.
    pub fn pass_over_last(&mut self) {
        let last = self.selected().last().map(|selected| self.kind(selected.candidate));
        self.passed_over.extend(last);
    }

    /// Whether a candidate is an effect of the library or was tuned on exactly these folds.
    pub fn may_be_used(&self, candidate: usize, folds: &[usize]) -> bool {
        let tuned_on = &self.candidates[candidate].tuned_on;
        tuned_on.is_empty() || tuned_on == folds
    }

    /// Whether a candidate has shape numbers or positions that the search tunes.
    pub fn is_tunable(&self, candidate: usize) -> bool {
        self.gram.numbers(candidate) > 0 || !self.effect(candidate).shape.positions().is_empty()
    }

    /// Whether one of some candidates is a table of more than two steps.
    pub fn is_composed(&self, group: &[usize]) -> bool {
        group.iter().any(|c| self.effect(*c).shape.positions().len() > 2)
    }

    /// The axes that the selected effects of a branch follow, each once.
    pub fn axes_followed(&self, branch: usize) -> Vec<Driver> {
        let mut drivers: Vec<Driver> = Vec::new();
        for candidate in self.selection.branches[branch].chosen() {
            let driver = &self.effect(candidate).driver;
            if matches!(driver, Driver::Axis(_)) && !drivers.contains(driver) {
                drivers.push(driver.clone());
            }
        }
        drivers
    }

    /// Divides the selected effects of a branch into those that follow a driver and the others.
    pub fn following(&self, driver: &Driver, branch: usize) -> (Vec<usize>, Vec<usize>) {
        let chosen = self.selection.branches[branch].chosen();
        chosen.into_iter().partition(|candidate| self.effect(*candidate).driver == *driver)
    }

    /// The selected waves of a branch with periods.
    pub fn waves(&self, branch: usize) -> Vec<usize> {
        let chosen = self.selection.branches[branch].chosen();
        chosen.into_iter().filter(|candidate| matches!(self.effect(*candidate).shape, Shape::Periodic(_))).collect()
    }

    /// Whether a shape number of an effect is outside the range of the library's members: the readings give the number no
    /// value, as of a spike that decays before the next reading, or over more than the travel.
    pub fn is_beyond_library(&self, effect: &Effect) -> bool {
        let outside = |(which, [low, high]): (usize, &[f64; 2])| !(*low..=*high).contains(&effect.shape.number(which));
        self.number_ranges.get(&effect.id()).is_some_and(|ranges| ranges.iter().enumerate().any(outside))
    }

    /// Searches some candidates no more, by identifier.
    pub fn forbid(&mut self, ids: &[String]) {
        for candidate in self.candidates.iter_mut().filter(|own| ids.contains(&own.effect.id())) {
            Arc::make_mut(candidate).forbidden = true;
        }
    }

    /// Whether a selected effect has several steps.
    pub fn has_staircase(&self) -> bool {
        self.selected().iter().any(|selected| self.effect(selected.candidate).shape.positions().len() > 1)
    }

    /// The identifiers of all staircases that the search can form.
    pub fn staircases(&self) -> Vec<String> {
        let has_positions = |own: &&Arc<Candidate>| own.dictionary && !own.effect.shape.positions().is_empty();
        self.candidates.iter().filter(has_positions).map(|own| own.effect.id()).collect()
    }

    /// The step tables from the library's dictionaries for addition to a model.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn step_tables(&self, model: &TrainedModel<'_>) -> Result<Vec<StepTable>, Diagnostic> {
        let variance = self.variance(model);
        let dictionaries: Vec<usize> = (0..self.candidates.len())
            .filter(|own| self.candidates[*own].dictionary && !self.candidates[*own].forbidden)
            .collect();
        let best = |k: usize| best_step_table(model, dictionaries[k], &self.candidates[dictionaries[k]], variance);
        let tables: Vec<Option<StepTable>> =
            parallel::map(dictionaries.len(), &best).into_iter().collect::<Result<_, Diagnostic>>()?;
        Ok(tables.into_iter().flatten().collect())
    }

    /// Adds tuned effects in addition to the candidates that they were tuned from, for the folds on which they were
    /// tuned. Returns the index of the first.
    pub(super) fn add_tuned(&mut self, tuned: Vec<Tuned>, folds: &[usize]) -> usize {
        let first = self.candidates.len();
        let candidates = tuned.into_iter().map(|Tuned { original, effect, selection_penalty }| {
            let original = Candidate::clone(&self.candidates[original]);
            let columns = self.columns.reshaped(&effect.shape, &original.columns.channel);
            let (dictionary, detectable) = (false, true);
            Candidate {
                effect,
                columns,
                selection_penalty,
                tuned_on: folds.to_vec(),
                dictionary,
                detectable,
                ..original
            }
        });
        let candidates = candidates.collect();
        self.append(candidates);
        first
    }

    /// Adds candidates. Their products are formed when they are needed.
    pub(super) fn append(&mut self, fresh: Vec<Candidate>) {
        if !fresh.is_empty() {
            self.gram.append(fresh.iter().map(|candidate| candidate.columns.clone()).collect());
            self.candidates.extend(fresh.into_iter().map(Arc::new));
        }
    }

    /// Takes over what a clone of this state has selected for a branch, and the effects that it has tuned.
    /// `common` is the number of candidates that both had when it was cloned.
    pub fn adopt(&mut self, branch: usize, from: &SearchState<'_>, common: usize) {
        let present = self.candidates.len();
        let mut place: HashMap<usize, usize> = HashMap::new();
        let mut tuned = Vec::new();
        for (index, candidate) in from.candidates.iter().enumerate().skip(common) {
            if !candidate.tuned_on.is_empty() {
                place.insert(index, present + tuned.len());
                tuned.push(Candidate::clone(candidate));
            }
        }
        self.append(tuned);
        let mut adopted = from.selection.branches[branch].clone();
        for selected in &mut adopted.selected {
            selected.candidate = place.get(&selected.candidate).copied().unwrap_or(selected.candidate);
        }
        self.selection.branches[branch] = adopted;
    }

    /// Curves over an axis, one for each test, without a component. Their columns are computed at the first call.
    pub fn test_curves(&mut self, driver: &Driver, intervals: usize) -> Vec<usize> {
        let fresh = self.columns.curves_of_tests(driver, intervals);
        let present: Vec<usize> =
            (0..self.candidates.len()).filter(|c| fresh.iter().any(|(effect, _)| effect == self.effect(*c))).collect();
        if !present.is_empty() {
            return present;
        }
        let first = self.candidates.len();
        self.append(fresh.into_iter().map(|(effect, columns)| Candidate::test_curve(effect, columns)).collect());
        (first..self.candidates.len()).collect()
    }
}
