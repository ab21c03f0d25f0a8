//! Values with their uncertainty, one a row; and candidates by their evidence.

use maud::{Markup, html};

use super::lines::span;
use super::scale::{Scale, place, text};
use super::{Plot, cut, legend};

/// Width of a plot with a row of names on the left.
const WIDTH: f64 = 560.0;
/// Room for names.
const NAMES: f64 = 180.0;
/// Letters that fit there.
const MAX_LETTERS: usize = 25;
const ROW: f64 = 21.0;

/// A value with its standard uncertainty.
#[derive(Clone, Copy)]
pub struct Value {
    /// The value.
    pub value: f64,
    /// Its standard uncertainty.
    pub u: f64,
}

/// A row of values before and after.
pub struct Row {
    /// What it is.
    pub name: String,
    /// Before, where there is a before.
    pub before: Option<Value>,
    /// After.
    pub after: Option<Value>,
}

fn scale_below(x: &Scale, down: f64, label: &str) -> Markup {
    html! {
        @for value in x.ticks() {
            @let at = place(x.at(value));
            path class="grid" d=(format!("M{at} 8V{down}")) {}
            text class="small soft middle" x=(at) y=(down + 15.0) { (text(value, x.step)) }
        }
        text class="middle" x=((x.places[0] + x.places[1]) / 2.0) y=(down + 32.0) { (label) }
    }
}

/// Values of one unit with whiskers of ± 2 u, zero marked; `words` are what the first and second of a row are called.
pub fn values(
    name: String,
    title: String,
    caption: String,
    unit: &str,
    words: [&str; 2],
    rows: &[Row],
) -> Plot {
    let ends = rows
        .iter()
        .flat_map(|row| [row.before, row.after])
        .flatten()
        .flat_map(|v| [v.value - 2.0 * v.u, v.value + 2.0 * v.u, 0.0]);
    let [low, high] = span(ends);
    let x = Scale::rounded(low, high, [NAMES, WIDTH - 18.0], 6);
    let down = 10.0 + ROW * rows.len() as f64;
    let has_before = rows.iter().any(|row| row.before.is_some());
    let mut entries = vec![("whisker-after", format!("{}, ± 2 u", words[1]))];
    if has_before {
        entries.insert(0, ("whisker-before", format!("{}, ± 2 u", words[0])));
    } else {
        entries[0].1 = "value ± 2 u".to_string();
    }
    let (keys, end) = legend(&entries, NAMES, down + 52.0, WIDTH - NAMES);
    let inner = html! {
        (scale_below(&x, down, unit))
        path class="nominal" d=(format!("M{} 8V{down}", place(x.at(0.0)))) {}
        @for (number, row) in rows.iter().enumerate() {
            @let y = 10.0 + ROW * (number as f64 + 0.5);
            text class="right" x=(NAMES - 10.0) y=(y + 4.0) { title { (row.name) } (cut(&row.name, MAX_LETTERS)) }
            @if let Some(before) = row.before { (error_bar(&x, y - 3.5, before, ["before", words[0]], unit)) }
            @if let Some(after) = row.after {
                (error_bar(&x, if row.before.is_some() { y + 3.5 } else { y }, after, ["after", words[1]], unit))
            }
        }
        (keys)
    };
    Plot::still(name, title, caption, [WIDTH, end + 10.0], inner)
}

fn error_bar(x: &Scale, y: f64, value: Value, [class, word]: [&str; 2], unit: &str) -> Markup {
    let at = |v: f64| place(x.at(v));
    html! {
        g {
            title { (word) ": " (format!("{:.4} ± {:.2}", value.value, value.u)) " " (unit) }
            path class=(format!("whisker-{class}")) d=(format!("M{} {}H{}", at(value.value - 2.0 * value.u), place(y), at(value.value + 2.0 * value.u))) {}
            circle class=(format!("dot-{class}")) cx=(at(value.value)) cy=(place(y)) r="3.2" {}
        }
    }
}

/// How a bar is filled.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Fill {
    /// What was named.
    Named,
    /// What is confounded with it.
    Alias,
    /// Anything else.
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

/// Bars from zero, the words of each kind of fill in the legend.
pub fn bars(
    name: String,
    title: String,
    caption: String,
    label: &str,
    rows: &[(String, f64, Fill)],
    words: &[(&'static str, &str)],
) -> Plot {
    let [low, high] = span(rows.iter().map(|row| row.1).chain([0.0]));
    let x = Scale::rounded(low, high, [NAMES, WIDTH - 18.0], 6);
    let down = 10.0 + ROW * rows.len() as f64;
    let entries: Vec<(&str, String)> = words
        .iter()
        .map(|(class, word)| (*class, word.to_string()))
        .collect();
    let (keys, end) = legend(&entries, 20.0, down + 54.0, WIDTH - 30.0);
    let inner = html! {
        (scale_below(&x, down, label))
        path class="nominal" d=(format!("M{} 8V{down}", place(x.at(0.0)))) {}
        @for (number, (name, value, fill)) in rows.iter().enumerate() {
            @let y = 10.0 + ROW * number as f64;
            text class="right" x=(NAMES - 10.0) y=(y + 15.0) { title { (name) } (cut(name, MAX_LETTERS)) }
            rect class=(fill.class()) x=(place(x.at(value.min(0.0)))) y=(y + 4.0) width=(place((x.at(*value) - x.at(0.0)).abs())) height="13" {
                title { (name) ": " (text(*value, x.step / 10.0)) }
            }
        }
        (keys)
    };
    Plot::still(name, title, caption, [WIDTH, end + 12.0], inner)
}
