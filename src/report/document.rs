//! Contents of a report: title, summary, sections and plots.

use maud::{Markup, html};
use serde_json::Value;

use super::plot::Plot;

/// A word column with a longer cell than this wraps.
const MAX_UNWRAPPED: usize = 26;

/// The contents of a report, independent of the page around it.
#[derive(Default)]
pub struct Document {
    /// Title.
    pub title: String,
    /// Verdict in one word. Empty if the command has none.
    pub word: String,
    /// Verdict in one or two sentences.
    pub verdict: String,
    /// Key figures of the summary.
    pub figures: Vec<KeyFigure>,
    /// Warnings, shown below the key figures.
    pub warnings: Vec<String>,
    /// Sections in order: anchor, heading, contents.
    pub sections: Vec<(String, String, Markup)>,
    /// All plots of the sections.
    pub plots: Vec<Plot>,
    /// Data of the interactive plots. Null if the page has none.
    pub data: Value,
    /// All readings as CSV.
    pub csv: String,
}

/// A key figure of the summary.
pub struct KeyFigure {
    /// What the figure is.
    pub label: &'static str,
    /// The figure with its unit.
    pub value: String,
    /// What the figure is compared with.
    pub note: String,
}

impl KeyFigure {
    /// A key figure.
    pub fn new(label: &'static str, value: impl Into<String>, note: impl Into<String>) -> KeyFigure {
        KeyFigure { label, value: value.into(), note: note.into() }
    }
}

impl Document {
    /// Adds a section.
    pub fn section(&mut self, heading: &str, contents: Markup) {
        let anchor = super::plot::file_name(&heading.to_lowercase());
        self.sections.push((anchor, heading.to_string(), contents));
    }

    /// Adds plots to the document and returns their figures. Plots of one width stand in columns; plots of several
    /// widths share rows.
    pub fn show(&mut self, plots: impl IntoIterator<Item = Plot>) -> Markup {
        let plots: Vec<Plot> = plots.into_iter().collect();
        let widths: Vec<f64> = plots.iter().map(|plot| plot.size[0]).collect();
        let is_mixed = widths.windows(2).any(|pair| pair[0] != pair[1]);
        let layout = if is_mixed { "figures row" } else { "figures columns" };
        let width = widths.first().copied().unwrap_or_default();
        let markup = html! {
            @if !plots.is_empty() {
                div class=(layout) style=(format!("--width:{width}")) { @for plot in &plots { (plot.figure()) } }
            }
        };
        for plot in plots {
            self.add(plot);
        }
        markup
    }

    /// Adds plots to the document and returns their figures in two groups, one beside the other on a wide page.
    pub fn show_beside(
        &mut self,
        left: impl IntoIterator<Item = Plot>,
        right: impl IntoIterator<Item = Plot>,
    ) -> Markup {
        let [left, right] = [left.into_iter().collect(), right.into_iter().collect::<Vec<Plot>>()];
        let markup = html! {
            div class="beside" {
                div class="figures row" { @for plot in &left { (plot.figure()) } }
                div class="figures stack" { @for plot in &right { (plot.figure()) } }
            }
        };
        left.into_iter().chain(right).for_each(|plot| self.add(plot));
        markup
    }

    /// Adds a plot under a unique name.
    fn add(&mut self, mut plot: Plot) {
        let wanted = plot.name.clone();
        let mut number = 2;
        // Names differ by more than case, because many file systems ignore case.
        while self.plots.iter().any(|other| other.name.eq_ignore_ascii_case(&plot.name)) {
            plot.name = format!("{wanted}-{number}");
            number += 1;
        }
        self.plots.push(plot);
    }
}

/// A table. Columns of words are aligned to the left, columns of numbers to the right.
pub fn table(header: &[&str], rows: &[Vec<String>]) -> Markup {
    let class: Vec<Option<&str>> = (0..header.len()).map(|column| column_class(rows, column)).collect();
    html! {
        div class="scroll" {
            table {
                thead { tr { @for (cell, class) in header.iter().zip(&class) { th class=[*class] { (cell) } } } }
                tbody { @for row in rows { tr { @for (cell, class) in row.iter().zip(&class) { td class=[*class] { (cell) } } } } }
            }
        }
    }
}

/// CSS class of a column: that of words if more cells start with a letter than with anything else.
fn column_class(rows: &[Vec<String>], column: usize) -> Option<&'static str> {
    let cells = || rows.iter().filter_map(|row| row.get(column)).filter(|cell| !cell.is_empty());
    let words = cells().filter(|cell| cell.starts_with(char::is_alphabetic)).count();
    let is_long = cells().any(|cell| cell.chars().count() > MAX_UNWRAPPED && cell.contains(' '));
    match (2 * words > cells().count(), is_long) {
        (true, true) => Some("word-column long"),
        (true, false) => Some("word-column"),
        (false, _) => None,
    }
}

/// Text in which backquotes mark code.
pub fn prose(text: &str) -> Markup {
    html! {
        @for (number, part) in text.split('`').enumerate() {
            @if number % 2 == 1 { code { (part) } } @else { (part) }
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

/// Text with a capital first letter.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
