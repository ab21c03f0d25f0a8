//! Output languages: the registry, and one file per language.
//!
//! A new language is a file that implements [`Language`] and a line in [`LANGUAGES`].

mod arguments;
mod article;
mod c;
mod code;
mod dialect;
mod julia;
mod language;
mod latex;
mod matlab;
mod notation;
mod notes;
mod python;
mod rust;
mod symbolic;
mod system;
mod tex_width;
mod text;
mod typeset;
mod typst;

use Audience::{Algebra, Authors, Compilers, Readers};
use abbe_model::Diagnostic;
use abbe_model::effect::{Effect, Shape};
pub use language::Language;
pub use system::TestEquations;

use crate::check::Checked;
use crate::equation::Equation;
use crate::error;
use crate::form::{Kind, Order};

/// Whom a language addresses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Audience {
    /// Readers of plain text, with a table of symbols.
    Readers,
    /// Authors: typesetting languages.
    Authors,
    /// Compilers and interpreters: code with value and derivatives.
    Compilers,
    /// Computer algebra: functions of named symbols.
    Algebra,
}

/// One line of the registry.
pub struct OutputLanguage {
    /// The word by which it is requested.
    pub word: &'static str,
    /// The extension of its files.
    pub extension: &'static str,
    /// Whom it addresses.
    pub audience: Audience,
    language: &'static dyn Language,
}

/// LaTeX. A program that names it in place of [`language`] does not hold the printers of the others.
pub const LATEX: OutputLanguage = entry("latex", "tex", Authors, &latex::Latex);

/// All languages, in the order in which they are listed.
pub const LANGUAGES: &[OutputLanguage] = &[
    entry("text", "txt", Readers, &text::Text),
    LATEX,
    entry("typst", "typ", Authors, &typst::Typst),
    entry("rust", "rs", Compilers, &rust::Rust),
    entry("c", "c", Compilers, &c::C),
    entry("python", "py", Compilers, &python::Python),
    entry("matlab", "m", Compilers, &matlab::Matlab),
    entry("julia", "jl", Compilers, &julia::Julia),
    entry("sympy", "py", Algebra, &symbolic::SymPy),
    entry("casadi", "py", Algebra, &symbolic::CasAdi),
];

const fn entry(
    word: &'static str,
    extension: &'static str,
    audience: Audience,
    language: &'static dyn Language,
) -> OutputLanguage {
    OutputLanguage { word, extension, audience, language }
}

/// The language with this word.
///
/// # Errors
/// If there is none.
pub fn language(word: &str) -> Result<&'static OutputLanguage, Diagnostic> {
    let found = LANGUAGES.iter().find(|language| language.word == word);
    found.ok_or_else(|| {
        let known = words(|_| true, "and");
        Diagnostic::equation(format!("no output language is called `{word}`; the languages are {known}"))
    })
}

impl OutputLanguage {
    /// Whether its readers expect an angle at which a test holds an axis as a symbol, and not as numbers.
    pub fn keeps_symbols(&self) -> bool {
        self.audience != Compilers
    }

    /// The name of a file for the code of one test among several: that of its function ([`Style::name_of_test`]).
    pub fn file_name(&self, equation: &Equation) -> String {
        format!("{}.{}", code::function_name(equation, true), self.extension)
    }

    /// Prints a checked equation.
    ///
    /// # Errors
    /// If the language is for readers and the form is readable only as code: a curve, or derivatives of most forms.
    pub fn print(&self, checked: &Checked<'_>, style: &Style) -> Result<String, Diagnostic> {
        if matches!(self.audience, Readers | Authors) {
            refuse_unreadable(checked.equation)?;
        }
        let named = Style { layout: Layout::Named, ..*style };
        Ok(self.language.print(checked, if self.audience == Algebra { &named } else { style }))
    }
}

impl OutputLanguage {
    /// Prints the equations of all tests of a session, and their sensitivities as a matrix.
    ///
    /// # Errors
    /// As [`OutputLanguage::print`]; also if the language is for compilers.
    pub fn print_system(&self, tests: &[TestEquations<'_>], style: &Style) -> Result<String, Diagnostic> {
        for test in tests {
            if matches!(self.audience, Readers | Authors) {
                refuse_unreadable(test.equation.equation)?;
            }
        }
        self.language.system(tests, style).ok_or_else(|| {
            error::no_form(
                "all",
                format!("is written as {} only", words(|entry| matches!(entry.audience, Readers | Authors), "or")),
            )
        })
    }
}

impl std::fmt::Debug for OutputLanguage {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.word)
    }
}

/// The words of some languages: `rust, c, python or matlab`.
fn words(some: impl Fn(&OutputLanguage) -> bool, last: &str) -> String {
    let words: Vec<&str> = LANGUAGES.iter().filter(|entry| some(entry)).map(|entry| entry.word).collect();
    match words.split_last() {
        Some((end, rest)) if !rest.is_empty() => format!("{} {last} {end}", rest.join(", ")),
        _ => words.concat(),
    }
}

/// Refuses curves, which have hundreds of terms, and derivatives that have no short form.
fn refuse_unreadable(equation: &Equation) -> Result<(), Diagnostic> {
    let languages = words(|entry| entry.audience == Compilers, "or");
    let curve = |effect: &&Effect| matches!(effect.shape, Shape::Curve { .. });
    if let Some(effect) = equation.options.effects.iter().find(curve) {
        return Err(Diagnostic::equation(format!(
            "the curve `{}` is written as code only: as {languages}; to omit it, name the errors to keep",
            effect.id()
        )));
    }
    let what = match (equation.kind, equation.options.order) {
        _ if !equation.options.gradient => return Ok(()),
        (Kind::Length, Order::Exact) | (_, Order::First) => return Ok(()),
        (Kind::Length, Order::Bilinear) => "a bilinear form",
        (Kind::Distance, _) => "a probed distance",
        (Kind::Coordinates, _) => "several coordinates",
        (Kind::Volumetric, _) => "the error vector",
    };
    Err(Diagnostic::equation(format!(
        "the derivatives of {what} are written as code only: as {languages}; at zero errors they equal the first-order \
         coefficients"
    )))
}

/// Which equations have a number and a label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Numbering {
    /// None.
    #[default]
    None,
    /// That of the reading.
    Last,
    /// Every one.
    All,
}

/// The arguments of printed code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// Named arguments: lengths, axis positions, and errors with the default 0.
    #[default]
    Named,
    /// Three arrays: lengths, sines and cosines, errors. For kernels over columns of readings.
    Flat,
}

/// The unit of axis positions in named arguments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AngleUnit {
    /// rad
    #[default]
    Radian,
    /// °
    Degree,
}

/// How an equation is set or called. A language ignores what does not concern it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Style {
    /// Which equations have a number, in LaTeX and Typst.
    pub numbering: Numbering,
    /// Width of a line in LaTeX (at 10 pt) and Typst (at 11 pt), mm; by default that of an article in one column.
    pub width_mm: Option<f64>,
    /// Whether a table of symbols follows, in LaTeX and Typst.
    pub nomenclature: bool,
    /// The arguments of code.
    pub layout: Layout,
    /// The unit of axis positions in named arguments.
    pub angles: AngleUnit,
    /// Whether the names of functions end in that of the test, so that code of several tests lies side by side.
    pub name_of_test: bool,
}
