//! The parameters of a session, and the components of the readings that each parameter affects.

mod basis;
mod preference;

use std::collections::BTreeSet;
use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::driver::Reference;
use abbe_model::effect::{CoefficientPrior, Component, Effect};
use abbe_model::instrument::InstrumentKind;
use abbe_model::parameter_id::{EffectId, ParameterId, Part};
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::{Prior, Session, Test};
use abbe_model::unit::InternalUnit;

use crate::error;
use crate::set_up_points::{point_mm, points};
use crate::unit::ParameterUnit;
use basis::BasisOverTest;
pub(crate) use preference::{kind, natural, pivot_preference};

/// One parameter.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// What it is. A number of a shape is its change from the number of the shape.
    pub id: ParameterId,
    /// Display unit.
    pub unit: ParameterUnit,
    /// Physical size, internal units: 1 mm, 0.01 rad, or the value that changes the component by that much.
    pub size: f64,
    /// The prior.
    pub prior: Prior,
    /// Index of its effect among the effects, of a coefficient or a number of a shape.
    pub effect: Option<usize>,
    /// Index among the coefficients of its effect, or among the numbers of its shape.
    pub index: usize,
    /// Where it was found before the fit, less the stated value, internal units: a coordinate of a free point. Estimates
    /// count from there.
    pub found: f64,
}

impl Parameter {
    /// The effect of which it is a coefficient.
    pub fn coefficient_of(&self) -> Option<usize> {
        self.effect.filter(|_| self.id.is_coefficient())
    }

    /// The effect of whose shape it is a number.
    pub fn number_of(&self) -> Option<usize> {
        self.effect.filter(|_| self.id.is_number())
    }
}

/// The contribution of a parameter to a slot of a test: a constant, or a basis function row by row.
#[derive(Clone, Debug)]
pub struct SlotContribution {
    /// Index of the parameter.
    pub parameter: usize,
    /// The slot.
    pub slot: usize,
    /// The basis function; `None` is 1.
    pub basis: Option<Arc<Vec<f64>>>,
}

/// The parameters that affect the readings of one test. A test of a large session depends on few of the session's
/// parameters.
#[derive(Clone, Debug, Default)]
pub struct TestParameters {
    /// The slots that depend on a parameter.
    pub slots: Vec<usize>,
    /// The parameters, by index in the session.
    pub parameters: Vec<usize>,
    /// For each slot, the parameters that it depends on (index within `parameters`) and their basis functions.
    pub contributions: Vec<Vec<(usize, Option<Arc<Vec<f64>>>)>>,
}

impl TestParameters {
    /// Collects the parameters and slots of a test from their contributions.
    pub fn of(contributions: &[SlotContribution]) -> TestParameters {
        let sorted = |numbers: &mut dyn Iterator<Item = usize>| {
            let numbers: BTreeSet<usize> = numbers.collect();
            numbers.into_iter().collect::<Vec<usize>>()
        };
        let slots = sorted(&mut contributions.iter().map(|contribution| contribution.slot));
        let parameters = sorted(&mut contributions.iter().map(|contribution| contribution.parameter));
        let mut by_slot = vec![Vec::new(); slots.len()];
        for contribution in contributions {
            let slot = slots.partition_point(|slot| *slot < contribution.slot);
            let index = parameters.partition_point(|parameter| *parameter < contribution.parameter);
            by_slot[slot].push((index, contribution.basis.clone()));
        }
        TestParameters { slots, parameters, contributions: by_slot }
    }
}

/// The parameters of a session.
#[derive(Clone, Debug, Default)]
pub struct Parameters {
    /// Errors first, then set-up quantities, then of each effect the coefficients and the estimated numbers of its shape.
    pub list: Vec<Parameter>,
    /// For each test with readings, the contributions of parameters to slots.
    pub contributions: Vec<Vec<SlotContribution>>,
    /// For each test with readings, known errors beside the parameters; none if empty.
    pub known: Vec<SlotValues>,
    /// The effects whose coefficients are parameters.
    pub effects: Vec<Effect>,
    /// Their identifiers.
    pub effect_ids: Vec<Arc<EffectId>>,
}

/// The prior standard deviation from which its estimation starts, in physical sizes.
const START_OF_SCALE: f64 = 0.01;

/// The physical size of a delay, s.
pub const LONG_DELAY_S: f64 = 0.1;

/// The physical size of a component.
pub fn physical_size(unit: InternalUnit) -> f64 {
    match unit {
        InternalUnit::Millimetre => 1.0,
        InternalUnit::Radian => 0.01,
        InternalUnit::Ratio => 0.01,
    }
}

/// Largest plausible coefficient of an effect over its physical size, by the unit of its component: 0.1 mm and 1 mrad on
/// a machine tool, ten times as much on the robots and long chains that trackers and sockets measure; a gain error of 0.1;
/// a delay (no unit) of 0.1 s.
pub fn largest_plausible_share(unit: Option<InternalUnit>, instrument: InstrumentKind) -> f64 {
    match unit {
        Some(InternalUnit::Ratio) => 10.0,
        Some(_) if instrument.is_two_sided() => 0.1,
        _ => 1.0,
    }
}

impl Parameters {
    /// The declared errors and set-up quantities of a session. `tests` are the tests with readings, `models` their
    /// models.
    ///
    /// # Errors
    /// If an error belongs to no axis of the machine or is declared twice.
    pub fn declared(session: &Session, tests: &[Test], models: &[TestModel]) -> Result<Parameters, Diagnostic> {
        let mut parameters = Parameters { contributions: vec![Vec::new(); tests.len()], ..Parameters::default() };
        for name in &session.unknowns {
            let Some(slot) = session.machine.error_slot(name) else {
                return Err(error::no_axis(&session.machine, format!("`{name}`: "), &name.axis));
            };
            let unit = name.freedom.unit();
            let index = parameters.push(Parameter {
                id: ParameterId::Error(name.clone()),
                unit: unit.displayed().into(),
                size: physical_size(unit),
                prior: Prior::Free,
                effect: None,
                index: 0,
                found: 0.0,
            })?;
            for (test, model) in models.iter().enumerate() {
                if model.effective_slots().contains(&slot) {
                    parameters.contributions[test].push(SlotContribution { parameter: index, slot, basis: None });
                }
            }
        }
        for (position, test) in tests.iter().enumerate() {
            for (component, unknown) in test.station.kind().unknowns().iter().enumerate() {
                let prior = test.priors[component];
                if prior == Prior::Known {
                    continue;
                }
                let id = unknown.id(test.group(unknown.shared_by));
                let index = match parameters.list.iter().position(|p| p.id == id) {
                    Some(index) => {
                        // Tests that share a component state its prior once. The smallest standard uncertainty holds.
                        let shared = &mut parameters.list[index].prior;
                        *shared = tighter(*shared, prior);
                        index
                    }
                    None => parameters.push(Parameter {
                        id,
                        unit: unknown.unit.displayed().into(),
                        size: physical_size(unknown.unit),
                        prior,
                        effect: None,
                        index: 0,
                        found: found_before_fit(session, test, component),
                    })?,
                };
                let slot = session.machine.error_slots() + component;
                parameters.contributions[position].push(SlotContribution { parameter: index, slot, basis: None });
            }
        }
        Ok(parameters)
    }

    fn push(&mut self, parameter: Parameter) -> Result<usize, Diagnostic> {
        if self.list.iter().any(|present| present.id == parameter.id) {
            return Err(error::repeated_unknown(parameter.id));
        }
        self.list.push(parameter);
        Ok(self.list.len() - 1)
    }

    /// Adds the coefficients of an effect.
    ///
    /// # Errors
    /// If the data lack the driver's column, the instrument lacks the component, or the effect is already declared.
    pub fn add_effect(
        &mut self,
        session: &Session,
        tests: &[Test],
        models: &[TestModel],
        reference: &Reference,
        effect: &Effect,
    ) -> Result<(), Diagnostic> {
        let size = match effect.component.unit(&session.instrument_parameters()) {
            Some(unit) => physical_size(unit),
            None if effect.component == Component::TriggerDelay => LONG_DELAY_S,
            None => {
                return Err(Diagnostic::identification(format!(
                    "effect `{}`: a {} session has no component `{}`",
                    effect.id(),
                    session.instrument.word(),
                    effect.component
                )));
            }
        };
        let prior = match effect.prior {
            CoefficientPrior::Flat => Prior::Free,
            CoefficientPrior::Scale(scale) => Prior::Gaussian(scale),
            // The start of the estimation.
            CoefficientPrior::Family(_) => Prior::Gaussian(START_OF_SCALE * size),
        };
        let number = self.effects.len();
        let first = self.list.len();
        if self.effects.contains(effect) {
            return Err(error::repeated_unknown(effect.id()));
        }
        let earlier = self.effects.iter().filter(|other| other.id() == effect.id()).count();
        let id = Arc::new(EffectId::of(effect, earlier + 1));
        let mut largest = vec![0.0_f64; effect.shape.coefficients()];
        for (position, (test, model)) in tests.iter().zip(models).enumerate() {
            let Some(basis) = BasisOverTest::of(session, test, model, reference, effect)? else { continue };
            for (most, column) in largest.iter_mut().zip(&basis.columns) {
                *most = column.iter().fold(*most, |most, value| most.max(value.abs()));
            }
            self.contributions[position].extend(basis.contributions(first));
        }
        for (k, name) in effect.shape.coefficient_names().into_iter().enumerate() {
            self.push(Parameter {
                id: ParameterId::Effect(Arc::clone(&id), Part::Coefficient(name)),
                unit: ParameterUnit::of_effect(session, effect, k),
                size: if largest[k] > 0.0 { size / largest[k] } else { size },
                prior,
                effect: Some(number),
                index: k,
                found: 0.0,
            })?;
        }
        for which in &effect.estimated {
            let width = effect.width_of_number(*which);
            self.push(Parameter {
                id: ParameterId::Effect(Arc::clone(&id), Part::Number(effect.shape.number_names()[*which].to_string())),
                unit: ParameterUnit::of_number(session, effect),
                size: width,
                prior: Prior::Gaussian(width),
                effect: Some(number),
                index: *which,
                found: 0.0,
            })?;
        }
        self.effects.push(effect.clone());
        self.effect_ids.push(id);
        Ok(())
    }

    /// The same parameters without the coefficients of families whose prior scale is estimated, and the index of each
    /// remaining parameter among all. The contributions of the effects are removed, the list of effects is not.
    pub(crate) fn without_families(&self) -> (Parameters, Vec<usize>) {
        let of_family = |parameter: &Parameter| {
            parameter.coefficient_of().is_some_and(|effect| self.effects[effect].family().is_some())
        };
        let kept: Vec<usize> = (0..self.list.len()).filter(|j| !of_family(&self.list[*j])).collect();
        let contribution = |contribution: &SlotContribution| {
            let parameter = kept.binary_search(&contribution.parameter).ok()?;
            Some(SlotContribution { parameter, ..contribution.clone() })
        };
        let parameters = Parameters {
            list: kept.iter().map(|j| self.list[*j].clone()).collect(),
            contributions: self
                .contributions
                .iter()
                .map(|test| test.iter().filter_map(contribution).collect())
                .collect(),
            ..self.clone()
        };
        (parameters, kept)
    }

    /// Whether numbers of shapes are among the parameters.
    pub(crate) fn has_numbers(&self) -> bool {
        self.effects.iter().any(|effect| !effect.estimated.is_empty())
    }

    /// The positions of shapes that a fit estimates: the effect and the place among its positions.
    pub(crate) fn positions(&self) -> impl Iterator<Item = (usize, usize)> {
        let estimated = self.effects.iter().enumerate().filter(|(_, effect)| effect.positions_estimated);
        estimated.flat_map(|(number, effect)| (0..effect.shape.positions().len()).map(move |step| (number, step)))
    }

    /// The values of the driver of an effect at the readings of the tests in which it acts, ascending, each once.
    ///
    /// # Errors
    /// If the data lack the column of the driver.
    pub(crate) fn levels(
        session: &Session,
        tests: &[Test],
        models: &[TestModel],
        reference: &Reference,
        effect: &Effect,
    ) -> Result<Vec<f64>, Diagnostic> {
        let mut levels = Vec::new();
        for (test, model) in tests.iter().zip(models) {
            levels
                .extend(BasisOverTest::of(session, test, model, reference, effect)?.into_iter().flat_map(|b| b.driver));
        }
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        Ok(levels)
    }

    /// The value of a parameter at the parameters `beta`, internal units: a number of a shape is stated itself, not as its
    /// change; a coordinate of a point of the set-up counts from the stated one, not from where it was found.
    pub fn value(&self, parameter: usize, beta: &[f64]) -> f64 {
        match self.list[parameter].number_of() {
            Some(effect) => self.effects[effect].shape.number(self.list[parameter].index) + beta[parameter],
            None => self.list[parameter].found + beta[parameter],
        }
    }

    /// Adds the changes of estimated numbers in `beta` to the shapes, sets them to zero, and linearises the model in these
    /// numbers at the coefficients in `beta`, with the positions that the shapes have now:
    ///
    /// ```text
    /// ∂component/∂n = Σ_k c_k · ∂b_k(driver; n)/∂n
    /// ```
    ///
    /// # Errors
    /// If the data lack the column of a driver.
    pub(crate) fn linearise_numbers(
        &mut self,
        session: &Session,
        tests: &[Test],
        models: &[TestModel],
        reference: &Reference,
        beta: &mut [f64],
    ) -> Result<(), Diagnostic> {
        for index in 0..self.effects.len() {
            if self.effects[index].estimated.is_empty() && !self.effects[index].positions_estimated {
                continue;
            }
            let places: Vec<usize> = (0..self.list.len()).filter(|j| self.list[*j].effect == Some(index)).collect();
            let count = self.effects[index].shape.coefficients();
            let (coefficients, numbers) = places.split_at(count);
            let mut effect = self.effects[index].clone();
            for (j, which) in numbers.iter().zip(&self.effects[index].estimated) {
                let number = effect.shape.number(*which) + std::mem::take(&mut beta[*j]);
                effect.shape = effect.shape.with_number(*which, number);
            }
            let values: Vec<f64> = coefficients.iter().map(|j| beta[*j]).collect();
            for (position, (test, model)) in tests.iter().zip(models).enumerate() {
                let contributions = &mut self.contributions[position];
                contributions.retain(|contribution| !places.contains(&contribution.parameter));
                let over = |effect: &Effect| BasisOverTest::of(session, test, model, reference, effect);
                let Some(basis) = over(&effect)? else { continue };
                contributions.extend(basis.contributions(coefficients[0]));
                for (parameter, which) in numbers.iter().zip(&effect.estimated) {
                    let ([less, more], step) = effect.around_number(*which);
                    if let (Some(less), Some(more)) = (over(&less)?, over(&more)?) {
                        contributions.extend(more.less(&less, &values, step, *parameter));
                    }
                }
            }
            self.effects[index] = effect;
        }
        Ok(())
    }

    /// The components of every test at the parameters `beta` (internal units).
    pub fn slot_values(&self, models: &[TestModel], beta: &[f64]) -> Vec<SlotValues> {
        self.contributions
            .iter()
            .zip(models)
            .enumerate()
            .map(|(test, (contributions, model))| {
                let mut values = self.known.get(test).cloned().unwrap_or_else(|| SlotValues::zero(model.slots()));
                for contribution in contributions {
                    let coefficient = beta[contribution.parameter];
                    if coefficient == 0.0 {
                        continue;
                    }
                    match &contribution.basis {
                        None => values.constant[contribution.slot] += coefficient,
                        Some(basis) => {
                            let index = match values.varying.iter().position(|(slot, _)| *slot == contribution.slot) {
                                Some(index) => index,
                                None => {
                                    values.varying.push((contribution.slot, vec![0.0; model.rows()]));
                                    values.varying.len() - 1
                                }
                            };
                            let column = &mut values.varying[index].1;
                            column.iter_mut().zip(basis.iter()).for_each(|(sum, b)| *sum += coefficient * b);
                        }
                    }
                }
                values
            })
            .collect()
    }
}

/// By how much a coordinate of a free point of a test differs from the stated one, mm.
fn found_before_fit(session: &Session, test: &Test, component: usize) -> f64 {
    let Some(stated) = session.tests.iter().find(|stated| stated.name == test.name) else { return 0.0 };
    let within = |first: usize| component.checked_sub(first).filter(|coordinate| *coordinate < 3);
    let mut sides = points(&test.station).into_iter().enumerate();
    let place = sides.find_map(|(side, first)| Some((side, within(first?)?)));
    let coordinate = |station| place.and_then(|(side, coordinate)| Some(point_mm(station, side)?[coordinate]));
    coordinate(&test.station).zip(coordinate(&stated.station)).map_or(0.0, |(found, stated)| found - stated)
}

fn tighter(a: Prior, b: Prior) -> Prior {
    match (a, b) {
        (Prior::Known, _) | (_, Prior::Known) => Prior::Known,
        (Prior::Gaussian(a), Prior::Gaussian(b)) => Prior::Gaussian(a.min(b)),
        (Prior::Gaussian(u), Prior::Free) | (Prior::Free, Prior::Gaussian(u)) => Prior::Gaussian(u),
        (Prior::Free, Prior::Free) => Prior::Free,
    }
}
