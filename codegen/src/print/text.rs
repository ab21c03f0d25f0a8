//! Printer for plain text, UTF-8.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use crate::equation::{Equation, Kind};
use crate::print::article::{Article, LeftSide, NoteKind, terms_of};
use crate::print::dialect::{self, Dialect};
use crate::print::notes;
use crate::program::{Input, Label, Program};
use crate::symbol::Unary;
use crate::variable::{Symbols, Variable};

/// Characters per line.
const WIDTH: usize = 100;

/// Notation of expressions in plain text.
struct Text<'a> {
    program: &'a Program,
    symbols: Symbols,
}

impl Dialect for Text<'_> {
    fn number(&self, value: f64) -> String {
        match value {
            PI => "π".to_string(),
            TAU => "(2·π)".to_string(),
            value => format!("{}", dialect::for_readers(value)),
        }
    }
    fn input(&self, index: usize) -> String {
        input(&self.program.inputs[index], self.symbols)
    }
    fn step(&self, index: usize) -> String {
        label(&self.program.steps[index].label, self.symbols)
    }
    fn product(&self, a: &str, b: &str) -> String {
        format!("{a}·{b}")
    }
    fn quotient(&self, a: &str, b: &str) -> String {
        format!("{a}/{b}")
    }
    fn call(&self, function: Unary, argument: &str) -> String {
        match function {
            Unary::Sqrt => format!("√({argument})"),
            Unary::Sin => format!("sin({argument})"),
            Unary::Cos => format!("cos({argument})"),
            Unary::Exp => format!("exp({argument})"),
            Unary::Signum => format!("sign({argument})"),
            Unary::Step => format!("step({argument})"),
            Unary::Floor => format!("⌊{argument}⌋"),
            Unary::Round => format!("round({argument})"),
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

/// The symbol of an input, such as `s_a` for the sine of θ_a.
fn input(input: &Input, symbols: Symbols) -> String {
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

/// The symbol of a step, such as `p_A.x` for a coordinate of the point p in the frame of A.
fn label(label: &Label, symbols: Symbols) -> String {
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
        Label::Quantity(variable) => variable.text(symbols),
        Label::Temporary(number) => format!("t{number}"),
    }
}

fn output(kind: Kind, index: usize) -> String {
    match kind {
        Kind::Length => "L".to_string(),
        Kind::Distance => "d".to_string(),
        Kind::Coordinates => format!("m.{}", ["x", "y", "z"][index]),
        Kind::Volumetric => format!("Δ.{}", ["x", "y", "z"][index]),
    }
}

/// Prints the equation.
pub(crate) fn print(equation: &Equation) -> String {
    let article = Article::new(equation);
    let symbols = equation.options.symbols;
    let spelling = Text {
        program: &article.program,
        symbols,
    };
    let mut page = notes::title(equation).join("\n") + "\n";
    for section in &article.sections {
        let _ = writeln!(page, "\n{}", section.heading);
        let left = |left: &LeftSide| match left {
            LeftSide::Named(name) => label(name, symbols),
            LeftSide::Square(name) => format!("{}²", label(name, symbols)),
            LeftSide::Output(index) => output(equation.kind, *index),
            LeftSide::Slope(index, parameter) => {
                format!("∂{}/∂{}", output(equation.kind, *index), parameter.text(symbols))
            }
        };
        let lefts: Vec<String> = section.rows.iter().map(|row| left(&row.left)).collect();
        let widest = lefts.iter().map(|left| left.chars().count()).max().unwrap_or(0);
        for (row, left) in section.rows.iter().zip(&lefts) {
            let relation = if row.approximate { "≈" } else { "=" };
            let lines = dialect::lines(&terms_of(&row.right), &spelling, WIDTH, |piece| {
                piece.chars().count()
            });
            let gap = " ".repeat(widest - left.chars().count());
            let _ = write!(page, "  {left}{gap} {relation} ");
            let _ = write!(
                page,
                "{}",
                lines.join(&format!("\n  {}     ", " ".repeat(widest)))
            );
            match &row.remark {
                None => page.push('\n'),
                Some(NoteKind::NotObservable) => page.push_str("   (not observable)\n"),
                Some(NoteKind::MultipleOf(other)) => {
                    let _ = writeln!(
                        page,
                        "   (a constant multiple of that of {})",
                        other.text(symbols)
                    );
                }
            }
        }
    }
    page.push_str("\nsymbols\n");
    for (symbol, meaning, unit) in &article.symbols {
        let names = match symbol {
            Input::Sine(variable) | Input::Cosine(variable) => format!(
                "{}, {}",
                input(&Input::Sine(variable.clone()), symbols),
                input(&Input::Cosine(variable.clone()), symbols)
            ),
            Input::Plain(_) => input(symbol, symbols),
        };
        let gap = " ".repeat(10_usize.saturating_sub(names.chars().count()));
        let _ = writeln!(page, "  {names}{gap} {unit:<4} {meaning}");
    }
    page.push('\n');
    page.push_str(&notes::notes(equation).join("\n"));
    page.push('\n');
    page
}
