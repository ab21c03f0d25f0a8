//! Horizontal plots with one row per name: values with error bars, and bars.

use maud::{Markup, html};

use super::lines::span;
use super::scale::{Scale, coordinate, text};
use super::{Plot, WIDTH, legend, shortened};

/// Width of the names, SVG units.
const NAMES: f64 = 184.0;
/// Longest name, characters.
const MAX_NAME: usize = 23;
/// Height of a row, SVG units.
const ROW: f64 = 21.0;

/// A value with its standard uncertainty.
#[derive(Clone, Copy)]
pub struct Value {
    /// The value.
    pub value: f64,
    /// Standard uncertainty.
    pub u: f64,
}

/// A row with up to two values.
pub struct Row {
    /// Name.
    pub name: String,
    /// First value.
    pub before: Option<Value>,
    /// Second value.
    pub after: Option<Value>,
}

/// Draws the grid, the tick labels and the label of the horizontal scale below the rows.
fn horizontal_scale(x: &Scale, bottom: f64, label: &str) -> Markup {
    html! {
        @for value in x.ticks() {
            @let at = coordinate(x.at(value));
            path class="grid" d=(format!("M{at} 8V{bottom}")) {}
            text class="small soft middle" x=(at) y=(bottom + 15.0) { (text(value, x.step)) }
        }
        text class="middle" x=((x.coordinates[0] + x.coordinates[1]) / 2.0) y=(bottom + 32.0) { (label) }
    }
}

/// Plots values of one unit with whiskers of ± 2 u. `labels` name the first and the second value of a row.
pub fn values(name: String, title: String, caption: String, unit: &str, labels: [&str; 2], rows: &[Row]) -> Plot {
    let ends = rows
        .iter()
        .flat_map(|row| [row.before, row.after])
        .flatten()
        .flat_map(|v| [v.value - 2.0 * v.u, v.value + 2.0 * v.u, 0.0]);
    let [low, high] = span(ends);
    let x = Scale::rounded(low, high, [NAMES, WIDTH - 18.0], 6);
    let bottom = 10.0 + ROW * rows.len() as f64;
    let has_before = rows.iter().any(|row| row.before.is_some());
    let mut entries = vec![("whisker-after", format!("{}, ± 2 u", labels[1]))];
    if has_before {
        entries.insert(0, ("whisker-before", format!("{}, ± 2 u", labels[0])));
    } else {
        entries[0].1 = "value ± 2 u".to_string();
    }
    let (keys, end) = legend(&entries, NAMES, bottom + 52.0, WIDTH - NAMES);
    let inner = html! {
        (horizontal_scale(&x, bottom, unit))
        path class="nominal" d=(format!("M{} 8V{bottom}", coordinate(x.at(0.0)))) {}
        @for (number, row) in rows.iter().enumerate() {
            @let y = 10.0 + ROW * (number as f64 + 0.5);
            text class="right" x=(NAMES - 10.0) y=(y + 4.0) { title { (row.name) } (shortened(&row.name, MAX_NAME)) }
            @if let Some(before) = row.before { (error_bar(&x, y - 3.5, before, ["before", labels[0]], unit)) }
            @if let Some(after) = row.after {
                (error_bar(&x, if row.before.is_some() { y + 3.5 } else { y }, after, ["after", labels[1]], unit))
            }
        }
        (keys)
    };
    Plot::new(name, title, caption, [WIDTH, end + 10.0], inner)
}

fn error_bar(x: &Scale, y: f64, value: Value, [class, label]: [&str; 2], unit: &str) -> Markup {
    let at = |v: f64| coordinate(x.at(v));
    html! {
        g {
            title { (label) ": " (format!("{:.4} ± {:.2}", value.value, value.u)) " " (unit) }
            path class=(format!("whisker-{class}")) d=(format!("M{} {}H{}", at(value.value - 2.0 * value.u), coordinate(y), at(value.value + 2.0 * value.u))) {}
            circle class=(format!("dot-{class}")) cx=(at(value.value)) cy=(coordinate(y)) r="3.2" {}
        }
    }
}

/// Fill of a bar.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Fill {
    /// The selected effect, or the quantity itself.
    Named,
    /// An alternative.
    Alias,
    /// Other.
    Other,
}

impl Fill {
    fn class(self) -> &'static str {
        match self {
            Fill::Named => "bar-named",
            Fill::Alias => "bar-alias",
            Fill::Other => "bar-other",
        }
    }
}

/// Plots bars from zero. `labels` are the classes and labels of the legend.
pub fn bars(
    name: String,
    title: String,
    caption: String,
    label: &str,
    rows: &[(String, f64, Fill)],
    labels: &[(&'static str, &str)],
) -> Plot {
    let [low, high] = span(rows.iter().map(|row| row.1).chain([0.0]));
    let x = Scale::rounded(low, high, [NAMES, WIDTH - 18.0], 6);
    let bottom = 10.0 + ROW * rows.len() as f64;
    let entries: Vec<(&str, String)> = labels.iter().map(|(class, label)| (*class, label.to_string())).collect();
    let (keys, end) = legend(&entries, 20.0, bottom + 54.0, WIDTH - 30.0);
    let inner = html! {
        (horizontal_scale(&x, bottom, label))
        path class="nominal" d=(format!("M{} 8V{bottom}", coordinate(x.at(0.0)))) {}
        @for (number, (name, value, fill)) in rows.iter().enumerate() {
            @let y = 10.0 + ROW * number as f64;
            text class="right" x=(NAMES - 10.0) y=(y + 15.0) { title { (name) } (shortened(name, MAX_NAME)) }
            rect class=(fill.class()) x=(coordinate(x.at(value.min(0.0)))) y=(y + 4.0) width=(coordinate((x.at(*value) - x.at(0.0)).abs())) height="13" {
                title { (name) ": " (text(*value, x.step / 10.0)) }
            }
        }
        (keys)
    };
    Plot::new(name, title, caption, [WIDTH, end + 12.0], inner)
}
