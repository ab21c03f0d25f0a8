//! Plain text, UTF-8.

use std::f64::consts::{PI, TAU};

use crate::check::Checked;
use crate::print::Style;
use crate::print::article::Article;
use crate::print::article::line::NoteKind;
use crate::print::dialect;
use crate::print::language::Language;
use crate::print::notation::{Notation, Spelling, decimal};
use crate::print::notes;
use crate::print::system::{self, TestEquations};
use crate::symbol::Unary;
use crate::tree::terms_of;
use crate::variable::{Symbols, Variable};

/// Characters per line.
const WIDTH: usize = 100;

/// Plain text, UTF-8.
pub(crate) struct Text;

impl Notation for Text {
    fn number(&self, value: f64) -> String {
        match value {
            PI => "π".to_string(),
            TAU => "(2·π)".to_string(),
            value => decimal(value, |mantissa, exponent| format!("{mantissa}e{exponent}")),
        }
    }
    fn subscripted(&self, letter: &str, subscript: &str) -> String {
        format!("{letter}_{subscript}")
    }
    fn coordinate(&self, vector: &str, prime: bool, frame: &str, coordinate: &str) -> String {
        let prime = if prime { "′" } else { "" };
        match frame {
            "" => format!("{vector}{prime}.{coordinate}"),
            frame => format!("{vector}{prime}_{frame}.{coordinate}"),
        }
    }
    fn variable(&self, variable: &Variable, symbols: Symbols) -> String {
        variable.text(symbols)
    }
    fn product(&self, a: &str, b: &str) -> String {
        format!("{a}·{b}")
    }
    fn quotient(&self, a: &str, b: &str) -> String {
        format!("{a}/{b}")
    }
    fn fractions(&self) -> bool {
        false
    }
    fn call(&self, function: Unary, argument: &str) -> String {
        match function {
            Unary::Sqrt if argument.chars().all(|c| c.is_ascii_digit()) => format!("√{argument}"),
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
    fn square(&self, factor: &str) -> String {
        format!("{factor}²")
    }
    fn partial(&self) -> &str {
        "∂"
    }
}

impl Language for Text {
    fn print(&self, checked: &Checked<'_>, _: &Style) -> String {
        let mut page = notes::title(checked.equation).join("\n") + "\n";
        let article = Article::new(checked.equation);
        page.push_str(&sections(checked, &article));
        page.push_str("\nsymbols\n");
        page.extend(symbols(checked, &article));
        page.extend(["\n", &notes::notes(checked).join("\n"), "\n"]);
        page
    }

    fn system(&self, tests: &[TestEquations<'_>], _: &Style) -> Option<String> {
        let (mut page, mut names, mut remarks) = (String::new(), Vec::new(), String::new());
        for test in tests {
            let equation = test.equation.equation;
            let name = equation.name.as_deref().unwrap_or_default();
            let article = Article::new(equation);
            page += &format!("test {name}\n{}\n", sections(test.equation, &article));
            remarks += &format!("{name}: {}\n", notes::notes(test.equation).join("\n  "));
            for row in symbols(test.equation, &article) {
                if !names.contains(&row) {
                    names.push(row);
                }
            }
        }
        page += "derivatives of the readings by the errors, at zero errors\n";
        for block in system::blocks(tests, self, WIDTH, width) {
            let head = (String::new(), block.headers.iter().map(|header| vec![header.clone()]).collect());
            let rows: Vec<&(String, Vec<Vec<String>>)> = std::iter::once(&head).chain(&block.rows).collect();
            let widest = |column: usize| {
                let lines = rows.iter().flat_map(|(_, cells)| &cells[column]);
                lines.map(|line| width(line)).max().unwrap_or(0)
            };
            let widths: Vec<usize> = (0..block.headers.len()).map(widest).collect();
            for (name, cells) in rows {
                let height = cells.iter().map(Vec::len).max().unwrap_or(1);
                for line in 0..height {
                    let mut text = padded(if line == 0 { name } else { "" }, 10);
                    for (cell, width) in cells.iter().zip(&widths) {
                        text += &padded(cell.get(line).map_or("", String::as_str), width + 3);
                    }
                    page.extend(["  ", text.trim_end(), "\n"]);
                }
            }
            page.push('\n');
        }
        page.push_str("symbols\n");
        page.extend(names);
        page.extend(["\n", &remarks]);
        Some(page)
    }
}

fn width(text: &str) -> usize {
    text.chars().count()
}

fn padded(text: &str, to: usize) -> String {
    format!("{text}{}", " ".repeat(to.saturating_sub(width(text))))
}

/// The equations under their headings, aligned at their relations.
fn sections(checked: &Checked<'_>, article: &Article) -> String {
    let spelling = Spelling::new(&Text, &article.program, checked.equation);
    let mut page = String::new();
    for section in article.displayed(checked.equation) {
        page.extend(["\n", &section.heading, "\n"]);
        let lefts: Vec<String> = section.rows.iter().map(|row| spelling.left(&row.left)).collect();
        let widest = lefts.iter().map(|left| width(left)).max().unwrap_or(0);
        let next_line = format!("\n  {}     ", " ".repeat(widest));
        for (row, left) in section.rows.iter().zip(&lefts) {
            let relation = if row.approximate { "≈" } else { "=" };
            let left = padded(left, widest);
            let right = dialect::lines(&terms_of(&row.right), &spelling, [WIDTH; 2], width).join(&next_line);
            let remark = match &row.remark {
                None => String::new(),
                Some(NoteKind::NotObservable) => "   (not observable)".to_string(),
                Some(NoteKind::MultipleOf(other)) => {
                    format!("   (a constant multiple of that of {})", spelling.variable(other))
                }
            };
            page += &format!("  {left} {relation} {right}{remark}\n");
        }
    }
    page
}

/// The lines of the table of symbols.
fn symbols(checked: &Checked<'_>, article: &Article) -> Vec<String> {
    let spelling = Spelling::new(&Text, &article.program, checked.equation);
    let row = |(symbol, meaning, unit): &(_, String, &str)| {
        format!("  {} {unit:<4} {meaning}\n", padded(&spelling.names(symbol, ", "), 10))
    };
    article.symbols.iter().map(row).collect()
}
