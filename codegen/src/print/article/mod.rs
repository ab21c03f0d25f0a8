//! Content of an equation for readers, independent of the language: named vectors, coordinate groups or coefficients,
//! symbols, notes.

mod exact;
mod first_order;
mod groups;
pub(crate) mod line;
mod probe;

use crate::equation::Equation;
use crate::form::Form;
use crate::print::article::line::Section;
use crate::print::notes;
use crate::program::{Input, Program};

/// The complete content.
pub(crate) struct Article {
    /// The inputs and names to which the expressions refer.
    pub(crate) program: Program,
    pub(crate) sections: Vec<Section>,
    /// Inputs with unit and meaning. A rotary axis is listed once, by its angle, with the symbols of its sine and
    /// cosine.
    pub(crate) symbols: Vec<(Input, String, &'static str)>,
}

impl Article {
    pub(crate) fn new(equation: &Equation) -> Self {
        let (program, sections) = match &equation.form {
            Form::Exact => exact::sections(equation),
            Form::Groups { printed, complete, .. } => match &equation.touch {
                Some(touch) => probe::sections(equation, touch, printed, *complete),
                None => groups::sections(equation, printed, *complete),
            },
            Form::First(first, printed) => first_order::sections(equation, first, printed),
        };
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
                    (input.clone(), format!("sine and cosine of the {}", variable.meaning()), "1")
                }
            })
            .collect();
        Article { program, sections, symbols }
    }
}

/// Whether any of the equations uses an input.
fn uses(sections: &[Section], index: usize) -> bool {
    let rows = sections.iter().flat_map(|section| &section.rows);
    rows.into_iter().any(|row| row.right.holds(index))
}
