//! Errors of the library as exceptions of `abbe`, with the same text.

use abbe::apply::ApplyError;
use abbe::codegen::CodegenError;
use abbe::identify::IdentifyError;
use abbe::model::ModelError;
use abbe::model::error::Location;
use abbe::model::words::shortened;
use abbe::plan::PlanError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Why a call failed, without a Python object in it: it may come from any thread.
#[derive(Debug)]
pub struct Failed {
    /// The class of the exception in `abbe`.
    class: &'static str,
    message: String,
    help: Option<String>,
    location: Option<Location>,
}

impl Failed {
    /// A failure that is no error of the session.
    pub fn new(message: impl Into<String>) -> Failed {
        Failed { class: "Error", message: shortened(&message.into()).into_owned(), help: None, location: None }
    }

    /// An argument that cannot be used.
    pub fn argument(message: impl Into<String>, help: impl Into<String>) -> Failed {
        Failed { class: "SessionError", help: Some(help.into()), ..Failed::new(message) }
    }
}

impl From<ModelError> for Failed {
    fn from(error: ModelError) -> Failed {
        Failed {
            class: "SessionError",
            message: error.to_string(),
            help: error.help().filter(|help| !help.is_empty()).map(|help| shortened(help).into_owned()),
            location: error.location().cloned(),
        }
    }
}

impl From<IdentifyError> for Failed {
    fn from(error: IdentifyError) -> Failed {
        match error {
            IdentifyError::Model(error) => error.into(),
            other => Failed { class: "IdentificationError", ..Failed::new(other.to_string()) },
        }
    }
}

impl From<PlanError> for Failed {
    fn from(error: PlanError) -> Failed {
        match error {
            PlanError::Identify(error) => error.into(),
            other => Failed { class: "IdentificationError", ..Failed::new(other.to_string()) },
        }
    }
}

impl From<ApplyError> for Failed {
    fn from(error: ApplyError) -> Failed {
        match error {
            ApplyError::Identify(error) => error.into(),
            other => Failed { class: "IdentificationError", ..Failed::new(other.to_string()) },
        }
    }
}

impl From<CodegenError> for Failed {
    fn from(error: CodegenError) -> Failed {
        Failed { class: "EquationError", ..Failed::new(error.to_string()) }
    }
}

impl From<String> for Failed {
    fn from(message: String) -> Failed {
        Failed::new(message)
    }
}

impl From<Failed> for PyErr {
    fn from(failed: Failed) -> PyErr {
        Python::attach(|py| exception(py, &failed).unwrap_or_else(|fault| fault))
    }
}

fn exception(py: Python<'_>, failed: &Failed) -> PyResult<PyErr> {
    let class = py.import("abbe._errors")?.getattr(failed.class)?;
    let keywords = PyDict::new(py);
    keywords.set_item("help", failed.help.as_deref())?;
    if let Some(location) = &failed.location {
        keywords.set_item("file", location.file.display().to_string())?;
        keywords.set_item("line", Some(location.line).filter(|line| *line > 0))?;
        keywords.set_item("column", column(location))?;
    }
    Ok(PyErr::from_value(class.call((&failed.message,), Some(&keywords))?))
}

/// The column of a location, from 1, if its file still has such a line.
fn column(location: &Location) -> Option<usize> {
    location.column(&std::fs::read(&location.file).ok()?)
}
