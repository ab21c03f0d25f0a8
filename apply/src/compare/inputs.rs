//! Sessions and models as inputs of a comparison. Each session is fitted with the errors and effects of all inputs, so
//! that their parameters are the same.

use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::effect::Effect;
use abbe_model::session::Session;

use super::results::{Comparison, ExcludedReading};
use super::{CompareOptions, Named, compare, one_machine};
use crate::ApplyError;
use abbe_identify::fit;
use abbe_identify::model_file::{IdentifiedModel, Provenance};
use abbe_identify::results::Outlier;

/// An input of a comparison.
#[derive(Clone)]
pub enum Input {
    /// A saved model.
    Model(Box<IdentifiedModel>),
    /// A session.
    Session(Box<Session>),
}

impl Input {
    /// Its machine.
    pub fn machine(&self) -> &Machine {
        match self {
            Input::Model(model) => &model.machine,
            Input::Session(session) => &session.machine,
        }
    }

    /// The location errors that it estimates.
    fn errors(&self) -> Vec<ErrorName> {
        match self {
            Input::Model(model) => model.errors(),
            Input::Session(session) => session.unknowns.clone(),
        }
    }

    /// Its effects that act in other sessions of the machine too.
    fn effects(&self) -> Vec<Effect> {
        match self {
            Input::Model(model) => model.carried_effects().map(|effect| model.effects[effect].clone()).collect(),
            Input::Session(session) => {
                session.effects.iter().filter(|effect| effect.tests.is_empty()).cloned().collect()
            }
        }
    }
}

/// The models of all inputs, each with the readings that its fit excludes as outliers. Sessions are fitted with the errors and effects that any input has: those of models too,
/// since a session without the effects of a model differs from it by their bias.
///
/// # Errors
/// If a session cannot be fitted, for example because its data lack what an effect follows.
fn models(inputs: Vec<Input>, seed: u64) -> Result<Vec<(IdentifiedModel, Vec<Outlier>)>, ApplyError> {
    let mut errors: Vec<ErrorName> = Vec::new();
    let mut effects: Vec<Effect> = Vec::new();
    for input in &inputs {
        for error in input.errors() {
            if !errors.contains(&error) {
                errors.push(error);
            }
        }
        for effect in input.effects() {
            if !effects.iter().any(|known| known.is_same(&effect)) {
                effects.push(effect);
            }
        }
    }
    let model = |input: Input| match input {
        Input::Model(model) => Ok((*model, Vec::new())),
        Input::Session(session) => {
            let own = session.effects.iter().filter(|effect| !effect.tests.is_empty()).cloned();
            let effects = effects.iter().cloned().chain(own).collect();
            let session = Session { unknowns: errors.clone(), effects, ..*session };
            let (problem, fit) = fit::prepare(&session, seed)?;
            let outliers = fit::outliers(&problem, &fit);
            Ok((IdentifiedModel::of_fit(&problem, &fit, Provenance::default())?, outliers))
        }
    };
    inputs.into_iter().map(model).collect()
}

/// Compares inputs, each with its name in the result, with the first one.
///
/// # Errors
/// If the inputs are of different machines, or a session cannot be fitted.
pub fn compare_inputs(
    names: Vec<String>,
    inputs: Vec<Input>,
    options: &CompareOptions,
    seed: u64,
) -> Result<Comparison, ApplyError> {
    for (name, input) in names.iter().zip(&inputs).skip(1) {
        one_machine((&names[0], inputs[0].machine()), (name, input.machine()))?;
    }
    let (models, outliers): (Vec<IdentifiedModel>, Vec<Vec<Outlier>>) = models(inputs, seed)?.into_iter().unzip();
    let excluded = names.iter().zip(outliers).flat_map(|(input, outliers)| {
        outliers.into_iter().map(|outlier| ExcludedReading { input: input.clone(), outlier })
    });
    let outliers = excluded.collect();
    let named: Vec<Named<'_>> = names.into_iter().zip(&models).map(|(name, model)| Named { name, model }).collect();
    Ok(Comparison { outliers, ..compare(&named, options)? })
}
