//! Printer for Typst: a fragment for a document, broken at the coordinate groups, with a table of symbols.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use crate::equation::{Equation, Kind};
use crate::print::article::{Article, EquationLine, LeftSide, NoteKind, terms_of};
use crate::print::dialect::{self, Dialect};
use crate::print::latex::{capital, of_sin_cos};
use crate::print::notes;
use crate::program::{Input, Label, Program};
use crate::symbol::Unary;
use crate::variable::{Symbols, Variable};

/// Visible characters per line.
const WIDTH: usize = 72;

struct Typst<'a> {
    program: &'a Program,
    symbols: Symbols,
}

impl Dialect for Typst<'_> {
    fn number(&self, value: f64) -> String {
        match value {
            PI => "pi".to_string(),
            TAU => "2 pi".to_string(),
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
        if a.ends_with(|c: char| c.is_ascii_digit()) && b.starts_with(|c: char| c.is_ascii_digit()) {
            format!("{a} dot {b}")
        } else {
            format!("{a} {b}")
        }
    }
    fn quotient(&self, a: &str, b: &str) -> String {
        format!("frac({a}, {b})")
    }
    fn fractions(&self) -> bool {
        true
    }
    fn call(&self, function: Unary, argument: &str) -> String {
        match function {
            Unary::Sqrt => format!("sqrt({argument})"),
            Unary::Sin => format!("sin {}", of_sin_cos(self, argument)),
            Unary::Cos => format!("cos {}", of_sin_cos(self, argument)),
            Unary::Exp => format!("exp \\({argument}\\)"),
            Unary::Signum => format!("\"sgn\" \\({argument}\\)"),
            Unary::Step => format!("\"step\" \\({argument}\\)"),
            Unary::Floor => format!("\"floor\" \\({argument}\\)"),
            Unary::Round => format!("\"round\" \\({argument}\\)"),
            Unary::Neg => format!("- \\({argument}\\)"),
        }
    }
    fn group(&self, inside: &str) -> String {
        // Escaped, so that a line can break between them.
        format!("\\({inside}\\)")
    }
    fn square(&self, factor: &str) -> Option<String> {
        Some(format!("{factor}^2"))
    }
    fn keeps_order(&self) -> bool {
        false
    }
}

fn letter(text: &str) -> String {
    match text {
        "σ" => "sigma".to_string(),
        "θ" => "theta".to_string(),
        "δ" => "delta".to_string(),
        one if one.chars().count() == 1 => one.to_string(),
        several => format!("\"{several}\""),
    }
}

fn variable(variable: &Variable, symbols: Symbols) -> String {
    let (base, subscript) = variable.letter_and_subscript(symbols);
    match subscript.as_str() {
        "" => letter(&base),
        other => format!("{}_\"{other}\"", letter(&base)),
    }
}

fn input(input: &Input, symbols: Symbols) -> String {
    let turn = |short: &str, long: &str, of: &Variable| match of {
        Variable::Position { axis, .. } => format!("{short}_\"{}\"", axis.to_lowercase()),
        other => format!("{long} {}", variable(other, symbols)),
    };
    match input {
        Input::Plain(plain) => variable(plain, symbols),
        Input::Sine(of) => turn("s", "sin", of),
        Input::Cosine(of) => turn("c", "cos", of),
    }
}

fn label(name: &Label, symbols: Symbols) -> String {
    match name {
        Label::Vector {
            letter,
            frame,
            prime,
            coordinate,
        } => {
            let prime = if *prime { "'" } else { "" };
            let coordinate = ["x", "y", "z"][*coordinate];
            if frame.is_empty() {
                format!("{letter}{prime}_{coordinate}")
            } else {
                format!("{letter}{prime}_(\"{frame}\",{coordinate})")
            }
        }
        Label::Scalar(name) => (*name).to_string(),
        Label::Quantity(variable) => self::variable(variable, symbols),
        Label::Temporary(number) => format!("t_{number}"),
    }
}

fn output(kind: Kind, index: usize) -> String {
    let coordinate = ["x", "y", "z"][index];
    match kind {
        Kind::Length => "L".to_string(),
        Kind::Distance => "d".to_string(),
        Kind::Coordinates => format!("m_{coordinate}"),
        Kind::Volumetric => format!("Delta_{coordinate}"),
    }
}

/// Escapes the special characters of Typst.
fn escape(text: &str) -> String {
    let mut escaped = String::new();
    for character in text.chars() {
        if "\\#$*_`<>@[]~=+/-".contains(character) {
            escaped.push('\\');
        }
        escaped.push(character);
    }
    escaped
}

fn visible(text: &str) -> usize {
    text.chars().filter(|c| !"\"_^\\ ".contains(*c)).count()
}

/// Prints the fragment.
pub(crate) fn print(equation: &Equation) -> String {
    let article = Article::new(equation);
    let symbols = equation.options.symbols;
    let mut page = String::new();
    for line in notes::title(equation) {
        let _ = writeln!(page, "// {line}");
    }
    for section in &article.sections {
        let rows: Vec<String> = section
            .rows
            .iter()
            .map(|row| write_line(equation, &article.program, row, symbols))
            .collect();
        let heading = escape(&capital(&section.heading));
        let _ = writeln!(page, "\n{heading}:\n$\n{}\n$", rows.join(" \\\n"));
    }
    page.push_str("\n#table(\n  columns: 3,\n  [Symbol], [Unit], [Meaning],\n");
    for (symbol, meaning, unit) in &article.symbols {
        let names = match symbol {
            Input::Sine(of) | Input::Cosine(of) => {
                let of = |input_of: fn(Variable) -> Input| input(&input_of(of.clone()), symbols);
                format!("{}, {}", of(Input::Sine), of(Input::Cosine))
            }
            Input::Plain(_) => input(symbol, symbols),
        };
        let _ = writeln!(page, "  [${names}$], [{}], [{}],", escape(unit), escape(meaning));
    }
    page.push_str(")\n\n");
    for note in notes::notes_spelt(equation, &escape, &|of| format!("${}$", variable(of, symbols))) {
        let _ = writeln!(page, "{note}");
    }
    page
}

fn write_line(equation: &Equation, program: &Program, row: &EquationLine, symbols: Symbols) -> String {
    let spelling = Typst { program, symbols };
    let left = match &row.left {
        LeftSide::Named(name) => label(name, symbols),
        LeftSide::Square(name) => format!("{}^2", label(name, symbols)),
        LeftSide::Output(index) => output(equation.kind, *index),
        LeftSide::Slope(index, parameter) => format!(
            "frac(partial {}, partial {})",
            output(equation.kind, *index),
            variable(parameter, symbols)
        ),
    };
    let relation = if row.approximate { "approx" } else { "=" };
    let lines = dialect::lines(&terms_of(&row.right), &spelling, WIDTH, visible);
    let remark = match &row.remark {
        None => String::new(),
        Some(NoteKind::NotObservable) => " quad #[(not observable)]".to_string(),
        Some(NoteKind::MultipleOf(other)) => {
            format!(" quad #[(multiple of ${}$)]", variable(other, symbols))
        }
    };
    format!("  {left} &{relation} {}{remark}", lines.join(" \\\n  & quad "))
}
