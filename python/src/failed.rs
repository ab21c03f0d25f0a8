//! Errors of the library as exceptions of `abbe`, with the same text.

use abbe::model::Diagnostic;
use abbe::model::diagnostic::{Area, Help};
use abbe::model::words::shortened;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Why a call failed, without a Python object in it: it may come from any thread.
#[derive(Debug)]
pub struct Failed(Diagnostic);

impl Failed {
    /// A failure that is no error of the session.
    pub fn new(message: impl Into<String>) -> Failed {
        Failed(Diagnostic::other(message))
    }

    /// An argument that cannot be used.
    pub fn argument(message: impl Into<String>, help: impl Into<Help>) -> Failed {
        Failed(Diagnostic::session(message, help))
    }
}

impl From<Diagnostic> for Failed {
    fn from(error: Diagnostic) -> Failed {
        Failed(error)
    }
}

impl From<String> for Failed {
    fn from(message: String) -> Failed {
        Failed::new(message)
    }
}

impl From<Failed> for PyErr {
    fn from(Failed(error): Failed) -> PyErr {
        Python::attach(|py| exception(py, &error).unwrap_or_else(|fault| fault))
    }
}

fn exception(py: Python<'_>, error: &Diagnostic) -> PyResult<PyErr> {
    let class = match error.code.area {
        Area::Session => "SessionError",
        Area::Identification => "IdentificationError",
        Area::Equation => "EquationError",
        Area::Other => "Error",
    };
    let keywords = PyDict::new(py);
    keywords.set_item("help", error.help().map(shortened))?;
    if let Some(location) = error.location().filter(|_| error.code.area == Area::Session) {
        let contents = std::fs::read(&location.file).ok();
        keywords.set_item("file", location.file.display().to_string())?;
        keywords.set_item("line", Some(location.line).filter(|line| *line > 0))?;
        keywords.set_item("column", contents.and_then(|contents| location.column(&contents)))?;
    }
    let class = py.import("abbe._errors")?.getattr(class)?;
    Ok(PyErr::from_value(class.call((error.to_string(),), Some(&keywords))?))
}
