//! Plots over two straight axes: lines, dots, stems.

use maud::{Markup, html};

use super::scale::{Scale, dots, place, polyline, text};
use super::{Plot, legend};

/// Width of a plot.
pub const WIDTH: f64 = 560.0;
/// Its height without the legend.
pub const HEIGHT: f64 = 250.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 42.0;

/// Horizontal places of the frame.
pub const ACROSS: [f64; 2] = [LEFT, WIDTH - RIGHT];
/// Vertical places of the frame, low values first.
pub const UP: [f64; 2] = [HEIGHT - BOTTOM, TOP];

/// How points are drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// Joined.
    Line,
    /// By themselves.
    Dots,
    /// Upright strokes from zero.
    Stems,
    /// Upright strokes from each odd point to the next.
    Bars,
}

/// Fewer dots than this are drawn large.
const SPARSE: usize = 150;

/// One series.
pub struct Series<'s> {
    /// Class that colours it.
    pub class: &'s str,
    /// Its number among the stretches of its test and its column of the data, where the page can move it.
    pub live: Option<(usize, &'static str)>,
    /// How it is drawn.
    pub mark: Mark,
    /// Points.
    pub points: Vec<(f64, f64)>,
}

impl Series<'_> {
    fn path(&self, x: &Scale, y: &Scale) -> String {
        let placed = self.points.iter().map(|p| (x.at(p.0), y.at(p.1)));
        let stroke = |x: f64, from: f64, to: f64| format!("M{} {}V{}", place(x), place(from), place(to));
        match self.mark {
            Mark::Line => polyline(placed),
            Mark::Dots => dots(placed),
            Mark::Stems => placed.map(|(x, top)| stroke(x, y.at(0.0), top)).collect(),
            // A single reading is a stroke too.
            Mark::Bars => self
                .points
                .chunks_exact(2)
                .map(|pair| stroke(x.at(pair[0].0), y.at(pair[0].1) + 0.5, y.at(pair[1].1) - 0.5))
                .collect(),
        }
    }

    fn full_class(&self) -> String {
        match self.mark {
            Mark::Dots if self.points.len() < SPARSE => format!("run {} dots sparse", self.class),
            Mark::Dots => format!("run {} dots", self.class),
            Mark::Line => format!("run {}", self.class),
            Mark::Stems => format!("run {} stem", self.class),
            Mark::Bars => format!("run {} bars", self.class),
        }
    }
}

/// The frame with its scales.
pub fn frame(x: &Scale, y: &Scale, x_label: &str, y_label: &str) -> Markup {
    html! {
        @for value in y.ticks() {
            @let at = place(y.at(value));
            path class="grid" d=(format!("M{} {at}H{}", ACROSS[0], ACROSS[1])) {}
            text class="small soft right tick" x=(ACROSS[0] - 6.0) y=(place(y.at(value) + 4.0)) { (text(value, y.step)) }
        }
        @for value in x.ticks() {
            @let at = place(x.at(value));
            path class="grid" d=(format!("M{at} {}V{}", UP[0], UP[1])) {}
            text class="small soft middle" x=(at) y=(UP[0] + 16.0) { (text(value, x.step)) }
        }
        rect class="frame" x=(ACROSS[0]) y=(UP[1]) width=(ACROSS[1] - ACROSS[0]) height=(UP[0] - UP[1]) {}
        text class="middle" x=((ACROSS[0] + ACROSS[1]) / 2.0) y=(UP[0] + 34.0) { (x_label) }
        text class="middle" transform=(format!("translate(14 {}) rotate(-90)", (UP[0] + UP[1]) / 2.0)) { (y_label) }
    }
}

/// Least and greatest of some numbers.
pub fn span(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    values
        .into_iter()
        .filter(|value| value.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        })
}

/// What a plot is made of.
pub struct Lines<'l> {
    /// Name of the file.
    pub name: String,
    /// What it shows.
    pub title: String,
    /// How to read it.
    pub caption: String,
    /// Horizontal scale and label.
    pub x: (Scale, String),
    /// Vertical scale and label.
    pub y: (Scale, String),
    /// What is drawn, in this order.
    pub series: Vec<Series<'l>>,
    /// Classes and words.
    pub legend: Vec<(&'l str, String)>,
    /// What is drawn on top.
    pub over: Markup,
}

impl Lines<'_> {
    /// The plot.
    pub fn plot(self) -> Plot {
        let (keys, down) = if self.legend.is_empty() {
            (html! {}, HEIGHT - 6.0)
        } else {
            legend(&self.legend, LEFT, HEIGHT + 12.0, WIDTH - LEFT - RIGHT)
        };
        let inner = html! {
            (frame(&self.x.0, &self.y.0, &self.x.1, &self.y.1))
            @for series in &self.series {
                path class=(series.full_class()) data-run=[series.live.map(|l| l.0)] data-column=[series.live.map(|l| l.1)] d=(series.path(&self.x.0, &self.y.0)) {}
            }
            (self.over)
            (keys)
        };
        Plot::still(self.name, self.title, self.caption, [WIDTH, down + 10.0], inner)
    }
}
