//! A saved model against the readings of a session that it never saw.

use abbe_apply::compare::workspace::rms_of_moved;
use abbe_model::Diagnostic;
use abbe_model::component::ErrorName;
use abbe_trace::validate::{Validation, validate_anew};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Analysis, Command, Found, Given, Kind, Listener, unusable};
use crate::document::{Stated, StatedValidation, json};
use crate::report::block::Report;
use crate::report::commands::Commands;
use crate::report::table::Table;
use crate::report::validate as present;

/// The options of a validation.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct ValidationOptions {
    /// Errors of the machine that a new mounting changes, such as EC0AZ: estimated from SESSION like its set-up, not taken
    /// from the model. Separate several by commas.
    #[cfg_attr(feature = "command", arg(long, value_name = "ERROR", value_delimiter = ',', value_parser = known_error))]
    pub anew: Vec<String>,
}

/// The error of an axis of this name.
fn error(name: &str) -> Result<ErrorName, String> {
    let expected = "an error of an axis according to ISO 230-1 is expected, such as EC0C";
    ErrorName::parse(name).ok_or_else(|| expected.to_string())
}

#[cfg(feature = "command")]
fn known_error(name: &str) -> Result<String, String> {
    error(name).map(|_| name.to_string())
}

/// A validated model.
pub struct Validated {
    machine: String,
    validation: Validation,
}

impl Analysis for Validated {
    const NAME: &'static str = "validate";
    const COMMAND: Option<Command> = Some(Command {
        about: "Test a saved model on readings that it never saw.",
        help: include_str!("../cli/help/validate.txt"),
        reads: &[Kind::Model, Kind::Session],
    });
    type Options = ValidationOptions;
    type Result = StatedValidation<'static>;

    fn run(given: &[Given<'_>], options: &ValidationOptions, _: u64, _: Listener<'_>) -> Result<Self, Diagnostic> {
        let [Given::Model(model), Given::Session(session)] = given else {
            return Err(unusable("a model and a session are expected".to_string(), ""));
        };
        let anew = options.anew.iter().map(|name| error(name)).collect::<Result<Vec<_>, _>>()?;
        let mut validation = validate_anew(model, session, &anew)?;
        validation.result.volumetric_rms_um = rms_of_moved(model, &validation.result.moved)?;
        Ok(Validated { machine: session.machine.name.clone(), validation })
    }
}

impl Validated {
    fn stated(&self) -> StatedValidation<'_> {
        let result = &self.validation.result;
        Stated { statements: abbe_trace::statements::of_validation(result), result }
    }
}

impl Found for Validated {
    fn result(&self) -> serde_json::Result<Value> {
        json(&self.stated())
    }

    fn report(&self, commands: &Commands, _: bool) -> Result<Report, Diagnostic> {
        Ok(present::report(&self.machine, &self.validation, &self.stated(), commands))
    }

    fn tables(&self) -> Vec<Table> {
        let result = &self.validation.result;
        let moved = (!result.moved.is_empty()).then(|| present::moved(result));
        let without = (!result.without.is_empty()).then(|| present::without(result));
        std::iter::once(present::residuals(result)).chain(moved).chain(without).collect()
    }

    fn residuals_mm(&self, _: bool) -> Vec<(&str, &[f64])> {
        let Validation { tests, residuals, .. } = &self.validation;
        tests.iter().map(String::as_str).zip(residuals.iter().map(Vec::as_slice)).collect()
    }
}
