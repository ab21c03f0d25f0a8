//! Arguments of printed code by name: lengths as in the session, axis positions and drivers with their unit, errors by
//! their name in ISO 230-1 with the default 0.

use crate::equation::Equation;
use crate::print::AngleUnit;
use crate::print::notes;
use crate::program::Input;
use crate::variable::Variable;

/// An argument of a function.
pub(crate) struct Argument {
    pub(crate) name: String,
    pub(crate) unit: &'static str,
    pub(crate) meaning: String,
    /// Whether it is an error, an instrument parameter or a coefficient, which are 0 by default.
    pub(crate) error: bool,
    /// The input that it is.
    input: Option<usize>,
    /// The inputs that are its sine, its cosine and its value in rad.
    pub(crate) angle: Option<[Option<usize>; 3]>,
}

impl Argument {
    /// The input that it is; `None` for an angle.
    pub(crate) fn input(&self) -> Option<usize> {
        self.input
    }
}

/// The arguments for these inputs, in their order.
pub(crate) fn of(equation: &Equation, inputs: &[Input], angles: AngleUnit) -> Vec<Argument> {
    let mut arguments: Vec<Argument> = Vec::new();
    let mut turned: Vec<&Variable> = Vec::new();
    let place = |input: Input| inputs.iter().position(|known| *known == input);
    for (index, input) in inputs.iter().enumerate() {
        let variable = input.variable();
        let rotary = matches!(variable, Variable::Position { .. }) && variable.is_angle();
        if rotary && turned.contains(&variable) {
            continue;
        }
        turned.extend(rotary.then_some(variable));
        let degrees = rotary && angles == AngleUnit::Degree;
        let angle = rotary.then(|| {
            [Input::Sine(variable.clone()), Input::Cosine(variable.clone()), Input::Plain(variable.clone())].map(place)
        });
        arguments.push(Argument {
            name: name(variable, degrees),
            unit: if degrees { "deg" } else { variable.unit() },
            meaning: notes::meaning(equation, variable),
            error: variable.is_small(),
            input: (!rotary).then_some(index),
            angle,
        });
    }
    arguments
}

/// The name, with the letters, digits and underscores of ASCII alone.
fn name(variable: &Variable, degrees: bool) -> String {
    let text = match variable {
        Variable::Position { axis, .. } if !variable.is_angle() => format!("{axis}_mm"),
        Variable::Position { axis, .. } => format!("{axis}_{}", if degrees { "deg" } else { "rad" }),
        Variable::Driver(quantity) => quantity.identifier.clone(),
        Variable::Coefficient(coefficient) => format!("k_{}", coefficient.number),
        other => other.name(),
    };
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let plain: String = text.chars().map(plain).collect();
    if plain.starts_with(|c: char| c.is_ascii_alphabetic()) { plain } else { format!("v{plain}") }
}
