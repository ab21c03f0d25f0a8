//! Typst: a fragment for a document, broken at the coordinate groups, with a table of symbols.

use std::f64::consts::{PI, TAU};

use crate::check::Checked;
use crate::print::language::Language;
use crate::print::notation::{Notation, juxtaposed, of_sin_cos, rounded};
use crate::print::typeset::{Markup, page};
use crate::symbol::Unary;

/// Typst.
pub(crate) struct Typst;

impl Language for Typst {
    fn print(&self, checked: &Checked<'_>) -> String {
        page(checked, self, &MARKUP)
    }
}

const MARKUP: Markup = Markup {
    width: 72,
    visible,
    escape,
    comment: "// ",
    around_sections: ["", "\n"],
    section: ["\n", ":\n$\n", " \\\n", "\n$\n"],
    approximately: "approx",
    line_break: " \\\n  & quad ",
    remark: [" quad #[", "]"],
    // A table breaks across pages.
    rows: usize::MAX,
    table: ["#table(\n  columns: 3,\n  [Symbol], [Unit], [Meaning],\n", ")\n"],
    cells: ["  [", "], [", "],\n"],
    names: ", ",
};

impl Notation for Typst {
    fn number(&self, value: f64) -> String {
        match value {
            PI => "pi".to_string(),
            TAU => "2 pi".to_string(),
            value => format!("{}", rounded(value)),
        }
    }
    fn letter(&self, text: &str) -> String {
        match text {
            "σ" => "sigma".to_string(),
            "θ" => "theta".to_string(),
            "δ" => "delta".to_string(),
            "Δ" => "Delta".to_string(),
            one if one.chars().count() == 1 => one.to_string(),
            several => format!("\"{several}\""),
        }
    }
    fn subscripted(&self, letter: &str, subscript: &str) -> String {
        format!("{letter}_\"{subscript}\"")
    }
    fn coordinate(&self, vector: &str, prime: bool, frame: &str, coordinate: &str) -> String {
        let prime = if prime { "'" } else { "" };
        match frame {
            "" => format!("{vector}{prime}_{coordinate}"),
            frame => format!("{vector}{prime}_(\"{frame}\",{coordinate})"),
        }
    }
    fn product(&self, a: &str, b: &str) -> String {
        juxtaposed(a, b, " dot ")
    }
    fn quotient(&self, a: &str, b: &str) -> String {
        format!("frac({a}, {b})")
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
    fn partial(&self) -> &str {
        "partial "
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
