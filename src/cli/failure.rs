//! Errors on standard error: what was found and where, what to do, and an excerpt of the file.

use abbe::apply::ApplyError;
use abbe::fleet::FleetError;
use abbe::identify::IdentifyError;
use abbe::model::ModelError;
use abbe::plan::PlanError;

use super::excerpt::excerpt;
use super::interrupt;
use super::message::{Kind, lines, tell};

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Input that cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The identification failed.
    #[error(transparent)]
    Identify(IdentifyError),
    /// The plan failed.
    #[error(transparent)]
    Plan(PlanError),
    /// What is derived from a model failed.
    #[error(transparent)]
    Apply(ApplyError),
    /// The equation cannot be made.
    #[error(transparent)]
    Codegen(#[from] abbe::codegen::CodegenError),
    /// The results of a fleet cannot be read or written.
    #[error(transparent)]
    Fleet(abbe::fleet::FleetError),
    /// A file that cannot be written.
    #[error("{path}: cannot be written: {source}")]
    Write {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// Options that contradict each other.
    #[error("{0}")]
    CommandLine(String),
    /// The user interrupted the work. The results found until then have been written.
    #[error("{0}")]
    Interrupted(String),
    /// Any other error.
    #[error("{0}")]
    Other(String),
}

impl From<IdentifyError> for Failure {
    fn from(error: IdentifyError) -> Self {
        match error {
            IdentifyError::Model(error) => Failure::Model(error),
            error @ IdentifyError::NotInTheLibrary { .. } => {
                Failure::Other(format!("{error}; `abbe trace --list` lists all candidates"))
            }
            other => Failure::Identify(other),
        }
    }
}

impl From<PlanError> for Failure {
    fn from(error: PlanError) -> Self {
        match error {
            PlanError::Identify(error) => error.into(),
            other => Failure::Plan(other),
        }
    }
}

impl From<ApplyError> for Failure {
    fn from(error: ApplyError) -> Self {
        match error {
            ApplyError::Identify(error) => error.into(),
            other => Failure::Apply(other),
        }
    }
}

impl From<FleetError> for Failure {
    fn from(error: FleetError) -> Self {
        match error {
            FleetError::Model(error) => Failure::Model(error),
            other => Failure::Fleet(other),
        }
    }
}

impl From<String> for Failure {
    fn from(message: String) -> Self {
        Failure::Other(message)
    }
}

impl Failure {
    /// The exit status: 1 for input that cannot be used, 2 for a wrong command line, 130 or 143 for an interruption.
    pub fn status(&self) -> u8 {
        match self {
            Failure::CommandLine(_) => 2,
            Failure::Interrupted(_) => interrupt::status(),
            _ => 1,
        }
    }

    /// Writes the message to standard error.
    pub fn show(&self) {
        if let Failure::Interrupted(message) = self {
            eprintln!("{message}");
            return;
        }
        tell(Kind::Error, &self.to_string());
        if let Failure::Model(error) = self
            && let Some(excerpt) = error.location().and_then(excerpt)
        {
            lines(&excerpt);
        }
        self.help();
    }

    /// Writes what to do, if the error states it.
    fn help(&self) {
        match self {
            Failure::Model(
                ModelError::Input { help: Some(help), .. }
                | ModelError::Plan { help, .. }
                | ModelError::Session { help, .. },
            ) => tell(Kind::Help, help),
            Failure::Identify(IdentifyError::Implausible { .. }) => {
                tell(
                    Kind::Help,
                    "`--allow-implausible` accepts it: for a machine that really is that far from its drawing",
                );
            }
            Failure::Model(ModelError::FileAccess { help, .. }) => tell(
                Kind::Help,
                &format!("{help} (`--data DIR` names the data folder, `--allow-outside` allows files outside)"),
            ),
            Failure::Model(ModelError::Foreign { help, .. }) => tell(
                Kind::Help,
                &format!(
                    "{help} (`--column OWN=THEIRS` says what a column holds and its unit, `--kind` names the instrument)"
                ),
            ),
            _ => {}
        }
    }
}
