//! The page of an article in a typesetting language: title, equations section by section, table of symbols, notes.

use crate::check::Checked;
use crate::print::article::Article;
use crate::print::article::line::{EquationLine, NoteKind};
use crate::print::dialect;
use crate::print::notation::{Notation, Spelling};
use crate::print::notes;
use crate::tree::terms_of;

/// The commands of a typesetting language around the expressions.
pub(crate) struct Markup {
    /// Visible characters per line.
    pub(crate) width: usize,
    /// The number of visible characters of a piece of an equation.
    pub(crate) visible: fn(&str) -> usize,
    /// Escapes the special characters of words.
    pub(crate) escape: fn(&str) -> String,
    /// Before each line of the title.
    pub(crate) comment: &'static str,
    /// Before the first section and after the last one.
    pub(crate) around_sections: [&'static str; 2],
    /// Before the heading of a section, after it, between the equations, and after them.
    pub(crate) section: [&'static str; 4],
    /// The sign of an approximation.
    pub(crate) approximately: &'static str,
    /// Between the lines of one equation.
    pub(crate) line_break: &'static str,
    /// Before and after a remark on an equation.
    pub(crate) remark: [&'static str; 2],
    /// Rows of a table that fit a page.
    pub(crate) rows: usize,
    /// Before and after the rows of a table of three columns.
    pub(crate) table: [&'static str; 2],
    /// Around the cells of a row: before the first, between two, after the last.
    pub(crate) cells: [&'static str; 3],
    /// Between two symbols in one cell.
    pub(crate) names: &'static str,
}

/// The page of an equation.
pub(crate) fn page(checked: &Checked<'_>, notation: &impl Notation, markup: &Markup) -> String {
    let equation = checked.equation;
    let article = Article::new(equation);
    let spelling =
        Spelling { notation, program: &article.program, symbols: equation.options.symbols, kind: equation.kind };
    let escape = markup.escape;
    let title = notes::title(equation).into_iter();
    let mut page: String = title.map(|line| format!("{}{line}\n", markup.comment)).collect();
    page.push_str(markup.around_sections[0]);
    for section in &article.sections {
        let [before, opening, between, end] = markup.section;
        let rows: Vec<String> = section.rows.iter().map(|row| line(row, &spelling, markup)).collect();
        let heading = escape(&capital(&section.heading));
        page.extend([before, &heading, opening, &rows.join(between), end]);
    }
    page.push_str(markup.around_sections[1]);
    let tables = article.symbols.chunks(markup.rows).map(|symbols| {
        let [before, between, after] = markup.cells;
        let rows = symbols.iter().map(|(symbol, meaning, unit)| {
            let (names, unit, meaning) = (spelling.names(symbol, markup.names), escape(unit), escape(meaning));
            format!("{before}${names}${between}{unit}{between}{meaning}{after}")
        });
        format!("{}{}{}", markup.table[0], rows.collect::<String>(), markup.table[1])
    });
    page.push_str(&tables.collect::<Vec<_>>().join("\n"));
    page.push('\n');
    for note in notes::notes_spelt(checked, &escape, &|of| format!("${}$", spelling.variable(of))) {
        page.extend([&note, "\n"]);
    }
    page
}

/// One equation, aligned at its relation.
fn line<N: Notation>(row: &EquationLine, spelling: &Spelling<'_, N>, markup: &Markup) -> String {
    let left = spelling.left(&row.left);
    let relation = if row.approximate { markup.approximately } else { "=" };
    let lines = dialect::lines(&terms_of(&row.right), spelling, markup.width, markup.visible);
    let remark = match &row.remark {
        None => String::new(),
        Some(NoteKind::NotObservable) => markup.remark.join("(not observable)"),
        Some(NoteKind::MultipleOf(other)) => {
            let other = spelling.variable(other);
            markup.remark.join(&format!("(multiple of ${other}$)"))
        }
    };
    format!("  {left} &{relation} {}{remark}", lines.join(markup.line_break))
}

/// The text with a capital first letter.
fn capital(text: &str) -> String {
    let mut characters = text.chars();
    match characters.next() {
        Some(first) => first.to_uppercase().chain(characters).collect(),
        None => String::new(),
    }
}
