//! Horizontal charts with one row per name: values with error bars, and bars.

use abbe::identify::results::MeasuredValue;
use maud::{Markup, html};

use super::scale::{Placed, Scale, coordinate, span, text};
use super::svg::{Drawing, WIDTH, legend, shortened};
use super::{Kind, Quantity};
use crate::report::table::{Cell, Table, cells, numbers, words};

/// Width of the names, SVG units.
const NAMES: f64 = 184.0;
/// Longest name, characters.
const MAX_NAME: usize = 23;
/// Height of a row, SVG units.
const ROW: f64 = 21.0;

/// A row with up to two values.
#[derive(Clone, Debug)]
pub struct Row {
    /// Name.
    pub name: String,
    /// First value.
    pub before: Option<MeasuredValue>,
    /// Second value.
    pub after: Option<MeasuredValue>,
}

/// Values with whiskers of ± 2 u.
#[derive(Clone, Debug)]
pub struct Values {
    /// What the values are.
    pub quantity: Quantity,
    /// Labels of the first and the second value of a row.
    pub labels: [String; 2],
    /// Rows, from the top.
    pub rows: Vec<Row>,
}

/// The scale of these values and zero, between the names and the right edge.
fn across(values: impl Iterator<Item = f64>) -> Placed {
    Scale::rounded(span(values.chain([0.0])), 6).between([NAMES, WIDTH - 18.0])
}

/// Draws the grid, the tick labels, the label of the scale below the rows, and the line at zero.
fn horizontal_scale(x: &Placed, bottom: f64, label: &str) -> Markup {
    html! {
        @for (at, tick) in x.ticks() {
            @let at = coordinate(at);
            path class="grid" d=(format!("M{at} 8V{bottom}")) {}
            text class="small soft middle" x=(at) y=(bottom + 15.0) { (tick) }
        }
        text class="middle" x=((x.coordinates[0] + x.coordinates[1]) / 2.0) y=(bottom + 32.0) { (label) }
        path class="nominal" d=(format!("M{} 8V{bottom}", coordinate(x.at(0.0)))) {}
    }
}

/// Draws the name of a row.
fn row_name(name: &str, baseline: f64) -> Markup {
    html! {
        text class="right" x=(NAMES - 10.0) y=(baseline) { title { (name) } (shortened(name, MAX_NAME)) }
    }
}

impl Values {
    fn has_before(&self) -> bool {
        self.rows.iter().any(|row| row.before.is_some())
    }

    fn error_bar(&self, x: &Placed, y: f64, value: MeasuredValue, second: bool) -> Markup {
        let at = |v: f64| coordinate(x.at(v));
        let (class, label) = if second { ("after", &self.labels[1]) } else { ("before", &self.labels[0]) };
        let [low, high] = [-2.0, 2.0].map(|k| at(value.value + k * value.u));
        html! {
            g {
                title { (label) ": " (format!("{:.4} ± {:.2}", value.value, value.u)) " " (self.quantity.label()) }
                path class=(format!("whisker-{class}")) d=(format!("M{low} {}H{high}", coordinate(y))) {}
                circle class=(format!("dot-{class}")) cx=(at(value.value)) cy=(coordinate(y)) r="3.2" {}
            }
        }
    }
}

impl Kind for Values {
    fn drawing(&self) -> Drawing {
        let values = self.rows.iter().flat_map(|row| [row.before, row.after]).flatten();
        let x = across(values.flat_map(|v| [v.value - 2.0 * v.u, v.value + 2.0 * v.u]));
        let bottom = 10.0 + ROW * self.rows.len() as f64;
        let entries = if self.has_before() {
            let entry = |class, label: &String| (class, format!("{label}, ± 2 u"));
            vec![entry("whisker-before", &self.labels[0]), entry("whisker-after", &self.labels[1])]
        } else {
            vec![("whisker-after", "value ± 2 u".to_string())]
        };
        let (keys, end) = legend(&entries, NAMES, bottom + 52.0, WIDTH - NAMES);
        let inner = html! {
            (horizontal_scale(&x, bottom, &self.quantity.label()))
            @for (number, row) in self.rows.iter().enumerate() {
                @let y = 10.0 + ROW * (number as f64 + 0.5);
                (row_name(&row.name, y + 4.0))
                @if let Some(before) = row.before { (self.error_bar(&x, y - 3.5, before, false)) }
                @if let Some(after) = row.after {
                    (self.error_bar(&x, if row.before.is_some() { y + 3.5 } else { y }, after, true))
                }
            }
            (keys)
        };
        Drawing::new([WIDTH, end + 10.0], inner)
    }

    /// One row per value.
    fn table(&self) -> Table {
        let rows = self.rows.iter().flat_map(|row| {
            let values = [row.before, row.after].into_iter().zip(&self.labels);
            values.filter_map(|(value, label)| {
                let MeasuredValue { value, u } = value?;
                Some(cells![&row.name, label, Cell::exact(value), Cell::exact(u)])
            })
        });
        let u = Quantity::new("u", &self.quantity.unit);
        let columns = [words("name"), words("model"), numbers(self.quantity.heading()), numbers(u.heading())];
        Table::new(columns, rows)
    }
}

/// Fill of a bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    /// The selected effect, or the quantity itself.
    Named,
    /// An alternative.
    Alias,
    /// Other.
    Other,
}

impl Fill {
    /// End of its CSS classes.
    fn class(self) -> &'static str {
        match self {
            Fill::Named => "named",
            Fill::Alias => "alias",
            Fill::Other => "other",
        }
    }
}

/// Bars from zero.
#[derive(Clone, Debug)]
pub struct Bars {
    /// What the bars show.
    pub quantity: Quantity,
    /// Name, value and fill of each bar, from the top.
    pub rows: Vec<(String, f64, Fill)>,
    /// Labels of the fills in the legend.
    pub labels: Vec<(Fill, &'static str)>,
}

impl Kind for Bars {
    fn drawing(&self) -> Drawing {
        let x = across(self.rows.iter().map(|row| row.1));
        let bottom = 10.0 + ROW * self.rows.len() as f64;
        let entry = |(fill, label): &(Fill, &str)| (format!("key-{}", fill.class()), label.to_string());
        let entries: Vec<(String, String)> = self.labels.iter().map(entry).collect();
        let (keys, end) = legend(&entries, 20.0, bottom + 54.0, WIDTH - 30.0);
        let inner = html! {
            (horizontal_scale(&x, bottom, &self.quantity.label()))
            @for (number, (name, value, fill)) in self.rows.iter().enumerate() {
                @let y = 10.0 + ROW * number as f64;
                @let width = (x.at(*value) - x.at(0.0)).abs();
                (row_name(name, y + 15.0))
                rect class=(format!("bar-{}", fill.class())) x=(coordinate(x.at(value.min(0.0)))) y=(y + 4.0)
                    width=(coordinate(width)) height="13" {
                    title { (name) ": " (text(*value, x.scale.step / 10.0)) }
                }
            }
            (keys)
        };
        Drawing::new([WIDTH, end + 12.0], inner)
    }

    /// One row per bar.
    fn table(&self) -> Table {
        let rows = self.rows.iter().map(|(name, value, fill)| {
            let label = self.labels.iter().find(|(labelled, _)| labelled == fill).map_or("", |(_, label)| label);
            cells![name, label, Cell::exact(*value)]
        });
        let columns = [words("name"), words("kind"), numbers(self.quantity.heading())];
        Table::new(columns, rows).without_empty_columns()
    }
}
