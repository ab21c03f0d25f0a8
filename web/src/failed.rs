//! Errors of the library as JSON texts: message, what to do, file, line, column.

use abbe::files::store::Store;
use abbe::model::Diagnostic;
use abbe::model::words::shortened;
use serde_json::json;
use wasm_bindgen::JsValue;

/// Why a call failed.
#[derive(Debug)]
pub struct Failed {
    error: Diagnostic,
    /// The column of the place, from 1, in characters.
    column: Option<usize>,
}

impl Failed {
    /// The same with the column in the text of the file.
    pub fn within(mut self, store: &Store) -> Failed {
        if let Some(place) = self.error.location() {
            self.column = store.read(&place.file).ok().and_then(|contents| place.column(&contents));
        }
        self
    }
}

impl From<Diagnostic> for Failed {
    fn from(error: Diagnostic) -> Failed {
        Failed { error, column: None }
    }
}

impl From<String> for Failed {
    fn from(message: String) -> Failed {
        Diagnostic::other(message).into()
    }
}

impl From<Failed> for JsValue {
    fn from(Failed { error, column }: Failed) -> JsValue {
        // The message is without the place, which the page shows beside it.
        let shown = json!({
            "message": shortened(&error.message),
            "help": error.help(),
            "file": error.location().map(|place| place.file.display().to_string()),
            "line": error.location().map(|place| place.line).filter(|line| *line > 0),
            "column": column,
        });
        JsValue::from_str(&shown.to_string())
    }
}
