//! Figures as data: what a chart shows, with its title, caption and units. Nothing here draws.
//!
//! One file per kind of chart ([`lines`], [`bars`], [`matrix`], [`polar`], [`chain`]) holds the data of the kind, its
//! table and its drawing. Printers: [`svg`] draws a figure inside the report or as a file; `png` (feature `png`) draws
//! that file as pixels; [`Figure::table`] gives the data as one tidy table, which [`super::csv`] writes. A further kind
//! is one file and one variant of [`Chart`].

pub mod bars;
pub mod chain;
pub mod lines;
pub mod matrix;
#[cfg(feature = "png")]
pub mod png;
pub mod polar;
pub mod scale;
pub mod svg;

use super::number;
use super::table::Table;

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

/// The kinds of charts.
#[derive(Clone, Debug)]
pub enum Chart {
    /// Series over two straight axes.
    Lines(lines::Lines),
    /// Values with error bars, one row per name.
    Values(bars::Values),
    /// Bars from zero, one row per name.
    Bars(bars::Bars),
    /// A symmetric matrix, such as a correlation.
    Matrix(matrix::Matrix),
    /// Deviations about a nominal circle.
    Polar(polar::Polar),
    /// Several deviations about nominal circles at one scale.
    Panels(polar::Panels),
    /// The kinematic chain of a machine.
    Chain(chain::Chain),
}

/// What a kind of chart provides.
trait Kind {
    /// The drawing.
    fn drawing(&self) -> svg::Drawing;
    /// The data in full precision: one row per mark, the unit of a column in its heading.
    fn table(&self) -> Table;
}

impl Figure {
    /// A figure. Its file name is derived from `name`.
    pub fn new(name: impl AsRef<str>, title: impl Into<String>, caption: impl Into<String>, chart: Chart) -> Figure {
        Figure { name: file_name(name.as_ref()), title: title.into(), caption: caption.into(), chart }
    }

    fn kind(&self) -> &dyn Kind {
        match &self.chart {
            Chart::Lines(kind) => kind,
            Chart::Values(kind) => kind,
            Chart::Bars(kind) => kind,
            Chart::Matrix(kind) => kind,
            Chart::Polar(kind) => kind,
            Chart::Panels(kind) => kind,
            Chart::Chain(kind) => kind,
        }
    }

    /// The data as one tidy table, in full precision.
    pub fn table(&self) -> Table {
        self.kind().table()
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
