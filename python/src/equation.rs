//! The closed form of the readings of a test.

use abbe::codegen::print::{Layout, Style};
use abbe::codegen::{Equation, Options, Order, SessionTest, Symbols, check, language as language_of};
use abbe::equation::EquationParameters;
use abbe::model::frames::Rotation;
use pyo3::prelude::*;

use crate::failed::Failed;
use crate::session::{Session, no_test};
use crate::work;

/// The checked equation of a test, printed in a language.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the options of an equation, each with its name in Python")]
pub fn equation(
    py: Python<'_>,
    session: &Session,
    test: &str,
    language: &str,
    order: &str,
    rotation: Option<&str>,
    errors: Option<Vec<String>>,
    notation: &str,
    symbols: Option<Vec<String>>,
    gradient: bool,
) -> PyResult<String> {
    let state = session.state();
    work::at_once(py, || {
        let session = &state.session;
        let test = session.tests.iter().find(|known| known.name == test).ok_or_else(|| no_test(&state, test))?;
        let parameters = EquationParameters::of_test(session, test, &errors.unwrap_or_default())?;
        let rotations = [("exact", Rotation::Exact), ("small-angle", Rotation::SmallAngle)];
        let options = Options {
            order: choice(
                "order",
                order,
                &[("exact", Order::Exact), ("bilinear", Order::Bilinear), ("first", Order::First)],
            )?,
            rotation: rotation.map(|word| choice("rotation", word, &rotations)).transpose()?,
            symbols: choice("notation", notation, &[("literature", Symbols::Literature), ("iso", Symbols::Iso)])?,
            gradient,
            unknowns: parameters.instrument,
            effects: parameters.effects,
            ..Options::default()
        };
        let language = language_of(language)?;
        let source = SessionTest::new(session, test)?;
        let source = match symbols {
            Some(axes) => source.with_symbols(&axes)?,
            None if language.keeps_symbols() => source,
            None => source.with_symbols(&[])?,
        };
        let equation = Equation::of(&session.machine, &source, &parameters.errors, &options)?;
        // The functions of this module call Python with arrays.
        let layout = if language.word == "python" { Layout::Flat } else { Layout::default() };
        Ok(language.print(&check(&equation, &source)?, &Style { layout, ..Style::default() })?)
    })
}

/// The value of a word.
fn choice<T: Copy>(name: &str, word: &str, known: &[(&str, T)]) -> Result<T, Failed> {
    known.iter().find(|(own, _)| *own == word).map(|(_, value)| *value).ok_or_else(|| {
        let words: Vec<String> = known.iter().map(|(own, _)| format!("\"{own}\"")).collect();
        Failed::argument(format!("`{name}` is \"{word}\""), format!("known: {}", words.join(", ")))
    })
}
