//! The page of an article in a typesetting language: equations section by section, and a table of symbols. What was
//! checked stands in comments.

use crate::check::Checked;
use crate::print::article::Article;
use crate::print::article::line::{EquationLine, LeftSide, NoteKind};
use crate::print::dialect::{self, PRODUCT};
use crate::print::notation::{Notation, Spelling};
use crate::print::notes;
use crate::print::system::{self, Block, TestEquations};
use crate::print::tex_width::POINTS_PER_MM;
use crate::print::{Numbering, Style};
use crate::tree::terms_of;

/// The commands of a typesetting language around the expressions. Widths are in 1/100 pt.
pub(crate) struct Markup {
    /// Width of a line, mm, if none is requested.
    pub(crate) width_mm: f64,
    /// The width of a piece of an equation.
    pub(crate) measure: fn(&str) -> usize,
    /// Width of the indentation of a continued line.
    pub(crate) indentation: usize,
    /// Escapes the special characters of words.
    pub(crate) escape: fn(&str) -> String,
    /// Before each line of a comment.
    pub(crate) comment: &'static str,
    /// Before the first section and after the last one.
    pub(crate) around_sections: [&'static str; 2],
    /// The displayed equations: each its text and, if it has a number, its label.
    pub(crate) display: fn(&[(String, Option<String>)]) -> String,
    /// Around the heading of a test or of the matrix.
    pub(crate) heading: [&'static str; 2],
    /// A block of the matrix of sensitivities.
    pub(crate) matrix: fn(&Block) -> String,
    /// The sign of an approximation.
    pub(crate) approximately: &'static str,
    /// Between the lines of one equation.
    pub(crate) line_break: &'static str,
    /// Before and after a remark on an equation.
    pub(crate) remark: [&'static str; 2],
    /// Before and after the rows of the table of symbols, from the width of the meanings in points.
    pub(crate) table: fn(usize) -> [String; 2],
    /// Around the cells of a row: before the first, between two, after the last.
    pub(crate) cells: [&'static str; 3],
    /// Between two symbols in one cell.
    pub(crate) names: &'static str,
}

/// Width of the relation and the spaces beside it.
const RELATION: usize = 1400;
/// Width of the number of an equation and the space before it.
const NUMBER: usize = 3500;
/// Width of units and of the spaces between the columns of the table of symbols.
const UNIT_COLUMN: usize = 7000;
/// Lines of a table of symbols that fit a column of a page.
const LINES: usize = 34;

/// The page of an equation.
pub(crate) fn page(checked: &Checked<'_>, style: &Style, notation: &impl Notation, markup: &Markup) -> String {
    let article = Article::new(checked.equation);
    let spelling = Spelling::new(notation, &article.program, checked.equation);
    let mut page = comments(markup, notes::title(checked.equation));
    page.push_str(markup.around_sections[0]);
    page.push_str(&sections(checked, &article, &spelling, style, markup));
    page.push_str(markup.around_sections[1]);
    if style.nomenclature {
        page.push_str(&nomenclature(symbols(&article, &spelling, markup), markup, width(style, markup)));
    }
    page.push_str(&comments(markup, notes::notes(checked)));
    page.replace(PRODUCT, " ")
}

/// The page of all tests: their equations, and the matrix of their sensitivities.
pub(crate) fn system(tests: &[TestEquations<'_>], style: &Style, notation: &impl Notation, markup: &Markup) -> String {
    let mut page = markup.around_sections[0].to_string();
    let mut names: Vec<(String, String, &str)> = Vec::new();
    let mut remarks = String::new();
    for test in tests {
        let equation = test.equation.equation;
        let article = Article::new(equation);
        let spelling = Spelling::new(notation, &article.program, equation);
        let name = (markup.escape)(equation.name.as_deref().unwrap_or_default());
        page.push_str(&format!("{}Test {name}{}", markup.heading[0], markup.heading[1]));
        page.push_str(&sections(test.equation, &article, &spelling, style, markup));
        for row in symbols(&article, &spelling, markup) {
            if !names.contains(&row) {
                names.push(row);
            }
        }
        remarks.push_str(&comments(markup, notes::title(equation)));
        remarks.push_str(&comments(markup, notes::notes(test.equation)));
    }
    let width = width(style, markup);
    let [before, after] = markup.heading;
    page.push_str(&format!("{before}Derivatives of the readings by the errors, at zero errors{after}"));
    for mut block in system::blocks(tests, notation, width, markup.measure) {
        block.headers = block.headers.iter().map(|header| (markup.escape)(header)).collect();
        page.push_str(&(markup.matrix)(&block));
    }
    page.push_str(markup.around_sections[1]);
    if style.nomenclature {
        page.push_str(&nomenclature(names, markup, width));
    }
    page.push_str(&remarks);
    page.replace(PRODUCT, " ")
}

/// The available width, 1/100 pt.
fn width(style: &Style, markup: &Markup) -> usize {
    (style.width_mm.unwrap_or(markup.width_mm) * POINTS_PER_MM * 100.0) as usize
}

fn comments(markup: &Markup, lines: Vec<String>) -> String {
    lines.into_iter().map(|line| format!("{}{line}\n", markup.comment)).collect()
}

/// The displayed equations under their headings.
fn sections<N: Notation>(
    checked: &Checked<'_>,
    article: &Article,
    spelling: &Spelling<'_, N>,
    style: &Style,
    markup: &Markup,
) -> String {
    let width = width(style, markup);
    let label = notes::label(checked.equation);
    // The reading is the last output; coefficients follow it.
    let reading = |row: &EquationLine| matches!(row.left, LeftSide::Output(_));
    let count = article.sections.iter().flat_map(|section| &section.rows).filter(|row| reading(row)).count();
    let (mut number, mut readings) = (0, 0);
    let mut text = String::new();
    for section in article.displayed(checked.equation) {
        let lefts = section.rows.iter().map(|row| (markup.measure)(&spelling.left(&row.left)));
        let taken = lefts.max().unwrap_or(0) + RELATION + if style.numbering == Numbering::None { 0 } else { NUMBER };
        let numbered = |row: &EquationLine| {
            readings += usize::from(reading(row));
            let last = reading(row) && readings == count;
            let label = match style.numbering {
                Numbering::None => None,
                _ if last => Some(label.clone()),
                Numbering::Last => None,
                Numbering::All => {
                    number += 1;
                    Some(format!("{label}-{number}"))
                }
            };
            (line(row, spelling, markup, width.saturating_sub(taken)), label)
        };
        let rows: Vec<(String, Option<String>)> = section.rows.iter().map(numbered).collect();
        let heading = (markup.escape)(&capital(&section.heading));
        text.push_str(&format!("{heading}:\n{}", (markup.display)(&rows)));
    }
    text
}

/// All symbols: names, meaning, unit.
fn symbols<N: Notation>(
    article: &Article,
    spelling: &Spelling<'_, N>,
    markup: &Markup,
) -> Vec<(String, String, &'static str)> {
    let inputs = article
        .symbols
        .iter()
        .map(|(symbol, meaning, unit)| (spelling.names(symbol, markup.names), meaning.clone(), *unit));
    inputs.chain(article.quantities(spelling)).collect()
}

/// The table of all symbols.
fn nomenclature(rows: Vec<(String, String, &str)>, markup: &Markup, width: usize) -> String {
    let [before, between, after] = markup.cells;
    let widest = rows.iter().map(|(names, ..)| (markup.measure)(names)).max().unwrap_or(0);
    let meanings = width.saturating_sub(widest + UNIT_COLUMN).max(8000) / 100;
    // Rows of a table that fit a column of a page: a meaning takes as many lines as its width needs.
    let lines = |meaning: &str| 1 + meaning.chars().count() * 5 / meanings;
    let mut height = 0;
    let tables = rows.chunk_by(|_, (_, meaning, _)| {
        height += lines(meaning);
        if height > LINES {
            height = 0;
        }
        height > 0
    });
    let tables = tables.map(|rows| {
        let rows = rows.iter().map(|(names, meaning, unit)| {
            let (meaning, unit) = ((markup.escape)(meaning), (markup.escape)(unit));
            format!("{before}${names}${between}{meaning}{between}{unit}{after}")
        });
        let [opening, end] = (markup.table)(meanings);
        format!("{opening}{}{end}", rows.collect::<String>())
    });
    tables.collect::<Vec<_>>().join("\n")
}

/// One equation, aligned at its relation, in lines of the available width.
fn line<N: Notation>(row: &EquationLine, spelling: &Spelling<'_, N>, markup: &Markup, width: usize) -> String {
    let left = spelling.left(&row.left);
    let relation = if row.approximate { markup.approximately } else { "=" };
    let narrow = width.saturating_sub(markup.indentation);
    let mut lines = dialect::lines(&terms_of(&row.right), spelling, [width, narrow], markup.measure);
    let remark = match &row.remark {
        None => String::new(),
        Some(NoteKind::NotObservable) => markup.remark.join("(not observable)"),
        Some(NoteKind::MultipleOf(other)) => {
            let other = spelling.variable(other);
            markup.remark.join(&format!("(multiple of ${other}$)"))
        }
    };
    if let Some(last) = lines.last_mut() {
        if !remark.is_empty() && (markup.measure)(last) + (markup.measure)(&remark) > narrow {
            lines.push(remark);
        } else {
            last.push_str(&remark);
        }
    }
    format!("  {left} &{relation} {}", lines.join(markup.line_break))
}

/// The text with a capital first letter.
fn capital(text: &str) -> String {
    let mut characters = text.chars();
    match characters.next() {
        Some(first) => first.to_uppercase().chain(characters).collect(),
        None => String::new(),
    }
}
