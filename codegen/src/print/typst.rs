//! Typst: a fragment for a document, broken at the coordinate groups, with a table of symbols.

use std::f64::consts::{PI, TAU};

use crate::check::Checked;
use crate::print::Style;
use crate::print::dialect::PRODUCT;
use crate::print::language::Language;
use crate::print::notation::{Notation, decimal, juxtaposed};
use crate::print::system::{Block, TestEquations};
use crate::print::typeset::{Markup, page, system};
use crate::symbol::Unary;

/// Typst.
pub(crate) struct Typst;

impl Language for Typst {
    fn print(&self, checked: &Checked<'_>, style: &Style) -> String {
        page(checked, style, self, &MARKUP)
    }
    fn system(&self, tests: &[TestEquations<'_>], style: &Style) -> Option<String> {
        Some(system(tests, style, self, &MARKUP))
    }
}

const MARKUP: Markup = Markup {
    width_mm: 160.0,
    measure,
    indentation: 1100,
    escape,
    comment: "// ",
    around_sections: ["", "\n"],
    display,
    heading: ["*", "*\n\n"],
    matrix,
    approximately: "approx",
    line_break: " \\\n  & quad ",
    remark: [" quad #[", "]"],
    table: |_| {
        let head = "  table.hline(), [Symbol], [Meaning], [Unit], table.hline(stroke: 0.5pt),\n";
        let opening = "#table(\n  columns: (auto, 1fr, auto), stroke: none, inset: (x: 4pt, y: 3pt),\n";
        [format!("{opening}{head}"), "  table.hline(),\n)\n".to_string()]
    },
    cells: ["  [", "], [", "],\n"],
    names: ", ",
};

/// Equations without a number in one block, each numbered one in its own.
fn display(rows: &[(String, Option<String>)]) -> String {
    let mut text = String::new();
    for rows in rows.chunk_by(|(_, a), (_, b)| a.is_none() && b.is_none()) {
        let lines: Vec<&str> = rows.iter().map(|(line, _)| line.as_str()).collect();
        let lines = lines.join(" \\\n");
        text += &match &rows[0].1 {
            None => format!("$\n{lines}\n$\n"),
            Some(label) => format!("#math.equation(block: true, numbering: \"(1)\", $\n{lines}\n$) <{label}>\n"),
        };
    }
    text
}

/// A table with named rows and columns.
fn matrix(block: &Block) -> String {
    let headers: Vec<String> = block.headers.iter().map(|header| format!(", [{header}]")).collect();
    let row = |(name, cells): &(String, Vec<Vec<String>>)| {
        let cells: Vec<String> = cells.iter().map(|lines| format!(", [${}$]", lines.join("$ \\ $"))).collect();
        format!("  [${name}$]{},\n", cells.concat())
    };
    let rows: String = block.rows.iter().map(row).collect();
    let columns = block.headers.len() + 1;
    format!(
        "#table(\n  columns: {columns}, stroke: none, inset: 3pt,\n  []{}, table.hline(),\n{rows})\n",
        headers.concat()
    )
}

impl Notation for Typst {
    fn number(&self, value: f64) -> String {
        match value {
            PI => "pi".to_string(),
            TAU => "2 pi".to_string(),
            value => decimal(value, |mantissa, exponent| format!("{mantissa} dot 10^({exponent})")),
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
            "" if coordinate.len() > 1 => format!("{vector}{prime}_\"{coordinate}\""),
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
            Unary::Sin => format!("sin \\({argument}\\)"),
            Unary::Cos => format!("cos \\({argument}\\)"),
            Unary::Exp => format!("exp \\({argument}\\)"),
            Unary::Signum => format!("\"sgn\" \\({argument}\\)"),
            Unary::Step => format!("\"step\" \\({argument}\\)"),
            Unary::Floor => format!("\"floor\" \\({argument}\\)"),
            Unary::Round => format!("\"round\" \\({argument}\\)"),
            Unary::Neg => format!("- \\({argument}\\)"),
        }
    }
    fn abbreviated(&self, function: &str, angle: &str) -> String {
        format!("upright({function}) {angle}")
    }
    fn inline_quotient(&self, a: &str, b: &str) -> String {
        format!("{a} \\/ {b}")
    }
    fn long_root(&self, argument: &str) -> String {
        format!("\\({argument}\\)^(1\\/2)")
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

/// Every visible character is as wide as a letter, signs with their spaces as two.
fn measure(text: &str) -> usize {
    let one = |character: char| match character {
        '"' | '_' | '^' | '\\' | ' ' | PRODUCT => 0,
        '+' | '-' | '=' => 1400,
        _ => 580,
    };
    text.chars().map(one).sum()
}
