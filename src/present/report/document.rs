//! Contents of a report: title, summary, sections and plots.

use maud::{Markup, html};
use serde_json::Value;

use crate::present::figure::{Plot, file_name};
use crate::present::table::Table;

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
    /// Method, in sentences.
    pub method: String,
    /// Sections in order: anchor, heading, contents.
    pub sections: Vec<(String, String, Markup)>,
    /// All plots of the sections.
    pub plots: Vec<Plot>,
    /// Data of the interactive plots. Null if the page has none.
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
