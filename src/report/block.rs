//! A report: what one result says, as blocks that every printer prints.
//!
//! A result makes its report once. A block has a level: the terminal prints brief and key blocks, or with `--all` key
//! blocks and details; a page prints all but the brief ones. A further kind of block is a variant of [`Body`] here and
//! its arm in each of `src/printers/`.

use std::borrow::Cow;

use serde_json::Value;

use super::figure::Figure;
use super::table::Table;

/// A report.
#[derive(Default)]
pub struct Report {
    /// Title.
    pub title: String,
    /// The blocks, in order.
    pub blocks: Vec<Block>,
    /// Warnings. Commands write them to standard error, pages show them below the key figures.
    pub warnings: Vec<String>,
    /// Method, in sentences.
    pub method: String,
    /// Data of the interactive figures of a page. Null if there is none.
    pub data: Value,
    /// All readings, for a download as CSV; no rows if there is none.
    pub readings: Table,
    /// Every value with all its digits, one row each, for `--csv`; no rows if the tables of the report have them.
    pub values: Table,
}

/// A part of a report.
#[derive(Clone, Debug)]
pub struct Block {
    /// Where it is printed.
    pub level: Level,
    /// What it is.
    pub body: Body,
}

/// Where a block is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// In place of details: on a terminal without `--all`.
    Brief,
    /// Everywhere.
    Key,
    /// On a page, and on a terminal with `--all`.
    Detail,
    /// With figures: on a page.
    Page,
}

/// The kinds of blocks.
#[derive(Clone, Debug)]
pub enum Body {
    /// Figures of the summary.
    KeyFigures(Vec<KeyFigure>),
    /// Words.
    Text(Text),
    /// A table.
    Table(Table),
    /// A figure.
    Figure(Figure),
    /// A displayed formula.
    Formula(Formula),
}

/// A figure of the summary.
#[derive(Clone, Debug)]
pub struct KeyFigure {
    /// What the figure is.
    pub label: &'static str,
    /// The figure with its unit.
    pub value: String,
    /// What the figure is compared with, in at most eight words with the label.
    pub note: String,
}

/// A part of what opens a report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Sentence {
    /// A sentence.
    Words(String),
    /// A command, and what it is for.
    Command(String, String),
}

impl From<String> for Sentence {
    fn from(words: String) -> Sentence {
        Sentence::Words(words)
    }
}

/// Words by their role. Backquotes mark code, `[@key]` or `[@key;@key]` cites.
#[derive(Clone, Debug)]
pub enum Text {
    /// What the result says, in a few sentences; its verdict in one word.
    Opening {
        /// `explained`, `holds`; empty if the result has none.
        word: String,
        /// One sentence each, or a command.
        sentences: Vec<Sentence>,
    },
    /// Heading of a section.
    Section(String),
    /// Heading within a section.
    Heading(String),
    /// As a heading, of blocks that a page folds until the next heading.
    Fold(String),
    /// A paragraph.
    Paragraph(String),
    /// Sentences.
    List(Vec<String>),
    /// What to do next: what to type or to do, and what it is for.
    Steps(Vec<(String, String)>),
    /// A remark in small print.
    Note(String),
    /// The switches and sliders of the interactive figures of a page.
    Controls,
}

/// A formula in the languages of the printers.
#[derive(Clone, Debug)]
pub struct Formula {
    /// LaTeX.
    pub latex: Cow<'static, str>,
    /// Typst.
    pub typst: Cow<'static, str>,
    /// Plain text.
    pub text: Cow<'static, str>,
    /// Whether these are displayed equations with headings and words of their own, not one formula.
    pub displayed: bool,
}

impl Formula {
    /// A formula from LaTeX, Typst and plain text.
    pub fn new(latex: &'static str, typst: &'static str, text: &'static str) -> Formula {
        let [latex, typst, text] = [latex, typst, text].map(Cow::Borrowed);
        Formula { latex, typst, text, displayed: false }
    }
}

impl KeyFigure {
    /// A key figure.
    pub fn new(label: &'static str, value: impl Into<String>, note: impl Into<String>) -> KeyFigure {
        KeyFigure { label, value: value.into(), note: note.into() }
    }
}

impl From<Text> for Body {
    fn from(text: Text) -> Body {
        Body::Text(text)
    }
}

impl From<Table> for Body {
    fn from(table: Table) -> Body {
        Body::Table(table)
    }
}

impl From<Vec<KeyFigure>> for Body {
    fn from(figures: Vec<KeyFigure>) -> Body {
        Body::KeyFigures(figures)
    }
}

impl From<Formula> for Body {
    fn from(formula: Formula) -> Body {
        Body::Formula(formula)
    }
}

/// A paragraph.
impl From<String> for Body {
    fn from(text: String) -> Body {
        Body::Text(Text::Paragraph(text))
    }
}

/// A paragraph.
impl From<&str> for Body {
    fn from(text: &str) -> Body {
        text.to_string().into()
    }
}

impl Report {
    /// An empty report.
    pub fn new(title: impl Into<String>) -> Report {
        Report { title: title.into(), ..Report::default() }
    }

    /// Adds a block of a level. Tables, lists and steps without a row are left out.
    pub fn push(&mut self, level: Level, body: impl Into<Body>) {
        let body = body.into();
        let empty = match &body {
            Body::Table(table) => table.rows.is_empty(),
            Body::Text(Text::List(lines)) => lines.is_empty(),
            Body::Text(Text::Steps(steps)) => steps.is_empty(),
            Body::KeyFigures(figures) => figures.is_empty(),
            _ => false,
        };
        if !empty {
            self.blocks.push(Block { level, body });
        }
    }

    /// Adds a block that stands for details on a terminal.
    pub fn brief(&mut self, body: impl Into<Body>) {
        self.push(Level::Brief, body);
    }

    /// Adds a block that is printed everywhere.
    pub fn key(&mut self, body: impl Into<Body>) {
        self.push(Level::Key, body);
    }

    /// Adds a detail.
    pub fn detail(&mut self, body: impl Into<Body>) {
        self.push(Level::Detail, body);
    }

    /// Adds a block that belongs to figures.
    pub fn page(&mut self, body: impl Into<Body>) {
        self.push(Level::Page, body);
    }

    /// Adds the sentences that open a report, and the verdict in one word.
    pub fn opening(&mut self, word: impl Into<String>, sentences: impl IntoIterator<Item = impl Into<Sentence>>) {
        self.key(Text::Opening { word: word.into(), sentences: sentences.into_iter().map(Into::into).collect() });
    }

    /// Adds what to do next. The last step leads to what a page or `--all` shows, and is left out there.
    pub fn steps(&mut self, steps: Vec<(String, String)>, more: (String, &str)) {
        let with_more = steps.iter().cloned().chain([(more.0, more.1.to_string())]).collect();
        self.brief(Text::Steps(with_more));
        self.detail(Text::Steps(steps));
    }

    /// Begins a section.
    pub fn section(&mut self, heading: &str) {
        self.key(Text::Section(heading.to_string()));
    }

    /// Adds a heading and the blocks below it, if there are any.
    pub fn headed(&mut self, level: Level, heading: impl Into<String>, body: impl Into<Body>) {
        let before = self.blocks.len();
        self.push(level, Text::Heading(heading.into()));
        self.push(level, body);
        if self.blocks.len() == before + 1 {
            self.blocks.truncate(before);
        }
    }

    /// Adds a detail that a page folds.
    pub fn folded(&mut self, heading: impl Into<String>, body: impl Into<Body>) {
        let before = self.blocks.len();
        self.detail(Text::Fold(heading.into()));
        self.detail(body);
        if self.blocks.len() == before + 1 {
            self.blocks.truncate(before);
        }
    }

    /// Adds figures, each under a name of its own. Names differ by more than case, because many file systems ignore
    /// case.
    pub fn figures(&mut self, figures: impl IntoIterator<Item = Figure>) {
        for mut figure in figures {
            let wanted = figure.name.clone();
            let mut number = 2;
            while self.drawn().any(|other| other.name.eq_ignore_ascii_case(&figure.name)) {
                figure.name = format!("{wanted}-{number}");
                number += 1;
            }
            self.push(Level::Page, Body::Figure(figure));
        }
    }

    /// The figures of the report.
    pub fn drawn(&self) -> impl Iterator<Item = &Figure> {
        self.blocks.iter().filter_map(|block| match &block.body {
            Body::Figure(figure) => Some(figure),
            _ => None,
        })
    }

    /// The tables of the report.
    pub fn tables(&self) -> impl Iterator<Item = &Table> {
        self.blocks.iter().filter_map(|block| match &block.body {
            Body::Table(table) => Some(table),
            _ => None,
        })
    }
}

/// The sources that texts cite, as BibTeX.
pub const BIBLIOGRAPHY: &str = include_str!("paper/refs.bib");

/// A text as pieces: words, and the keys of the citations after them. Only sources of the bibliography are cited: a name
/// from a user's file that looks like a citation is a name.
pub fn pieces(text: &str) -> Vec<(&str, Vec<&str>)> {
    let mut pieces = Vec::new();
    let (mut start, mut from) = (0, 0);
    while let Some(at) = text[from..].find("[@").map(|offset| from + offset) {
        let inside = at + "[@".len();
        let Some(length) = text[inside..].find(']') else { break };
        let keys: Vec<&str> =
            text[inside..inside + length].split(';').map(|key| key.trim().trim_start_matches('@')).collect();
        from = inside;
        if keys.iter().all(|key| is_source(key)) {
            pieces.push((&text[start..at], keys));
            from = inside + length + "]".len();
            start = from;
        }
    }
    pieces.push((&text[start..], Vec::new()));
    pieces
}

/// Whether the bibliography has an entry of this key.
fn is_source(key: &str) -> bool {
    let entries = BIBLIOGRAPHY.lines().filter(|line| line.starts_with('@'));
    entries.filter_map(|line| line.split_once('{')).any(|(_, named)| named.trim_end_matches(',') == key)
}

/// A text without its citations.
pub fn uncited(text: &str) -> String {
    pieces(text).into_iter().map(|(words, keys)| if keys.is_empty() { words } else { words.trim_end() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::table::cells;

    #[test]
    fn citations_are_separated_from_words() {
        let found = pieces("Rank [@jcgm100;@iso230] and x [@khalil1991].");
        assert_eq!(found, [("Rank ", vec!["jcgm100", "iso230"]), (" and x ", vec!["khalil1991"]), (".", vec![])]);
        assert_eq!(uncited("Rank [@jcgm100;@iso230] and x [@khalil1991]."), "Rank and x.");
        // Names from files are no citations.
        for words in
            ["no [citation]", "A[@1]", "H [@x}\\input{/etc/passwd}\\cite{y]", "[@jcgm100;@x>)#read(\"f\")]", "[@", ""]
        {
            assert_eq!(pieces(words), [(words, vec![])]);
        }
        assert_eq!(uncited("test A[@1] [@jcgm100]"), "test A[@1]");
    }

    #[test]
    fn what_has_no_rows_is_left_out() {
        let mut report = Report::new("");
        report.headed(Level::Key, "Outliers", Table::default());
        report.key(Text::List(Vec::new()));
        assert!(report.blocks.is_empty());
        report.headed(Level::Key, "Outliers", Table::new(["test"], [cells!["A"]]));
        assert_eq!(report.blocks.len(), 2);
    }
}
