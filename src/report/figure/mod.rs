//! Figures: a chart with its title and caption, drawn as a list of elements, and its data as one tidy table.
//!
//! One file for each kind of chart ([`lines`], [`bars`], [`bubbles`], [`matrix`], [`polar`], [`chain`], [`space`]) makes a
//! [`Chart`] of what it shows. Printers: [`svg`] prints the elements of a [`drawing`] inside the report or as a file; `png`
//! (feature `png`) draws that file as pixels; [`pdf`] prints them for LaTeX; [`crate::printers::csv`] writes the table. A
//! further kind is one file.

pub mod bars;
pub mod bubbles;
pub mod chain;
pub mod drawing;
pub mod lines;
pub mod matrix;
pub mod pdf;
#[cfg(feature = "png")]
pub mod png;
pub mod polar;
pub mod scale;
pub mod space;
pub mod svg;

use super::number;
use super::table::{Cell, Column, Table};
use drawing::{Drawing, Element};

/// Most words of a column that the figure in words names.
const MAX_LISTED: usize = 12;

/// A figure with its title and caption.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Name of the file, without extension.
    pub name: String,
    /// Title.
    pub title: String,
    /// Caption.
    pub caption: String,
    /// What it shows.
    pub chart: Chart,
}

/// What a figure shows.
#[derive(Clone, Debug)]
pub struct Chart {
    /// The kind of chart.
    pub kind: &'static str,
    /// The drawing.
    pub drawing: Drawing,
    /// The data in full precision: one row per mark, the unit of a column in its heading.
    pub table: Table,
}

impl Chart {
    /// A static chart of this size.
    fn new(kind: &'static str, size: [f64; 2], elements: Vec<Element>, table: Table) -> Chart {
        Chart { kind, drawing: Drawing { size, elements, interaction: None }, table }
    }

    /// With data for the script of the page.
    fn live(mut self, data: &serde_json::Value) -> Chart {
        self.drawing.interaction = Some(data.to_string());
        self
    }
}

impl Figure {
    /// A figure. Its file name is derived from `name`.
    pub fn new(
        name: impl AsRef<str>,
        title: impl Into<String>,
        caption: impl Into<String>,
        chart: impl Into<Chart>,
    ) -> Figure {
        Figure { name: file_name(name.as_ref()), title: title.into(), caption: caption.into(), chart: chart.into() }
    }

    /// The figure in words, for readers who cannot see it: its title, and what each column of its data spans.
    pub fn alternative(&self) -> String {
        let table = &self.chart.table;
        let spans = table.columns.iter().enumerate().map(|(column, Column { heading, .. })| {
            let numbers = table.rows.iter().filter_map(|row| match row.get(column) {
                Some(Cell::Number(value, _)) => Some(*value),
                _ => None,
            });
            let name = number::unit(&heading.replace('_', " "));
            match scale::span(numbers) {
                [low, high] if low <= high => {
                    format!("{name} {} to {}", number::three_digits(low), number::three_digits(high))
                }
                _ => {
                    let texts = table.rows.iter().filter_map(|row| row.get(column)).map(ToString::to_string);
                    let texts: Vec<String> = texts.filter(|text| !text.is_empty()).collect();
                    let distinct = number::units(texts.iter().map(String::as_str));
                    let more = if distinct.len() > MAX_LISTED { ", …" } else { "" };
                    format!("{name} {}{more}", distinct[..distinct.len().min(MAX_LISTED)].join(", "))
                }
            }
        });
        format!("{}: {}", self.title, spans.collect::<Vec<_>>().join("; "))
    }
}

/// What a number is, with its unit as in results: `residual` in `um`. Either may be empty.
#[derive(Clone, Debug)]
pub struct Quantity {
    /// Name, with a remark after a comma: `order, cycles per turn of C`.
    pub name: String,
    /// Unit: `um`, `deg`, `um per arcsec`.
    pub unit: String,
}

impl Quantity {
    /// A quantity.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Quantity {
        Quantity { name: name.into(), unit: unit.into() }
    }

    /// The label of an axis: `residual, µm`.
    pub fn label(&self) -> String {
        let parts = [self.name.clone(), number::unit(&self.unit)];
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
    }

    /// The heading of a column: `residual_um`. Letters, digits and underscores only, without the remark.
    pub fn heading(&self) -> String {
        let name = self.name.split(',').next().unwrap_or_default();
        let text = format!("{name} {}", self.unit);
        let words = text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
        let words = words.collect::<Vec<_>>().join("_");
        if words.is_empty() { "value".to_string() } else { words }
    }
}

/// A file name that is valid on every file system.
pub fn file_name(text: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() || "-_.+".contains(c) { c } else { '-' }
    };
    text.chars().map(plain).take(80).collect::<String>().trim_matches('.').to_string()
}

#[cfg(test)]
mod tests {
    use super::lines::{Axis, Lines, Mark, Series};
    use super::scale::Scale;
    use super::*;

    #[test]
    fn a_figure_has_a_table_with_units_and_words_that_span_it() {
        let scale = Scale::over([0.0, 1.0], 5);
        let axes =
            [Axis::new("C", "deg", scale), Axis::new("length of the residual, of \"all\"", "um per arcsec", scale)];
        assert_eq!(axes.each_ref().map(|axis| axis.quantity.label())[0], "C, °");
        assert_eq!(Quantity::new("", "").heading(), "value");
        let [x, y] = axes;
        let series = ["before", "after"]
            .map(|label| Series::new(label, "before", Mark::Stems(0.2), vec![(-90.0, 0.125), (45.0, -1.0 / 3.0)]));
        let figure = Figure::new("a/b", "Title", "", Lines::new(x, y, series.to_vec()));
        assert_eq!(figure.name, "a-b");
        let text = String::from_utf8(crate::printers::csv::text(&figure.chart.table).unwrap()).unwrap();
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows[0], "series,C_deg,length_of_the_residual_um_per_arcsec");
        assert_eq!(rows[1..3], ["before,-90,0.125", "before,45,-0.3333333333333333"]);
        assert_eq!(rows.len(), 5);
        let wanted = "Title: series before, after; C ° -90.0 to 45.0; length of the residual µm per ″ -0.333 to 0.125";
        assert_eq!(figure.alternative(), wanted);
    }
}
