//! LaTeX: a fragment for a document that loads `amsmath`, broken at the coordinate groups, with a table of symbols.

use std::f64::consts::{PI, TAU};

use crate::check::Checked;
use crate::print::language::Language;
use crate::print::notation::{Notation, juxtaposed, of_sin_cos, rounded};
use crate::print::typeset::{Markup, page};
use crate::symbol::Unary;

/// LaTeX with `amsmath`.
pub(crate) struct Latex;

impl Language for Latex {
    fn print(&self, checked: &Checked<'_>) -> String {
        page(checked, self, &MARKUP)
    }
}

const MARKUP: Markup = Markup {
    // A 16 cm column at ten points.
    width: 70,
    visible,
    escape,
    comment: "% ",
    around_sections: ["% Needs \\usepackage{amsmath}.\n\\begingroup\\allowdisplaybreaks\n", "\\endgroup\n"],
    section: ["", ":\n\\begin{align}\n", " \\\\\n", "\n\\end{align}\n"],
    approximately: "\\approx",
    line_break: " \\notag\\\\\n  &\\qquad {} ",
    remark: [" \\quad\\text{", "}"],
    rows: 40,
    table: ["\\noindent\n\\begin{tabular}{lll}\n  Symbol & Unit & Meaning \\\\ \\hline\n", "\\end{tabular}\n"],
    cells: ["  ", " & ", " \\\\\n"],
    names: ",\\ ",
};

impl Notation for Latex {
    fn number(&self, value: f64) -> String {
        match value {
            PI => return "\\pi".to_string(),
            TAU => return "2 \\pi".to_string(),
            _ => {}
        }
        let value = rounded(value);
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
    fn letter(&self, text: &str) -> String {
        match text {
            "σ" => "\\sigma".to_string(),
            "θ" => "\\theta".to_string(),
            "δ" => "\\delta".to_string(),
            "Δ" => "\\Delta".to_string(),
            one if one.chars().count() == 1 => one.to_string(),
            several => format!("\\mathrm{{{}}}", escape(several)),
        }
    }
    fn subscripted(&self, letter: &str, subscript: &str) -> String {
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
        if subscript.chars().all(plain) {
            format!("{letter}_{{{subscript}}}")
        } else {
            format!("{letter}_{{\\mathrm{{{}}}}}", escape(subscript).replace(' ', "\\ "))
        }
    }
    fn coordinate(&self, vector: &str, prime: bool, frame: &str, coordinate: &str) -> String {
        let prime = if prime { "'" } else { "" };
        match frame {
            "" => format!("{vector}{prime}_{coordinate}"),
            frame => format!("{vector}{prime}_{{\\mathrm{{{frame}}},{coordinate}}}"),
        }
    }
    fn product(&self, a: &str, b: &str) -> String {
        juxtaposed(a, b, " \\cdot ")
    }
    fn quotient(&self, a: &str, b: &str) -> String {
        format!("\\frac{{{a}}}{{{b}}}")
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
    fn square(&self, factor: &str) -> String {
        if factor.contains(['\'', '^', ' ']) && !factor.starts_with('(') {
            format!("{{{factor}}}^2")
        } else {
            format!("{factor}^2")
        }
    }
    fn partial(&self) -> &str {
        "\\partial "
    }
}

/// Escapes the special characters of TeX.
fn escape(text: &str) -> String {
    let mut escaped = String::new();
    for character in text.chars() {
        match character {
            '_' | '&' | '%' | '#' | '$' | '{' | '}' => escaped.extend(['\\', character]),
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
            '_' | '^' | '{' | '}' | ' ' => {}
            '+' | '-' => count += 3,
            _ => count += 1,
        }
    }
    count
}
