//! A fault of a document before its place in a file is known: what is wrong, and the path of keys that leads there.

use std::fmt;

use serde::de;

use crate::Diagnostic;
use crate::diagnostic::Help;

/// A step from a table or a list to what it contains.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// The value of a key.
    Key(String),
    /// An item of a list, from 0.
    Item(usize),
}

/// What is wrong with a document.
#[derive(Debug)]
pub enum Finding {
    /// A message.
    Said {
        /// The message.
        message: String,
        /// What to do.
        help: Option<String>,
    },
    /// What is said of the value: the message starts with its key.
    OfKey {
        /// The message after the key.
        what: String,
        /// What to do.
        help: Option<String>,
    },
    /// What is said of a table: the message starts with its name.
    OfTable {
        /// The message after the name.
        what: String,
        /// What to do.
        help: Option<String>,
    },
    /// A value of another type or word than this one.
    Unexpected(String),
    /// A key that the table does not have.
    UnknownKey {
        /// The key.
        key: String,
        /// The keys that the table may have.
        known: Vec<String>,
    },
    /// A required key that is absent.
    MissingKey {
        /// The key.
        key: String,
        /// What to add, if its schema does not say it.
        what: Option<String>,
    },
    /// A file that is named and does not exist, or must not be read.
    File {
        /// The message.
        message: String,
        /// What to do.
        help: String,
    },
    /// An error that has its place already.
    Other(Box<Diagnostic>),
}

/// A fault of a document. The reader of its file finds its place there.
#[derive(Debug)]
pub struct Fault {
    /// What is wrong.
    pub finding: Finding,
    /// The path of keys from the value outwards.
    pub path: Vec<Step>,
    /// Whether it points at the key rather than at the value.
    pub on_key: bool,
}

impl Fault {
    fn of(finding: Finding) -> Fault {
        Fault { finding, path: Vec::new(), on_key: false }
    }

    /// A fault in words, with what to do.
    pub fn new(message: impl Into<String>, help: impl Into<Help>) -> Fault {
        Fault::of(Finding::Said { message: message.into(), help: help.into().0 })
    }

    /// The value is this, and must be something else: the message starts with its key.
    pub fn is(what: impl Into<String>) -> Fault {
        Fault::of_key(format!("is {}", what.into()), None)
    }

    /// What is wrong with the value, said of its key.
    pub fn of_key(what: impl Into<String>, help: impl Into<Help>) -> Fault {
        Fault::of(Finding::OfKey { what: what.into(), help: help.into().0 })
    }

    /// What is wrong with the table, said of its name.
    pub fn of_table(what: impl Into<String>, help: impl Into<Help>) -> Fault {
        Fault::of(Finding::OfTable { what: what.into(), help: help.into().0 })
    }

    /// Something else is expected.
    pub fn unexpected(expected: impl Into<String>) -> Fault {
        Fault::of(Finding::Unexpected(expected.into()))
    }

    /// A required key is absent; `what` says what to add.
    pub fn missing(key: &str, what: &str) -> Fault {
        Fault::of(Finding::MissingKey { key: key.to_string(), what: Some(what.to_string()) })
    }

    /// A key that is not among the known ones.
    pub fn unknown_key(key: &str, known: Vec<String>) -> Fault {
        Fault::of(Finding::UnknownKey { key: key.to_string(), known })
    }

    /// A file that is named and does not exist, or must not be read.
    pub fn file(message: String, help: &str) -> Fault {
        Fault::of(Finding::File { message, help: help.to_string() })
    }

    /// The same, about the key rather than its value.
    pub fn on_key(self) -> Fault {
        Fault { on_key: true, ..self }
    }

    /// The same, in the value of a key.
    pub fn at(mut self, key: &str) -> Fault {
        self.path.push(Step::Key(key.to_string()));
        self
    }

    /// The same, in an item of a list.
    pub fn at_item(mut self, item: usize) -> Fault {
        self.path.push(Step::Item(item));
        self
    }

    /// The key that is unknown, if that is the fault.
    pub fn unknown(&self) -> Option<&str> {
        match &self.finding {
            Finding::UnknownKey { key, .. } => Some(key),
            _ => None,
        }
    }

    /// The same, if a key is unknown, with more that are known.
    pub fn also_known(mut self, keys: impl IntoIterator<Item = String>) -> Fault {
        if let Finding::UnknownKey { known, .. } = &mut self.finding {
            known.extend(keys);
        }
        self
    }

    /// The same, if a key is absent, with what it is.
    pub fn explained(mut self, meaning: impl Fn(&str) -> Option<String>) -> Fault {
        if let Finding::MissingKey { key, what } = &mut self.finding {
            *what = what.take().or_else(|| meaning(key));
        }
        self
    }
}

impl From<Diagnostic> for Fault {
    fn from(error: Diagnostic) -> Fault {
        Fault::of(Finding::Other(Box::new(error)))
    }
}

/// What a value is, and must not be: the faults of [`limits`](crate::session::limits).
impl From<String> for Fault {
    fn from(what: String) -> Fault {
        Fault::is(what)
    }
}

impl From<(String, String)> for Fault {
    fn from((message, help): (String, String)) -> Fault {
        Fault::new(message, help)
    }
}

/// Where a result belongs in a document.
pub trait Within<T> {
    /// In the value of a key.
    ///
    /// # Errors
    /// As the result.
    fn within(self, key: &str) -> Result<T, Fault>;
    /// In an item of a list.
    ///
    /// # Errors
    /// As the result.
    fn within_item(self, item: usize) -> Result<T, Fault>;
}

impl<T, E: Into<Fault>> Within<T> for Result<T, E> {
    fn within(self, key: &str) -> Result<T, Fault> {
        self.map_err(|fault| fault.into().at(key))
    }

    fn within_item(self, item: usize) -> Result<T, Fault> {
        self.map_err(|fault| fault.into().at_item(item))
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:?}", self.finding)
    }
}

impl std::error::Error for Fault {}

impl de::Error for Fault {
    fn custom<T: fmt::Display>(what: T) -> Fault {
        Fault::is(what.to_string())
    }

    fn invalid_type(_: de::Unexpected<'_>, expected: &dyn de::Expected) -> Fault {
        Fault::unexpected(expected.to_string())
    }

    fn invalid_value(_: de::Unexpected<'_>, expected: &dyn de::Expected) -> Fault {
        Fault::unexpected(expected.to_string())
    }

    fn invalid_length(_: usize, expected: &dyn de::Expected) -> Fault {
        Fault::unexpected(expected.to_string())
    }

    fn unknown_field(field: &str, known: &'static [&'static str]) -> Fault {
        Fault::unknown_key(field, known.iter().map(|name| (*name).to_string()).collect())
    }

    fn missing_field(field: &'static str) -> Fault {
        Fault::of(Finding::MissingKey { key: field.to_string(), what: None })
    }
}
