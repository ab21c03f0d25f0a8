//! Contents of a report: title, summary, sections and figures.

use maud::{Markup, html};
use serde_json::Value;

use crate::report::figure::{Figure, file_name, svg};
use crate::report::table::Table;

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
    pub key_figures: Vec<KeyFigure>,
    /// Warnings, shown below the key figures.
    pub warnings: Vec<String>,
    /// Method, in sentences.
    pub method: String,
    /// Sections in order: anchor, heading, contents.
    pub sections: Vec<(String, String, Markup)>,
    /// All figures of the sections.
    pub figures: Vec<Figure>,
    /// Data of the interactive figures. Null if the page has none.
    pub data: Value,
    /// All readings, for a download as CSV; no rows if the page has none.
    pub readings: Table,
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
        let anchor = file_name(&heading.to_lowercase());
        self.sections.push((anchor, heading.to_string(), contents));
    }

    /// Adds figures to the document and draws them. Drawings of one width stand in columns; drawings of several widths
    /// share rows.
    pub fn show(&mut self, figures: impl IntoIterator<Item = Figure>) -> Markup {
        let drawn = self.draw(figures);
        let width = drawn.first().map_or(0.0, |(width, _)| *width);
        let is_mixed = drawn.iter().any(|(other, _)| *other != width);
        let layout = if is_mixed { "figures row" } else { "figures columns" };
        html! {
            @if !drawn.is_empty() {
                div class=(layout) style=(format!("--width:{width}")) { @for (_, figure) in &drawn { (figure) } }
            }
        }
    }

    /// Adds figures to the document and draws them in two groups, one beside the other on a wide page.
    pub fn show_beside(
        &mut self,
        left: impl IntoIterator<Item = Figure>,
        right: impl IntoIterator<Item = Figure>,
    ) -> Markup {
        let [left, right] = [self.draw(left), self.draw(right)];
        html! {
            div class="beside" {
                div class="figures row" { @for (_, figure) in &left { (figure) } }
                div class="figures stack" { @for (_, figure) in &right { (figure) } }
            }
        }
    }

    /// Adds figures under unique names and draws each: its width and its element.
    fn draw(&mut self, figures: impl IntoIterator<Item = Figure>) -> Vec<(f64, Markup)> {
        let add = |mut figure: Figure| {
            let wanted = figure.name.clone();
            let mut number = 2;
            // Names differ by more than case, because many file systems ignore case.
            while self.figures.iter().any(|other| other.name.eq_ignore_ascii_case(&figure.name)) {
                figure.name = format!("{wanted}-{number}");
                number += 1;
            }
            let drawn = svg::element(&figure);
            self.figures.push(figure);
            drawn
        };
        figures.into_iter().map(add).collect()
    }
}
