//! Reports as HTML. All text passes through templates that escape markup.

use abbe::model::words::counted;
use maud::{Markup, PreEscaped, html};

use crate::report::block::{Body, Level, Report, Sentence, Text, uncited};
use crate::report::figure::{Figure, file_name, svg};
use crate::report::number::{capitalised, with_minus_signs};
use crate::report::table::{Align, Table};

/// A word column with a longer cell than this wraps.
const MAX_UNWRAPPED: usize = 26;
/// Longer tables are folded.
const MAX_UNFOLDED: usize = 40;
/// Longer lists are folded.
const MAX_LISTED: usize = 12;

/// The head of a page that stands alone: its policy, title and style.
pub fn head(policy: &str, title: &str, style: &str) -> Markup {
    html! {
        head {
            meta charset="utf-8";
            meta http-equiv="Content-Security-Policy" content=(policy);
            meta name="viewport" content="width=device-width, initial-scale=1";
            meta name="generator" content=(concat!("abbe ", env!("CARGO_PKG_VERSION")));
            link rel="icon" href="data:,";
            title { (title) }
            style { (PreEscaped(style)) }
        }
    }
}

/// The table under its title. Columns of words are aligned to the left, columns of numbers to the right.
pub fn table(table: &Table) -> Markup {
    let class: Vec<Option<&str>> = (0..table.columns.len()).map(|column| column_class(table, column)).collect();
    let headed = table.columns.iter().any(|column| !column.heading.is_empty());
    html! {
        @if !table.title.is_empty() { p { (table.title) "." } }
        // On a small screen the arrow keys scroll it.
        div class="scroll" tabindex="0" {
            table class=[(!headed).then_some("pairs")] {
                @if headed {
                    thead {
                        // A header cell without words would be read aloud as nothing before each cell below it.
                        tr {
                            @for (column, class) in table.columns.iter().zip(&class) {
                                @if column.heading.is_empty() { td class=[*class] {} } @else { th class=[*class] { (column.heading) } }
                            }
                        }
                    }
                }
                tbody {
                    @for row in &table.rows {
                        tr { @for (cell, class) in row.iter().zip(&class) { td class=[*class] { (with_minus_signs(&cell.to_string())) } } }
                    }
                }
            }
        }
        @for note in &table.notes { p class="note" { (prose(note)) } }
    }
}

/// CSS class of a column.
fn column_class(table: &Table, column: usize) -> Option<&'static str> {
    let cells = || table.rows.iter().filter_map(|row| row.get(column)).map(ToString::to_string);
    let is_long = cells().any(|cell| cell.chars().count() > MAX_UNWRAPPED && cell.contains(' '));
    match (table.columns[column].align, is_long) {
        (Align::Left, true) => Some("word-column long"),
        (Align::Left, false) => Some("word-column"),
        (Align::Right, _) => None,
    }
}

/// Text in which backquotes mark code.
pub fn prose(text: &str) -> Markup {
    html! {
        @for (number, part) in text.split('`').enumerate() {
            @if number % 2 == 1 { code { (part) } } @else { (with_minus_signs(part)) }
        }
    }
}

/// A list of sentences.
pub fn list(items: impl IntoIterator<Item = String>) -> Markup {
    html! { ul { @for item in items { li { (prose(&item)) } } } }
}

/// Contents that the reader unfolds.
pub fn folded(summary: &str, contents: &Markup) -> Markup {
    html! { details { summary { (summary) } (contents) } }
}

/// The sections of a report with the blocks of some levels: anchor, heading, contents. What comes before the first
/// section has neither anchor nor heading.
pub fn sections(report: &Report, levels: &[Level]) -> Vec<(String, String, Markup)> {
    let mut sections = Vec::new();
    let (mut heading, mut contents) = (String::new(), Contents::default());
    for block in report.blocks.iter().filter(|block| levels.contains(&block.level)) {
        match &block.body {
            Body::Text(Text::Section(next)) => {
                sections.push((std::mem::replace(&mut heading, next.clone()), std::mem::take(&mut contents)));
            }
            Body::Text(Text::Heading(next)) => contents.head(next, false),
            Body::Text(Text::Fold(next)) => contents.head(next, true),
            Body::Figure(figure) => match contents.parts.last_mut() {
                Some(Part::Figures(figures)) => figures.push(figure),
                _ => contents.parts.push(Part::Figures(vec![figure])),
            },
            other => match (contents.parts.last_mut(), element(other)) {
                (Some(Part::Words(words)), one) => words.push(one),
                (_, one) => contents.parts.push(Part::Words(vec![one])),
            },
        }
    }
    sections.push((heading, contents));
    let printed = sections.into_iter().map(|(heading, contents)| {
        let anchor = file_name(&heading.to_lowercase());
        (anchor, heading, contents.end())
    });
    printed.filter(|(_, heading, contents)| heading.is_empty() || !contents.0.is_empty()).collect()
}

/// Words or figures that follow one another.
enum Part<'r> {
    Words(Vec<Markup>),
    Figures(Vec<&'r Figure>),
}

/// The contents of a section while it is made.
#[derive(Default)]
struct Contents<'r> {
    /// What lies before the last heading.
    done: Vec<Markup>,
    /// The last heading, and whether what is below it is folded.
    heading: Option<(String, bool)>,
    /// What lies below it.
    parts: Vec<Part<'r>>,
}

impl Contents<'_> {
    /// Begins a part below a heading.
    fn head(&mut self, heading: &str, folded: bool) {
        self.close();
        self.heading = Some((heading.to_string(), folded));
    }

    fn close(&mut self) {
        let parts = std::mem::take(&mut self.parts);
        let beside = parts.len() > 1 && parts.iter().any(|part| matches!(part, Part::Figures(_)));
        let printed = html! {
            @for part in &parts {
                @match part {
                    Part::Figures(drawn) => (figures(drawn)),
                    Part::Words(words) if beside => div class="words" { @for one in words { (one) } },
                    Part::Words(words) => @for one in words { (one) },
                }
            }
        };
        let printed = if beside {
            html! { div class="halves" { (printed) } }
        } else {
            printed
        };
        self.done.push(match self.heading.take() {
            Some((heading, true)) => folded(&heading, &printed),
            Some((heading, false)) => html! { h3 { (heading) } (printed) },
            None => printed,
        });
    }

    fn end(mut self) -> Markup {
        self.close();
        html! { @for part in &self.done { (part) } }
    }
}

/// Figures beside one another. Drawings of one width stand in columns; drawings of several widths share rows.
fn figures(drawn: &[&Figure]) -> Markup {
    let drawn: Vec<(f64, Markup)> = drawn.iter().map(|figure| svg::element(figure)).collect();
    let width = drawn.first().map_or(0.0, |(width, _)| *width);
    let layout = if drawn.iter().any(|(other, _)| *other != width) { "figures row" } else { "figures columns" };
    html! {
        div class=(layout) style=(format!("--width:{width}")) { @for (_, figure) in &drawn { (figure) } }
    }
}

/// A block other than a heading and a figure.
fn element(body: &Body) -> Markup {
    match body {
        Body::KeyFigures(figures) => html! {
            dl class="key-figures" {
                @for figure in figures {
                    div { dt { (figure.label) } dd { (with_minus_signs(&figure.value)) } dd class="note" { (figure.note) } }
                }
            }
        },
        Body::Table(found) if found.rows.len() > MAX_UNFOLDED => {
            let title = if found.title.is_empty() { counted(found.rows.len(), "row") } else { found.title.clone() };
            folded(&title, &table(&Table { title: String::new(), ..found.clone() }))
        }
        Body::Table(found) => table(found),
        Body::Formula(formula) => html! { p class="formula" { (formula.text) } },
        Body::Figure(figure) => svg::element(figure).1,
        Body::Text(text) => words(text),
    }
}

fn words(text: &Text) -> Markup {
    match text {
        Text::Opening { word, sentences } => html! {
            @for (number, sentence) in sentences.iter().enumerate() {
                p class="verdict" {
                    @if number == 0 && !word.is_empty() { strong class=(format!("word {}", file_name(word))) { (word) } " " }
                    @match sentence {
                        Sentence::Command(command, purpose) => { code { (command) } " " (purpose) }
                        Sentence::Words(words) => { (prose(&uncited(words))) }
                    }
                }
            }
        },
        Text::Section(heading) => html! { h2 { (heading) } },
        Text::Heading(heading) | Text::Fold(heading) => html! { h3 { (heading) } },
        Text::Paragraph(paragraph) => html! { p { (prose(&uncited(paragraph))) } },
        Text::List(lines) if lines.len() > MAX_LISTED => {
            folded(&counted(lines.len(), "entry"), &list(lines.iter().map(|line| capitalised(&uncited(line)))))
        }
        Text::List(lines) => list(lines.iter().map(|line| capitalised(&uncited(line)))),
        Text::Steps(steps) => html! {
            ul class="steps" {
                @for (step, purpose) in steps {
                    li { @if step.starts_with("abbe ") { code { (step) } } @else { (prose(step)) } ": " (prose(purpose)) }
                }
            }
        },
        Text::Note(note) => html! { p class="note" { (prose(&uncited(note))) } },
        Text::Controls => html! { div class="controls needs-script" id="controls" hidden {} },
    }
}

/// The key blocks of a report in a notebook, without a page around them.
pub fn notebook(report: &Report) -> String {
    let sections = sections(report, &[Level::Brief, Level::Key]);
    let contents = html! {
        h3 { (report.title) }
        @for (_, heading, contents) in &sections {
            @if !heading.is_empty() { h4 { (heading) } }
            (contents)
        }
    };
    contents.into_string()
}
