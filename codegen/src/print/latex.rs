//! LaTeX: a fragment for a document that loads `amsmath`, broken at the coordinate groups, with a table of symbols.

use std::f64::consts::{PI, TAU};

use crate::check::Checked;
use crate::print::Style;
use crate::print::language::Language;
use crate::print::notation::{Notation, decimal, juxtaposed};
use crate::print::system::{Block, TestEquations};
use crate::print::tex_width;
use crate::print::typeset::{Markup, page, system};
use crate::symbol::Unary;

/// LaTeX with `amsmath`.
pub(crate) struct Latex;

impl Language for Latex {
    fn print(&self, checked: &Checked<'_>, style: &Style) -> String {
        page(checked, style, self, &MARKUP)
    }
    fn system(&self, tests: &[TestEquations<'_>], style: &Style) -> Option<String> {
        Some(system(tests, style, self, &MARKUP))
    }
}

const MARKUP: Markup = Markup {
    // The text width of the class `article` at ten points.
    width_mm: 121.0,
    measure: tex_width::width,
    indentation: 2100,
    escape,
    comment: "% ",
    around_sections: ["% Needs \\usepackage{amsmath}.\n\\begingroup\\allowdisplaybreaks\n", "\\endgroup\n"],
    display,
    heading: ["\\paragraph{", "}\n"],
    matrix,
    approximately: "\\approx",
    line_break: " \\notag\\\\\n  &\\qquad {} ",
    remark: [" \\quad\\text{", "}"],
    table: |meanings| {
        let opening = "% Needs \\usepackage{array,booktabs}.\n\\noindent\n\\begin{tabular}{@{}l>{\\raggedright\
                       \\arraybackslash}p{";
        let head = "  \\toprule\n  Symbol & Meaning & Unit \\\\\n  \\midrule\n";
        [
            format!("{opening}{meanings}pt}}l@{{}}}}\n{head}"),
            "  \\bottomrule\n\\end{tabular}\n\\par\\medskip\n".to_string(),
        ]
    },
    cells: ["  ", " & ", " \\\\\n"],
    names: ",\\ ",
};

/// An environment of amsmath; equations without a label have no number.
fn display(rows: &[(String, Option<String>)]) -> String {
    let star = if rows.iter().all(|(_, label)| label.is_none()) { "*" } else { "" };
    let row = |(text, label): &(String, Option<String>)| match label {
        Some(label) => format!("{text} \\label{{{label}}}"),
        None if star.is_empty() => format!("{text} \\notag"),
        None => text.clone(),
    };
    let rows: Vec<String> = rows.iter().map(row).collect();
    let mut rows = rows.join(" \\\\\n");
    if !star.is_empty() {
        rows = rows.replace(" \\notag", "");
    }
    format!("\\begin{{align{star}}}\n{rows}\n\\end{{align{star}}}\n")
}

/// An array with named rows and columns. A cell of several lines is an array of its own.
fn matrix(block: &Block) -> String {
    let cell = |lines: &Vec<String>| match lines.as_slice() {
        [line] => line.clone(),
        lines => format!("\\begin{{array}}[t]{{@{{}}l@{{}}}} {} \\end{{array}}", lines.join(" \\\\ {} ")),
    };
    let headers: Vec<String> = block.headers.iter().map(|header| format!(" & \\text{{{header}}}")).collect();
    let row = |(name, cells): &(String, Vec<Vec<String>>)| {
        let cells: Vec<String> = cells.iter().map(|lines| format!(" & {}", cell(lines))).collect();
        format!("  {name}{} \\\\\n", cells.concat())
    };
    let rows: String = block.rows.iter().map(row).collect();
    let columns = "l".repeat(block.headers.len());
    format!(
        "\\begin{{equation*}}\n\\setlength{{\\arraycolsep}}{{3pt}}\n\
         \\begin{{array}}{{@{{}}l|{columns}@{{}}}}\n  {} \\\\ \\hline\n\
         {rows}\\end{{array}}\n\\end{{equation*}}\n",
        headers.concat()
    )
}

impl Notation for Latex {
    fn number(&self, value: f64) -> String {
        match value {
            PI => "\\pi".to_string(),
            TAU => "2 \\pi".to_string(),
            value => decimal(value, |mantissa, exponent| format!("{mantissa} \\cdot 10^{{{exponent}}}")),
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
            "" if coordinate.len() > 1 => format!("{vector}{prime}_{{\\mathrm{{{coordinate}}}}}"),
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
            Unary::Sin => format!("\\sin({argument})"),
            Unary::Cos => format!("\\cos({argument})"),
            Unary::Exp => format!("\\exp({argument})"),
            Unary::Signum => format!("\\operatorname{{sgn}}({argument})"),
            Unary::Step => format!("\\operatorname{{step}}({argument})"),
            Unary::Floor => format!("\\operatorname{{floor}}({argument})"),
            Unary::Round => format!("\\operatorname{{round}}({argument})"),
            Unary::Neg => format!("-({argument})"),
        }
    }
    fn abbreviated(&self, function: &str, angle: &str) -> String {
        format!("\\mathrm{{{function}}}{angle}")
    }
    fn long_root(&self, argument: &str) -> String {
        format!("\\bigl( {argument} \\bigr)^{{1/2}}")
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
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            // An identifier breaks behind its parts.
            '_' => escaped.push_str("\\_\\allowbreak{}"),
            '~' => escaped.push_str("\\textasciitilde{}\\allowbreak{}"),
            ':' | '.' if characters.peek().is_some_and(|next| next.is_alphabetic()) => {
                escaped.extend([character]);
                escaped.push_str("\\allowbreak{}");
            }
            '&' | '%' | '#' | '$' | '{' | '}' => escaped.extend(['\\', character]),
            '\\' => escaped.push_str("\\textbackslash{}"),
            '^' => escaped.push_str("\\textasciicircum{}"),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// What TeX would read as a command, a comment or a space is printed as it is.
    #[test]
    fn special_characters_are_printed_as_they_are() {
        for (text, tex) in [
            ("EX0C~C", "EX0C\\textasciitilde{}\\allowbreak{}C"),
            ("ball_x", "ball\\_\\allowbreak{}x"),
            ("A.x at 0.5", "A.\\allowbreak{}x at 0.5"),
            ("5 % & #1 {$}", "5 \\% \\& \\#1 \\{\\$\\}"),
            ("\\", "\\textbackslash{}"),
        ] {
            assert_eq!(escape(text), tex);
        }
    }
}
