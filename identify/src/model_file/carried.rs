//! The part of a model that another session of the same machine shares, and the errors of the machine at any state.
//!
//! Location errors, and effects on errors of axes in all tests, belong to the machine. Set-up quantities, effects on
//! the set-up or on the instrument (a gain, a delay of its trigger), and effects of single tests belong to the session
//! of the model.

use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::component::ErrorName;
use abbe_model::effect::{Component, Effect};
use abbe_model::instrument::Station;
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};

use super::IdentifiedModel;
use super::errors::{EstimatedErrors, MachineErrors};
use crate::parameters::{Parameters, SlotContribution};

/// States of the machine at which its errors are evaluated, and the points that gravity loads.
#[derive(Clone, Debug)]
pub struct States {
    /// Axis positions, and time, temperature and runs if effects follow them. Directions of travel and speeds follow
    /// from the sequence of positions in a run. Observed values are not used.
    pub readings: Readings,
    /// The load point in the tool frame, mm.
    pub tool_mm: [f64; 3],
    /// The load point in the table frame, mm.
    pub table_mm: [f64; 3],
}

impl IdentifiedModel {
    /// Whether an effect belongs to the machine, so that another session shares it.
    pub fn is_carried(effect: &Effect) -> bool {
        effect.tests.is_empty() && matches!(effect.component, Component::Axis(_))
    }

    /// The effects that belong to the machine, by index in [`IdentifiedModel::effects`].
    pub fn carried_effects(&self) -> impl Iterator<Item = usize> {
        (0..self.effects.len()).filter(|effect| IdentifiedModel::is_carried(&self.effects[*effect]))
    }

    /// The parameters that belong to the machine, by index in [`IdentifiedModel::parameters`]: location errors, then
    /// coefficients of effects.
    pub fn carried_parameters(&self) -> Vec<usize> {
        let carried = |j: &usize| match self.parameters[*j].effect {
            Some(effect) => IdentifiedModel::is_carried(&self.effects[effect]),
            None => self.parameters[*j].id.is_error(),
        };
        (0..self.parameters.len()).filter(carried).collect()
    }

    /// The estimate of a parameter, internal units: a number of a shape is stated itself, not as its change.
    pub fn estimate(&self, parameter: usize) -> f64 {
        let parameter = &self.parameters[parameter];
        match (parameter.effect, parameter.index) {
            (Some(effect), Some(index)) if parameter.id.is_number() => {
                self.effects[effect].shape.number(index) + parameter.value
            }
            _ => parameter.value,
        }
    }

    /// The location errors of the model.
    pub fn errors(&self) -> Vec<ErrorName> {
        self.parameters.iter().filter_map(|parameter| parameter.id.error().cloned()).collect()
    }

    /// A session of this machine with the parameters of the model: its location errors and the effects that belong to
    /// the machine. Their order is that of [`IdentifiedModel::carried_parameters`], location errors before set-up
    /// quantities before coefficients.
    pub fn session(&self, session: &Session) -> Session {
        Session {
            unknowns: self.errors(),
            effects: self.carried_effects().map(|effect| self.effects[effect].clone()).collect(),
            ..session.clone()
        }
    }

    /// How each parameter of the machine changes the errors of the machine at some states: `error[slot] += value · b`
    /// with the basis function `b` row by row (`None`: 1). The parameter of a contribution is an index in
    /// [`IdentifiedModel::carried_parameters`]; slots are those of [`abbe_model::chain::Machine::error_slot`].
    ///
    /// With `b` of one slot at one state, its error is `bᵀβ` and the variance of the error `bᵀ·Cov·b`.
    ///
    /// # Errors
    /// If the states lack what an effect follows: time, temperature.
    pub fn contributions(&self, states: &States) -> Result<Vec<SlotContribution>, Diagnostic> {
        let parameters = self.at_states(states)?;
        Ok(parameters.contributions.into_iter().flatten().collect())
    }

    /// The errors of the machine at some states, mm and rad.
    ///
    /// # Errors
    /// As [`IdentifiedModel::contributions`].
    pub fn errors_at(&self, states: &States) -> Result<SlotValues, Diagnostic> {
        let errors = EstimatedErrors::of_model(self, states.tool_mm, states.table_mm);
        let near = errors.along(&states.readings)?;
        near(&states.readings)
    }

    /// The parameters of the machine over some states, without set-up quantities.
    fn at_states(&self, states: &States) -> Result<Parameters, Diagnostic> {
        // A reading that connects both load points is affected by all errors.
        let station = Station::between(states.table_mm, states.tool_mm, 1.0);
        let machine = Arc::new(self.machine.clone());
        let model = TestModel::new(Arc::clone(&machine), station.clone(), &states.readings);
        let session = self.session(&Session::new(self.machine.clone(), station.kind()));
        let readings = Some(Arc::new(states.readings.clone()));
        let test = Test { readings, ..Test::new("", station, self.machine.axes.len()) };
        let (tests, models) = (vec![test], vec![model]);
        let mut parameters = Parameters::declared(&session, &tests, &models)?;
        for effect in &session.effects {
            parameters.add_effect(&session, &tests, &models, &self.reference, effect)?;
        }
        let mut beta: Vec<f64> = self.carried_parameters().iter().map(|j| self.parameters[*j].value).collect();
        parameters.linearise_numbers(&session, &tests, &models, &self.reference, &mut beta)?;
        Ok(parameters)
    }
}
