//! Errors of the library as JSON texts: message, what to do, file, line, column.

use abbe::apply::ApplyError;
use abbe::codegen::CodegenError;
use abbe::files::store::Store;
use abbe::identify::IdentifyError;
use abbe::model::ModelError;
use abbe::model::error::Location;
use abbe::model::words::shortened;
use abbe::plan::PlanError;
use serde::Serialize;
use wasm_bindgen::JsValue;

/// Why a call failed.
#[derive(Debug)]
pub struct Failed(Box<Fault>);

/// What the page shows.
#[derive(Debug, Default, Serialize)]
struct Fault {
    message: String,
    help: Option<String>,
    file: Option<String>,
    /// From 1.
    line: Option<usize>,
    /// From 1, in characters.
    column: Option<usize>,
    #[serde(skip)]
    location: Option<Location>,
}

impl Failed {
    /// The same with the column in the text of the file.
    pub fn within(mut self, store: &Store) -> Failed {
        if let Some(location) = &self.0.location {
            self.0.column = store.read(&location.file).ok().and_then(|contents| location.column(&contents));
        }
        self
    }
}

impl From<String> for Failed {
    fn from(message: String) -> Failed {
        Failed(Box::new(Fault { message: shortened(&message).into_owned(), ..Fault::default() }))
    }
}

impl From<ModelError> for Failed {
    fn from(error: ModelError) -> Failed {
        let location = error.location().cloned();
        Failed(Box::new(Fault {
            // The message without the place, which the page shows beside it.
            message: match &error {
                ModelError::Input { message, .. }
                | ModelError::FileAccess { message, .. }
                | ModelError::Foreign { message, .. } => shortened(message).into_owned(),
                other => other.to_string(),
            },
            help: error.help().filter(|help| !help.is_empty()).map(str::to_string),
            file: location.as_ref().map(|location| location.file.display().to_string()),
            line: location.as_ref().map(|location| location.line).filter(|line| *line > 0),
            column: None,
            location,
        }))
    }
}

impl From<IdentifyError> for Failed {
    fn from(error: IdentifyError) -> Failed {
        match error {
            IdentifyError::Model(error) => error.into(),
            other => other.to_string().into(),
        }
    }
}

impl From<PlanError> for Failed {
    fn from(error: PlanError) -> Failed {
        match error {
            PlanError::Identify(error) => error.into(),
            other => other.to_string().into(),
        }
    }
}

impl From<ApplyError> for Failed {
    fn from(error: ApplyError) -> Failed {
        match error {
            ApplyError::Identify(error) => error.into(),
            other => other.to_string().into(),
        }
    }
}

impl From<CodegenError> for Failed {
    fn from(error: CodegenError) -> Failed {
        error.to_string().into()
    }
}

impl From<Failed> for JsValue {
    fn from(failed: Failed) -> JsValue {
        JsValue::from_str(&serde_json::to_string(&failed.0).unwrap_or(failed.0.message))
    }
}
