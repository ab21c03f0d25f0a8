//! Printers: one file for each language.
//!
//! A new language is one file here: a [`dialect::Dialect`] says how names, numbers, products and functions are spelt, and the file
//! lays out what stands around the expressions.

pub mod dialect;
mod text;

use crate::equation::Equation;
use crate::error::CodegenError;

/// A language that equations are printed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Language {
    /// Plain text, UTF-8.
    Text,
}

impl Equation {
    /// The equation in a language.
    ///
    /// # Errors
    /// If the form that was asked for cannot be written in that language.
    pub fn print(&self, language: Language) -> Result<String, CodegenError> {
        match language {
            Language::Text => Ok(text::print(self)),
        }
    }
}
