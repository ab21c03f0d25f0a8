//! A report while it grows: sections in order, and every plot that is in one of them.

use maud::{Markup, html};
use serde_json::Value;

use super::plot::Plot;

/// A report.
#[derive(Default)]
pub struct Document {
    /// What it is about.
    pub title: String,
    /// The outcome in one word, where there is one.
    pub word: String,
    /// The outcome in a sentence.
    pub verdict: String,
    /// Sections: anchor, heading, contents.
    pub sections: Vec<(String, String, Markup)>,
    /// The plots that are in them.
    pub plots: Vec<Plot>,
    /// What the page moves; null for a page that stands still.
    pub data: Value,
    /// All readings, as CSV.
    pub table: String,
}

impl Document {
    /// Adds a section.
    pub fn section(&mut self, heading: &str, contents: Markup) {
        let anchor = super::plot::file_name(&heading.to_lowercase());
        self.sections.push((anchor, heading.to_string(), contents));
    }

    /// Takes plots up and lays them beside one another.
    pub fn show(&mut self, plots: impl IntoIterator<Item = Plot>) -> Markup {
        let plots: Vec<Plot> = plots.into_iter().collect();
        let markup = html! {
            div class="figures" { @for plot in &plots { (plot.figure()) } }
        };
        for plot in plots {
            self.take(plot);
        }
        markup
    }

    /// Takes a plot up under a name that no other has.
    fn take(&mut self, mut plot: Plot) {
        let wanted = plot.name.clone();
        let mut number = 2;
        // File systems that do not tell A from a are the commonest.
        while self
            .plots
            .iter()
            .any(|other| other.name.eq_ignore_ascii_case(&plot.name))
        {
            plot.name = format!("{wanted}-{number}");
            number += 1;
        }
        self.plots.push(plot);
    }
}

/// A table: header, rows; columns of words to the left, of numbers to the right.
pub fn table(header: &[&str], rows: &[Vec<String>]) -> Markup {
    let is_word = |cell: &String| cell.starts_with(char::is_alphabetic);
    let class: Vec<Option<&str>> = (0..header.len())
        .map(|column| {
            let words = rows.iter().any(|row| row.get(column).is_some_and(is_word));
            words.then_some("word-column")
        })
        .collect();
    html! {
        div class="scroll" {
            table {
                thead { tr { @for (cell, class) in header.iter().zip(&class) { th class=[*class] { (cell) } } } }
                tbody { @for row in rows { tr { @for (cell, class) in row.iter().zip(&class) { td class=[*class] { (cell) } } } } }
            }
        }
    }
}

/// Words in which what stands between backquotes is to be typed.
pub fn prose(text: &str) -> Markup {
    html! {
        @for (number, part) in text.split('`').enumerate() {
            @if number % 2 == 1 { code { (part) } } @else { (part) }
        }
    }
}

/// Sentences, one a line.
pub fn list(items: impl IntoIterator<Item = String>) -> Markup {
    html! { ul { @for item in items { li { (prose(&item)) } } } }
}
