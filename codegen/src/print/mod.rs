//! Printers, one file per language.
//!
//! A new language is one file. A [`dialect::Dialect`] defines names, numbers, products and functions; the file defines the text around
//! the expressions.

mod article;
mod c;
mod code;
pub mod dialect;
mod exact;
mod latex;
mod matlab;
mod notes;
mod python;
mod rust;
mod text;
mod touch;
mod typst;

pub(crate) use article::terms_of;

use abbe_model::effect::{Effect, Shape};

use crate::equation::{Equation, Kind, Order};
use crate::error::CodegenError;

/// A language in which equations are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Language {
    /// Plain text, UTF-8.
    Text,
    /// LaTeX with `amsmath`.
    Latex,
    /// Typst.
    Typst,
    /// Rust without dependencies.
    Rust,
    /// C99.
    C,
    /// Python with NumPy.
    Python,
    /// MATLAB or Octave.
    Matlab,
}

impl Language {
    /// All languages.
    pub const ALL: [Language; 7] = [
        Language::Text,
        Language::Latex,
        Language::Typst,
        Language::Rust,
        Language::C,
        Language::Python,
        Language::Matlab,
    ];

    /// The identifier of the language.
    pub fn word(self) -> &'static str {
        match self {
            Language::Text => "text",
            Language::Latex => "latex",
            Language::Typst => "typst",
            Language::Rust => "rust",
            Language::C => "c",
            Language::Python => "python",
            Language::Matlab => "matlab",
        }
    }

    /// The language with this identifier.
    pub fn of_word(word: &str) -> Option<Language> {
        Language::ALL.into_iter().find(|language| language.word() == word)
    }
}

impl Equation {
    /// Prints the equation in a language.
    ///
    /// # Errors
    /// If the requested form cannot be written in that language.
    pub fn print(&self, language: Language) -> Result<String, CodegenError> {
        let for_readers = matches!(language, Language::Text | Language::Latex | Language::Typst);
        let curve = |effect: &&Effect| matches!(effect.shape, Shape::Curve { .. });
        if let (true, Some(effect)) = (for_readers, self.options.effects.iter().find(curve)) {
            return Err(CodegenError::CurveForReaders { effect: effect.id() });
        }
        if for_readers && self.options.gradient {
            match (self.kind, self.options.order) {
                (Kind::Length, Order::Exact) | (_, Order::First) => {}
                (Kind::Length, Order::Bilinear) => {
                    return Err(CodegenError::GradientForReaders {
                        what: "a bilinear form",
                    });
                }
                (Kind::Distance, _) => {
                    return Err(CodegenError::GradientForReaders {
                        what: "a probed distance",
                    });
                }
                (Kind::Coordinates, _) => {
                    return Err(CodegenError::GradientForReaders {
                        what: "three coordinates",
                    });
                }
                (Kind::Volumetric, _) => {
                    return Err(CodegenError::GradientForReaders {
                        what: "the error vector",
                    });
                }
            }
        }
        Ok(match language {
            Language::Text => text::print(self),
            Language::Latex => latex::print(self),
            Language::Typst => typst::print(self),
            Language::Rust => rust::print(self),
            Language::C => c::print(self),
            Language::Python => python::print(self),
            Language::Matlab => matlab::print(self),
        })
    }
}
