//! TOML files with source locations: every key and value has its location, a table reports unknown keys, and a wrong
//! value is reported with the expected type.

mod value;

use std::borrow::Cow;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::DeTable;

use crate::error::{Location, ModelError};
use crate::files::spelling::known_names;
use crate::files::stamp::FileStamp;
use crate::files::store::Store;
pub(crate) use value::Value;

/// Largest size of a machine or session file, bytes.
const MAX_BYTES: u64 = 8 << 20;
/// Largest nesting depth that the TOML parser accepts.
const MAX_DEPTH: usize = 80;
/// Largest number of items in a list or a table of names. It exceeds every practical measurement and allows pairwise
/// comparison.
const MAX_ITEMS: usize = 1000;

/// The text of a file, read once: a session, a machine, a model, a study, a file of values.
#[derive(Clone, Debug)]
pub struct Source {
    /// As the user named it.
    pub file: PathBuf,
    /// The text, without a byte order mark.
    pub text: String,
    /// Length of the byte order mark before the text, bytes.
    pub skipped: usize,
    /// The state of the file when it was read; `None` for a text from no file.
    pub stamp: Option<FileStamp>,
}

impl Source {
    /// Reads a text file of UTF-8 with or without byte order mark, within the limit of its size; `what` names its content
    /// in messages.
    ///
    /// # Errors
    /// If the file cannot be read or is not such a text, with its name and what to do.
    pub fn read(store: &Store, file: &Path, what: &str) -> Result<Source, ModelError> {
        let fault = |message: String, help: &str| ModelError::Input {
            location: Location::file(file),
            message,
            help: Some(help.to_string()),
        };
        if store.state(file).is_ok_and(|found| found.folder) {
            return Err(fault(format!("this is a folder; {what} must be a file"), "name the .toml file in it"));
        }
        let unreadable = |cause: std::io::Error| {
            let help =
                "check the name; a relative name starts from the file that contains it, or from the working directory";
            fault(format!("{what} cannot be read: {cause}"), help)
        };
        let mut opened = store.open(file).map_err(unreadable)?;
        let stamp = FileStamp::of(file, opened.state().map_err(unreadable)?);
        let mut bytes = Vec::new();
        // The length of a pipe is unknown in advance.
        opened.by_ref().take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(fault(
                format!("{what} has more than {MAX_BYTES} bytes, which is the limit"),
                "readings belong in CSV files named by `data`",
            ));
        }
        stamp.finish(&opened)?;
        let text = String::from_utf8(bytes).map_err(|cause| {
            fault(
                format!("byte {} is not UTF-8, the encoding of TOML", cause.utf8_error().valid_up_to() + 1),
                "save the file as UTF-8",
            )
        })?;
        Ok(Source { stamp: Some(stamp), ..Source::new(file, &text) })
    }

    /// A given text of a file.
    pub fn new(file: &Path, text: &str) -> Source {
        let content = text.strip_prefix('\u{feff}').unwrap_or(text);
        Source { file: file.to_path_buf(), text: content.to_string(), skipped: text.len() - content.len(), stamp: None }
    }

    /// The whole file as a table.
    pub(crate) fn parse(&self) -> Result<Table<'_>, ModelError> {
        let root = DeTable::parse(&self.text).map_err(|fault| {
            self.error(
                fault.span().unwrap_or(0..0),
                format!("not valid TOML: {}", fault.message()),
                fault
                    .message()
                    .contains("recursion")
                    .then(|| format!("tables, lists and the parts of a key may be nested {MAX_DEPTH} levels deep")),
            )
        })?;
        Ok(Table::new(self, String::new(), 0..0, root.into_inner()))
    }

    /// The location of some bytes of the text.
    pub(crate) fn location(&self, span: Range<usize>) -> Location {
        let until = span.start.min(self.text.len());
        Location {
            file: self.file.clone(),
            line: 1 + self.text.as_bytes()[..until].iter().filter(|byte| **byte == b'\n').count(),
            span: Some(span.start + self.skipped..span.end + self.skipped),
        }
    }

    /// An error at a location of this file.
    pub(crate) fn error(&self, span: Range<usize>, message: impl Into<String>, help: Option<String>) -> ModelError {
        ModelError::Input { location: self.location(span), message: message.into(), help }
    }
}

/// A table during reading: known keys are removed one by one, and the remaining keys are unknown.
pub(crate) struct Table<'a> {
    /// The file.
    pub source: &'a Source,
    /// The name of the table in messages: `[instrument]`, `test "A100"`; empty for the file itself.
    pub name: String,
    /// Its location.
    pub span: Range<usize>,
    entries: Vec<Value<'a>>,
    known_keys: Vec<Cow<'static, str>>,
}

impl<'a> Table<'a> {
    fn new(source: &'a Source, name: String, span: Range<usize>, table: DeTable<'a>) -> Self {
        let mut entries: Vec<Value<'a>> = table
            .into_iter()
            .map(|(key, value)| Value {
                source,
                key_span: key.span(),
                key: key.into_inner().into_owned(),
                span: value.span(),
                value: value.into_inner(),
            })
            .collect();
        entries.sort_by_key(|entry| entry.key_span.start);
        Table { source, name, span, entries, known_keys: Vec::new() }
    }

    /// The value of a key, if present.
    pub fn take(&mut self, key: impl Into<Cow<'static, str>>) -> Option<Value<'a>> {
        let key = key.into();
        let index = self.entries.iter().position(|entry| entry.key == key);
        self.known_keys.push(key);
        Some(self.entries.remove(index?))
    }

    /// The location of a key that has not been taken, if present.
    pub fn key_span(&self, key: &str) -> Option<Range<usize>> {
        self.entries.iter().find(|entry| entry.key == key).map(|entry| entry.key_span.clone())
    }

    /// The value of a required key; `expected` names the expected value.
    pub fn require(&mut self, key: &'static str, expected: &str) -> Result<Value<'a>, ModelError> {
        match self.take(key) {
            Some(value) => Ok(value),
            None => {
                Err(self
                    .error(format!("{} has no `{key}`", self.display_name()), Some(format!("add `{key}`: {expected}"))))
            }
        }
    }

    /// Every remaining value, in the order of the file: for tables whose keys are names.
    pub fn remaining_values(&mut self) -> Result<Vec<Value<'a>>, ModelError> {
        if self.entries.len() > MAX_ITEMS {
            let message =
                format!("{} has {} entries; the limit is {MAX_ITEMS}", self.display_name(), self.entries.len());
            return Err(self.error(message, None));
        }
        Ok(std::mem::take(&mut self.entries))
    }

    /// Returns an error if a key remains.
    pub fn finish(self) -> Result<(), ModelError> {
        match self.entries.first() {
            None => Ok(()),
            Some(entry) => {
                let mut known: Vec<&str> = self.known_keys.iter().map(AsRef::as_ref).collect();
                known.sort_unstable();
                known.dedup();
                let message = format!("{} has the unknown key `{}`", self.display_name(), entry.key);
                Err(self.source.error(entry.key_span.clone(), message, Some(known_names(&entry.key, &known))))
            }
        }
    }

    /// The name of the table in messages.
    pub fn display_name(&self) -> &str {
        if self.name.is_empty() { "the file" } else { &self.name }
    }

    /// An error about the table as a whole.
    pub fn error(&self, message: impl Into<String>, help: Option<String>) -> ModelError {
        self.source.error(self.span.clone(), message, help)
    }
}
