//! Printer for LaTeX: a fragment for a document that loads `amsmath`, broken at the coordinate groups, with a table of symbols.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use crate::equation::{Equation, Kind};
use crate::print::article::{Article, EquationLine, LeftSide, NoteKind, terms_of};
use crate::print::dialect::{self, Dialect};
use crate::print::notes;
use crate::program::{Input, Label, Program};
use crate::symbol::Unary;
use crate::variable::{Symbols, Variable};

/// Visible characters per line: the width of a 16 cm column at ten points.
const WIDTH: usize = 70;
/// Table rows per page.
const ROWS: usize = 40;

struct Latex<'a> {
    program: &'a Program,
    symbols: Symbols,
}

impl Dialect for Latex<'_> {
    fn number(&self, value: f64) -> String {
        match value {
            PI => return "\\pi".to_string(),
            TAU => return "2 \\pi".to_string(),
            _ => {}
        }
        let value = dialect::for_readers(value);
        let plain = format!("{value}");
        if plain.len() <= 12 {
            return plain;
        }
        let scientific = format!("{value:e}");
        match scientific.split_once('e') {
            Some((mantissa, exponent)) => format!("{mantissa} \\cdot 10^{{{exponent}}}"),
            None => scientific,
        }
    }
    fn input(&self, index: usize) -> String {
        input(&self.program.inputs[index], self.symbols)
    }
    fn step(&self, index: usize) -> String {
        label(&self.program.steps[index].label, self.symbols)
    }
    fn product(&self, a: &str, b: &str) -> String {
        // Between digits a space would be read as a thousands separator.
        if a.ends_with(|c: char| c.is_ascii_digit()) && b.starts_with(|c: char| c.is_ascii_digit()) {
            format!("{a} \\cdot {b}")
        } else {
            format!("{a} {b}")
        }
    }
    fn quotient(&self, a: &str, b: &str) -> String {
        format!("\\frac{{{a}}}{{{b}}}")
    }
    fn fractions(&self) -> bool {
        true
    }
    fn call(&self, function: Unary, argument: &str) -> String {
        match function {
            Unary::Sqrt => format!("\\sqrt{{{argument}}}"),
            Unary::Sin => format!("\\sin {}", of_sin_cos(self, argument)),
            Unary::Cos => format!("\\cos {}", of_sin_cos(self, argument)),
            Unary::Exp => format!("\\exp({argument})"),
            Unary::Signum => format!("\\operatorname{{sgn}}({argument})"),
            Unary::Step => format!("\\operatorname{{step}}({argument})"),
            Unary::Floor => format!("\\operatorname{{floor}}({argument})"),
            Unary::Round => format!("\\operatorname{{round}}({argument})"),
            Unary::Neg => format!("-({argument})"),
        }
    }
    fn square(&self, factor: &str) -> Option<String> {
        Some(if factor.contains(['\'', '^', ' ']) && !factor.starts_with('(') {
            format!("{{{factor}}}^2")
        } else {
            format!("{factor}^2")
        })
    }
    fn keeps_order(&self) -> bool {
        false
    }
}

/// The argument of a sine or cosine: in parentheses if it is more than one name.
pub(crate) fn of_sin_cos(dialect: &impl Dialect, argument: &str) -> String {
    if argument.contains([' ', '^']) || argument.starts_with(dialect.minus()) {
        dialect.group(argument)
    } else {
        argument.to_string()
    }
}

fn letter(text: &str) -> String {
    match text {
        "σ" => "\\sigma".to_string(),
        "θ" => "\\theta".to_string(),
        "δ" => "\\delta".to_string(),
        one if one.chars().count() == 1 => one.to_string(),
        several => format!("\\mathrm{{{}}}", escape(several)),
    }
}

fn variable(variable: &Variable, symbols: Symbols) -> String {
    let (base, subscript) = variable.letter_and_subscript(symbols);
    let lower = subscript
        .chars()
        .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit());
    match subscript.as_str() {
        "" => letter(&base),
        plain if lower => format!("{}_{{{plain}}}", letter(&base)),
        other => format!(
            "{}_{{\\mathrm{{{}}}}}",
            letter(&base),
            escape(other).replace(' ', "\\ ")
        ),
    }
}

fn input(input: &Input, symbols: Symbols) -> String {
    let turn = |short: &str, long: &str, of: &Variable| match of {
        Variable::Position { axis, .. } => format!("{short}_{{{}}}", axis.to_lowercase()),
        other => format!("{long} {}", variable(other, symbols)),
    };
    match input {
        Input::Plain(plain) => variable(plain, symbols),
        Input::Sine(of) => turn("s", "\\sin", of),
        Input::Cosine(of) => turn("c", "\\cos", of),
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
                format!("{letter}{prime}_{{\\mathrm{{{frame}}},{coordinate}}}")
            }
        }
        Label::Scalar(name) => (*name).to_string(),
        Label::Quantity(variable) => self::variable(variable, symbols),
        Label::Temporary(number) => format!("t_{{{number}}}"),
    }
}

fn output(kind: Kind, index: usize) -> String {
    let coordinate = ["x", "y", "z"][index];
    match kind {
        Kind::Length => "L".to_string(),
        Kind::Distance => "d".to_string(),
        Kind::Coordinates => format!("m_{coordinate}"),
        Kind::Volumetric => format!("\\Delta_{coordinate}"),
    }
}

/// Escapes the special characters of TeX.
fn escape(text: &str) -> String {
    let mut escaped = String::new();
    for character in text.chars() {
        match character {
            '_' | '&' | '%' | '#' | '$' | '{' | '}' => {
                escaped.push('\\');
                escaped.push(character);
            }
            '\\' => escaped.push_str("\\textbackslash{}"),
            '^' => escaped.push_str("\\textasciicircum{}"),
            '~' => escaped.push_str("\\textasciitilde{}"),
            '·' => escaped.push_str("$\\cdot$"),
            '×' => escaped.push_str("$\\times$"),
            '±' => escaped.push_str("$\\pm$"),
            'θ' => escaped.push_str("$\\theta$"),
            '−' => escaped.push_str("$-$"),
            '°' => escaped.push_str("$^\\circ$"),
            'µ' => escaped.push_str("$\\mu$"),
            other => escaped.push(other),
        }
    }
    escaped
}

/// Approximate number of visible characters: a command counts as one, braces and subscript marks as none.
fn visible(text: &str) -> usize {
    let mut count = 0;
    let mut rest = text.chars().peekable();
    while let Some(character) = rest.next() {
        match character {
            '\\' => {
                let mut name = String::new();
                while let Some(next) = rest.next_if(|c| c.is_ascii_alphabetic()) {
                    name.push(next);
                }
                count += usize::from(name != "mathrm");
            }
            '_' | '^' | '{' | '}' => {}
            ' ' => {}
            '+' | '-' => count += 3,
            _ => count += 1,
        }
    }
    count
}

/// Prints the fragment.
pub(crate) fn print(equation: &Equation) -> String {
    let article = Article::new(equation);
    let symbols = equation.options.symbols;
    let mut page = String::new();
    for line in notes::title(equation) {
        let _ = writeln!(page, "% {line}");
    }
    page.push_str("% Needs \\usepackage{amsmath}.\n\\begingroup\\allowdisplaybreaks\n");
    for section in &article.sections {
        let heading = escape(&capital(&section.heading));
        let _ = writeln!(page, "{heading}:\n\\begin{{align}}");
        let last = section.rows.len().saturating_sub(1);
        for (index, row) in section.rows.iter().enumerate() {
            let end = if index == last { "" } else { " \\\\" };
            let _ = writeln!(
                page,
                "{}{end}",
                write_line(equation, &article.program, row, symbols)
            );
        }
        page.push_str("\\end{align}\n");
    }
    page.push_str("\\endgroup\n");
    for (number, rows) in article.symbols.chunks(ROWS).enumerate() {
        let gap = if number == 0 { "" } else { "\n" };
        let _ = writeln!(
            page,
            "{gap}\\noindent\n\\begin{{tabular}}{{lll}}\n  Symbol & Unit & Meaning \\\\ \\hline"
        );
        for (symbol, meaning, unit) in rows {
            let names = match symbol {
                Input::Sine(of) | Input::Cosine(of) => {
                    let of = |input_of: fn(Variable) -> Input| input(&input_of(of.clone()), symbols);
                    format!("{},\\ {}", of(Input::Sine), of(Input::Cosine))
                }
                Input::Plain(_) => input(symbol, symbols),
            };
            let _ = writeln!(page, "  ${names}$ & {} & {} \\\\", escape(unit), escape(meaning));
        }
        page.push_str("\\end{tabular}\n");
    }
    page.push('\n');
    for note in notes::notes_spelt(equation, &escape, &|of| format!("${}$", variable(of, symbols))) {
        let _ = writeln!(page, "{note}");
    }
    page
}

fn write_line(equation: &Equation, program: &Program, row: &EquationLine, symbols: Symbols) -> String {
    let spelling = Latex { program, symbols };
    let left = match &row.left {
        LeftSide::Named(name) => label(name, symbols),
        LeftSide::Square(name) => format!("{}^2", label(name, symbols)),
        LeftSide::Output(index) => output(equation.kind, *index),
        LeftSide::Slope(index, parameter) => format!(
            "\\frac{{\\partial {}}}{{\\partial {}}}",
            output(equation.kind, *index),
            variable(parameter, symbols)
        ),
    };
    let relation = if row.approximate { "\\approx" } else { "=" };
    let lines = dialect::lines(&terms_of(&row.right), &spelling, WIDTH, visible);
    let remark = match &row.remark {
        None => String::new(),
        Some(NoteKind::NotObservable) => " \\quad\\text{(not observable)}".to_string(),
        Some(NoteKind::MultipleOf(other)) => {
            format!(" \\quad\\text{{(multiple of ${}$)}}", variable(other, symbols))
        }
    };
    let joined = lines.join(" \\notag\\\\\n  &\\qquad {} ");
    format!("  {left} &{relation} {joined}{remark}")
}

/// The text with a capital first letter.
pub(crate) fn capital(text: &str) -> String {
    let mut characters = text.chars();
    match characters.next() {
        Some(first) => first.to_uppercase().chain(characters).collect(),
        None => String::new(),
    }
}
