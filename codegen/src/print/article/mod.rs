//! Content of an equation for readers, independent of the language: named vectors, coordinate groups or coefficients,
//! symbols, notes.

mod exact;
mod first_order;
mod groups;
pub(crate) mod line;
mod number;
mod probe;
mod tidy;

use crate::equation::Equation;
use crate::form::{Arrangement, Form};
use crate::print::article::line::{EquationLine, LeftSide, Section};
use crate::print::notation::{Notation, Spelling};
use crate::print::notes;
use crate::program::{Input, Label, Program};
use crate::tree::Tree;

/// The complete content.
pub(crate) struct Article {
    /// The inputs and names to which the expressions refer.
    pub(crate) program: Program,
    pub(crate) sections: Vec<Section>,
    /// What the reading is.
    heading: &'static str,
    /// Inputs with unit and meaning. A rotary axis is listed once, by its angle, with the symbols of its sine and
    /// cosine.
    pub(crate) symbols: Vec<(Input, String, &'static str)>,
}

impl Article {
    pub(crate) fn new(equation: &Equation) -> Self {
        let (program, sections) = match &equation.form {
            Form::Exact => exact::sections(equation),
            Form::Factored(groups) => groups::sections(equation, groups, true),
            Form::Groups { printed, complete, .. } => match &equation.touch {
                Some(touch) => probe::sections(equation, touch, printed, *complete),
                None => groups::sections(equation, printed, *complete),
            },
            Form::First(first, printed) => first_order::sections(equation, first, printed),
        };
        // The order of factored groups is that of the matrices.
        let sections = tidied(&program, sections, !matches!(equation.form, Form::Factored(_)));
        let is_listed = |index: usize, input: &Input| match input {
            // Omit a length or position that the form does not contain.
            Input::Plain(variable) if variable.is_small() => true,
            Input::Plain(_) => uses(&sections, index),
            Input::Sine(_) => uses(&sections, index) || uses(&sections, index + 1),
            Input::Cosine(_) => false,
        };
        let inputs = program.inputs.iter().enumerate();
        let symbols = inputs
            .filter(|(index, input)| is_listed(*index, input))
            .map(|(_, input)| match input {
                Input::Plain(variable) => (input.clone(), notes::meaning(equation, variable), variable.unit()),
                Input::Sine(variable) | Input::Cosine(variable) => {
                    (input.clone(), format!("sine and cosine of the {}", notes::meaning(equation, variable)), "1")
                }
            })
            .collect();
        Article { program, sections, heading: line::quantity_heading(equation), symbols }
    }

    /// The sections on the page: one equation has no table of coefficients.
    pub(crate) fn displayed(&self, equation: &Equation) -> impl Iterator<Item = &Section> {
        let single = equation.options.arrangement == Arrangement::Single;
        let slopes = |section: &&Section| section.rows.iter().all(|row| matches!(row.left, LeftSide::Slope(..)));
        self.sections.iter().filter(move |section| !(single && slopes(section)))
    }

    /// The named quantities on the left-hand sides, with meaning and unit.
    pub(crate) fn quantities<N: Notation>(&self, spelling: &Spelling<'_, N>) -> Vec<(String, String, &'static str)> {
        let mut found: Vec<(String, String, &'static str)> = Vec::new();
        for section in &self.sections {
            for row in &section.rows {
                let name = spelling.left(&row.left);
                let (name, meaning, unit) = match &row.left {
                    LeftSide::Slope(..) => continue,
                    LeftSide::Output(_) => (name, self.heading.to_string(), "mm"),
                    LeftSide::Square(label) | LeftSide::Named(label) => match label {
                        Label::Vector { letter: "u", .. } => (name, section.heading.clone(), "1"),
                        Label::Vector { .. } => (name, section.heading.clone(), "mm"),
                        Label::Quantity(variable) => (name, variable.meaning(), variable.unit()),
                        Label::Scalar(scalar) => {
                            let (meaning, unit) = line::scalar(scalar);
                            (spelling.label(label), meaning.to_string(), unit)
                        }
                        Label::Temporary(_) => continue,
                    },
                };
                match found.last_mut() {
                    // The coordinates of a vector share a row.
                    Some((names, known, _)) if *known == meaning => *names = format!("{names}, {name}"),
                    _ => found.push((name, meaning, unit)),
                }
            }
        }
        found
    }
}

/// Orders factors, cancels terms, writes exact numbers, and omits coordinates that are zero.
fn tidied(program: &Program, sections: Vec<Section>, reorder: bool) -> Vec<Section> {
    let zero = |row: &EquationLine| {
        matches!(row.left, LeftSide::Named(Label::Vector { .. })) && row.right == Tree::Number(0.0)
    };
    let section = |mut section: Section| {
        for row in section.rows.iter_mut().filter(|_| reorder) {
            row.right = tidy::tidied(program, &row.right);
        }
        for row in &mut section.rows {
            row.right = number::exact(&row.right);
        }
        section.rows.retain(|row| !zero(row));
        section
    };
    sections.into_iter().map(section).filter(|section| !section.rows.is_empty()).collect()
}

/// Whether any of the equations uses an input.
fn uses(sections: &[Section], index: usize) -> bool {
    let rows = sections.iter().flat_map(|section| &section.rows);
    rows.into_iter().any(|row| row.right.holds(index))
}
