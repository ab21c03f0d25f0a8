//! Sessions and models as inputs of a comparison. Each session is fitted with the errors and effects of all inputs, so
//! that their parameters are the same.

use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::effect::Effect;
use abbe_model::session::Session;

use super::results::{Comparison, ExcludedReading, InputNotJudged};
use super::{CompareOptions, Named, compare, one_machine};
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

/// An input as it is compared.
struct Prepared {
    model: IdentifiedModel,
    /// The readings that its fit excludes.
    outliers: Vec<Outlier>,
    not_judged: Option<NotQuotable>,
}

/// √(χ²/ν) of an input whose estimates are not to be quoted, and why; whether it is a session.
type NotQuotable = (bool, f64, &'static str);

/// The models of all inputs. Sessions are fitted with the errors and effects that any input has: those of models too,
/// since a session without the effects of a model differs from it by their bias.
///
/// # Errors
/// If a session cannot be fitted, for example because its data lack what an effect follows.
fn models(inputs: Vec<Input>, seed: u64) -> Result<Vec<Prepared>, Diagnostic> {
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
        Input::Model(model) => {
            let not_judged = model.forbids_decisions().map(|why| (false, model.fit.u_enlargement, why));
            Ok(Prepared { model: *model, outliers: Vec::new(), not_judged })
        }
        Input::Session(session) => {
            let own = session.effects.iter().filter(|effect| !effect.tests.is_empty()).cloned();
            let effects = effects.iter().cloned().chain(own).collect();
            let session = Session { unknowns: errors.clone(), effects, ..*session };
            let (problem, fit) = fit::prepare(&session, seed)?;
            let goodness = fit::outcome::goodness(&problem, &fit);
            let not_judged = goodness.forbids_decisions().filter(|_| !goodness.quotable);
            Ok(Prepared {
                model: IdentifiedModel::of_fit(&problem, &fit, Provenance::default())?,
                outliers: fit::outliers(&problem, &fit),
                not_judged: not_judged.map(|why| (true, fit.birge_ratio, why)),
            })
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
) -> Result<Comparison, Diagnostic> {
    for (name, input) in names.iter().zip(&inputs).skip(1) {
        one_machine((&names[0], inputs[0].machine()), (name, input.machine()))?;
    }
    let prepared = models(inputs, seed)?;
    let excluded = names.iter().zip(&prepared).flat_map(|(input, own)| {
        own.outliers.iter().map(|outlier| ExcludedReading { input: input.clone(), outlier: outlier.clone() })
    });
    let outliers = excluded.collect();
    let not_judged: Vec<InputNotJudged> = (names.iter().zip(&prepared))
        .filter_map(|(input, own)| {
            let (is_session, birge_ratio, why) = own.not_judged?;
            Some(InputNotJudged { input: input.clone(), is_session, birge_ratio, why: why.to_string() })
        })
        .collect();
    let named = names.into_iter().zip(&prepared).map(|(name, own)| Named { name, model: &own.model });
    let mut found = Comparison { outliers, ..compare(&named.collect::<Vec<_>>(), options)? };
    // An effect that a model lacks biases its estimates, and no uncertainty of a difference covers that.
    let is_judged = |from: &str, to: &str| !not_judged.iter().any(|own| own.input == from || own.input == to);
    for pair in found.pairs.iter_mut().filter(|pair| !is_judged(&pair.from, &pair.to)) {
        (pair.judged, pair.significant) = (false, 0);
        pair.single_changes.clear();
    }
    for difference in &mut found.differences {
        difference.significant &= is_judged(&difference.from, &difference.to);
    }
    found.not_judged = not_judged;
    Ok(found)
}
