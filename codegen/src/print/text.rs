//! Plain text, UTF-8.

use std::fmt::Write;

use crate::equation::{Equation, Kind};
use crate::print::dialect::{self, Dialect};
use crate::program::{Input, Label, Naming, Program};
use crate::symbol::{Operand, Unary};
use crate::variable::{Symbols, Variable};
use crate::vectors;

/// Spells a program for a reader of plain text.
struct Text<'a> {
    program: &'a Program,
    symbols: Symbols,
}

impl Dialect for Text<'_> {
    fn number(&self, value: f64) -> String {
        format!("{value}")
    }
    fn input(&self, place: usize) -> String {
        input(&self.program.inputs[place], self.symbols)
    }
    fn step(&self, place: usize) -> String {
        label(&self.program.steps[place].label)
    }
    fn product(&self, a: &str, b: &str) -> String {
        format!("{a}·{b}")
    }
    fn call(&self, function: Unary, argument: &str) -> String {
        match function {
            Unary::Sqrt => format!("√({argument})"),
            Unary::Sin => format!("sin({argument})"),
            Unary::Cos => format!("cos({argument})"),
            Unary::Exp => format!("exp({argument})"),
            Unary::Signum => format!("sign({argument})"),
            Unary::Neg => format!("−({argument})"),
        }
    }
    fn minus(&self) -> &str {
        "−"
    }
    fn square(&self, factor: &str) -> Option<String> {
        Some(format!("{factor}²"))
    }
    fn keeps_order(&self) -> bool {
        false
    }
}

/// `s_a` for the sine of θ_a, and so on.
pub(crate) fn input(input: &Input, symbols: Symbols) -> String {
    let turn = |letter: &str, variable: &Variable| match variable {
        Variable::Position { axis, .. } => format!("{letter}_{}", axis.to_lowercase()),
        other if letter == "s" => format!("sin({})", other.text(symbols)),
        other => format!("cos({})", other.text(symbols)),
    };
    match input {
        Input::Plain(variable) => variable.text(symbols),
        Input::Sine(variable) => turn("s", variable),
        Input::Cosine(variable) => turn("c", variable),
    }
}

/// `p_A.x` for a coordinate of the point p in the frame of A.
pub(crate) fn label(label: &Label) -> String {
    match label {
        Label::Vector {
            letter,
            frame,
            prime,
            coordinate,
        } => {
            let frame = if frame.is_empty() {
                String::new()
            } else {
                format!("_{frame}")
            };
            let prime = if *prime { "′" } else { "" };
            format!("{letter}{prime}{frame}.{}", ["x", "y", "z"][*coordinate])
        }
        Label::Scalar(name) => (*name).to_string(),
        Label::Temporary(number) => format!("t{number}"),
    }
}

/// The whole equation.
pub(crate) fn print(equation: &Equation) -> String {
    let labels = vectors::labels(&equation.vectors);
    let mut asked: Vec<Operand> = equation.exact.clone();
    asked.extend(equation.vectors.iter().flat_map(|vector| vector.components));
    let program = equation
        .arena
        .program(equation.inputs(), &asked, &labels, Naming::Labelled);
    let spelling = Text {
        program: &program,
        symbols: equation.options.symbols,
    };
    let mut page = String::new();
    for step in &program.steps {
        let value = dialect::write(&step.value, &spelling);
        let _ = writeln!(page, "{} = {value}", label(&step.label));
    }
    for (place, output) in program.outputs[..equation.exact.len()].iter().enumerate() {
        let name = match equation.kind {
            Kind::Length => "L".to_string(),
            Kind::Coordinates => format!("m.{}", ["x", "y", "z"][place]),
            Kind::Volumetric => format!("Δ.{}", ["x", "y", "z"][place]),
        };
        let _ = writeln!(page, "{name} = {}", dialect::write(output, &spelling));
    }
    page
}
