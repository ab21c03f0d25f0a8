//! Plain text, UTF-8.

use std::f64::consts::{PI, TAU};

use crate::check::Checked;
use crate::print::article::Article;
use crate::print::article::line::NoteKind;
use crate::print::dialect;
use crate::print::language::Language;
use crate::print::notation::{Notation, Spelling, rounded};
use crate::print::notes;
use crate::print::style::Style;
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
            value => format!("{}", rounded(value)),
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
        let equation = checked.equation;
        let article = Article::new(equation);
        let spelling = Spelling::new(self, &article.program, equation);
        let width = |text: &str| text.chars().count();
        let mut page = notes::title(equation).join("\n") + "\n";
        for section in &article.sections {
            page.extend(["\n", &section.heading, "\n"]);
            let lefts: Vec<String> = section.rows.iter().map(|row| spelling.left(&row.left)).collect();
            let widest = lefts.iter().map(|left| width(left)).max().unwrap_or(0);
            let next_line = format!("\n  {}     ", " ".repeat(widest));
            for (row, left) in section.rows.iter().zip(&lefts) {
                let relation = if row.approximate { "≈" } else { "=" };
                let gap = " ".repeat(widest - width(left));
                let right = dialect::lines(&terms_of(&row.right), &spelling, [WIDTH; 2], width).join(&next_line);
                let remark = match &row.remark {
                    None => String::new(),
                    Some(NoteKind::NotObservable) => "   (not observable)".to_string(),
                    Some(NoteKind::MultipleOf(other)) => {
                        format!("   (a constant multiple of that of {})", spelling.variable(other))
                    }
                };
                page += &format!("  {left}{gap} {relation} {right}{remark}\n");
            }
        }
        page.push_str("\nsymbols\n");
        for (symbol, meaning, unit) in &article.symbols {
            let names = spelling.names(symbol, ", ");
            let gap = " ".repeat(10_usize.saturating_sub(width(&names)));
            page += &format!("  {names}{gap} {unit:<4} {meaning}\n");
        }
        page.extend(["\n", &notes::notes(checked).join("\n"), "\n"]);
        page
    }
}
