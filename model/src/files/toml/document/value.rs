//! A value of a TOML file, with its key and location.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{MAX_ITEMS, Source, Table};
use crate::error::ModelError;
use crate::session::limits;
use crate::words;

/// A value with its key.
pub(crate) struct Value<'a> {
    /// The file.
    pub source: &'a Source,
    /// The key it belongs to.
    pub key: String,
    /// Location of the key.
    pub key_span: Range<usize>,
    /// Location of the value.
    pub span: Range<usize>,
    pub(super) value: DeValue<'a>,
}

impl<'a> Value<'a> {
    /// An error at the value.
    pub fn error(&self, message: impl Into<String>, help: Option<String>) -> ModelError {
        self.source.error(self.span.clone(), message, help)
    }

    /// An error about the file that the value names.
    pub fn file_error(&self, message: String, help: &str) -> ModelError {
        ModelError::FileAccess { location: self.source.location(self.span.clone()), message, help: help.to_string() }
    }

    /// An error with the found value and the expected one.
    pub fn unexpected(&self, expected: &str) -> ModelError {
        let found = match &self.value {
            DeValue::String(text) => format!("the text \"{text}\""),
            DeValue::Integer(_) | DeValue::Float(_) => "a number".to_string(),
            DeValue::Boolean(truth) => truth.to_string(),
            DeValue::Datetime(_) => "a date".to_string(),
            DeValue::Array(items) => format!("a list of {}", items.len()),
            DeValue::Table(_) => "a table".to_string(),
        };
        self.error(format!("`{}` is {found}; {expected} is expected", self.key), None)
    }

    /// The value as a text.
    pub fn text(&self) -> Result<String, ModelError> {
        match &self.value {
            DeValue::String(text) => match text.chars().find(|c| c.is_control() && *c != '\t') {
                None => Ok(text.to_string()),
                Some(control) => Err(self.error(
                    format!("`{}` contains the control character U+{:04X}", self.key, control as u32),
                    Some("remove it".into()),
                )),
            },
            _ => Err(self.unexpected("a text in quotes")),
        }
    }

    /// The text, if the value is one.
    pub fn as_text(&self) -> Option<&str> {
        self.value.as_str()
    }

    /// The value as a text of any type: a note may be a number or a date.
    pub fn note(&self) -> Result<String, ModelError> {
        match &self.value {
            DeValue::Integer(number) => Ok(number.as_str().to_string()),
            DeValue::Float(number) => Ok(number.as_str().to_string()),
            DeValue::Boolean(truth) => Ok(truth.to_string()),
            DeValue::Datetime(date) => Ok(date.to_string()),
            DeValue::String(text) => match text.chars().find(|c| c.is_control() && !matches!(c, '\t' | '\n')) {
                // A comment may have several lines.
                None => Ok(text.trim().to_string()),
                Some(_) => self.text(),
            },
            DeValue::Array(_) | DeValue::Table(_) => Err(self.unexpected("a text in quotes, a number or a date")),
        }
    }

    /// Whether it is a list.
    pub fn is_list(&self) -> bool {
        self.value.is_array()
    }

    /// Whether it is a table.
    pub fn is_table(&self) -> bool {
        self.value.is_table()
    }

    /// true or false.
    pub fn boolean(&self) -> Result<bool, ModelError> {
        self.value.as_bool().ok_or_else(|| self.unexpected("true or false"))
    }

    /// A number within the limits of its key ([`limits::too_large_for`]), possibly infinite, never NaN.
    pub fn number_or_inf(&self, expected: &str) -> Result<f64, ModelError> {
        let number = match &self.value {
            DeValue::Integer(integer) => {
                i64::from_str_radix(&integer.as_str().replace('_', ""), integer.radix())
                    .map(|integer| integer as f64)
                    // A value that is too large for an integer is still a number.
                    .or_else(|_| integer.as_str().replace('_', "").parse())
                    .ok()
            }
            DeValue::Float(float) => float.as_str().replace('_', "").parse().ok(),
            _ => None,
        };
        match number {
            Some(number) if f64::is_nan(number) => {
                Err(self.error(format!("`{}` is NaN; {expected} is expected", self.key), None))
            }
            Some(number) => match limits::too_large_for(&self.key, number) {
                Some(fault) => Err(self.error(format!("`{}` is {fault}", self.key), None)),
                None => Ok(number),
            },
            None => Err(self.unexpected(expected)),
        }
    }

    /// A finite number.
    pub fn number(&self) -> Result<f64, ModelError> {
        let number = self.number_or_inf("a number")?;
        if number.is_finite() {
            Ok(number)
        } else {
            Err(self.error(format!("`{}` is infinite; a number is expected", self.key), None))
        }
    }

    /// A finite number above zero.
    pub fn positive(&self) -> Result<f64, ModelError> {
        let number = self.number()?;
        if number > 0.0 {
            Ok(number)
        } else {
            Err(self.error(format!("`{}` is {}; it must be greater than 0", self.key, words::number(number)), None))
        }
    }

    /// An integer of at least `least` and at most `most`.
    pub fn count(&self, least: usize, most: usize) -> Result<usize, ModelError> {
        let number = self.number()?;
        if number.fract() == 0.0 && number >= least as f64 && number <= most as f64 {
            Ok(number as usize)
        } else {
            let found = words::number(number);
            Err(self
                .error(format!("`{}` is {found}; a whole number from {least} to {most} is expected", self.key), None))
        }
    }

    /// The items of a list, each with the key of the list.
    pub fn list(self, expected: &str) -> Result<Vec<Value<'a>>, ModelError> {
        if !self.value.is_array() {
            return Err(self.unexpected(expected));
        }
        let (source, key, span) = (self.source, self.key, self.span);
        let DeValue::Array(items) = self.value else {
            return Ok(Vec::new());
        };
        if items.len() > MAX_ITEMS {
            let message = format!("`{key}` is a list of {}; the limit is {MAX_ITEMS}", items.len());
            return Err(source.error(span, message, None));
        }
        Ok(items
            .into_iter()
            .map(|item: Spanned<DeValue<'a>>| Value {
                source,
                key: key.clone(),
                key_span: item.span(),
                span: item.span(),
                value: item.into_inner(),
            })
            .collect())
    }

    /// Exactly three items of a list.
    pub fn three(self, expected: &str) -> Result<[Value<'a>; 3], ModelError> {
        let (source, key, span) = (self.source, self.key.clone(), self.span.clone());
        let items = self.list(expected)?;
        let count = items.len();
        items.try_into().map_err(|_| {
            let message = format!("`{key}` is a list of {count}; {expected} is expected");
            source.error(span, message, None)
        })
    }

    /// Three finite numbers.
    pub fn vector(self) -> Result<[f64; 3], ModelError> {
        let items = self.three("a list of three numbers")?;
        let mut vector = [0.0; 3];
        for (component, item) in vector.iter_mut().zip(&items) {
            *component = item.number()?;
        }
        Ok(vector)
    }

    /// A table with `name` as its name in messages.
    pub fn table(self, name: String) -> Result<Table<'a>, ModelError> {
        if !self.value.is_table() {
            return Err(self.unexpected("a table"));
        }
        // Messages about the table point at its header `[name]`.
        let span = if self.key_span.start < self.span.start { self.key_span.clone() } else { self.span.clone() };
        match self.value {
            DeValue::Table(table) => Ok(Table::new(self.source, name, span, table)),
            _ => Ok(Table::new(self.source, name, span, DeTable::new())),
        }
    }
}
