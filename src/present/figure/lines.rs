//! Plots with two straight axes: lines, dots, stems and bars.

use maud::{Markup, html};

use super::scale::{Scale, coordinate, dots, polyline, text};
use super::{Plot, WIDTH, legend};

/// Height of a plot without its legend, SVG units.
pub const HEIGHT: f64 = 254.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 45.0;

/// Horizontal coordinates of the frame.
pub const ACROSS: [f64; 2] = [LEFT, WIDTH - RIGHT];
/// Vertical coordinates of the frame: of the minimum, of the maximum.
pub const UP: [f64; 2] = [HEIGHT - BOTTOM, TOP];

/// How points are drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// Joined points.
    Line,
    /// Separate points.
    Dots,
    /// Vertical strokes from zero.
    Stems,
    /// Vertical strokes, each from an odd point to the next point.
    Bars,
}

/// A series with fewer dots than this has larger dots.
const SPARSE: usize = 150;

/// A series of points.
pub struct Series<'s> {
    /// CSS class.
    pub class: &'s str,
    /// Index of the traversal and name of the data column. Only interactive plots have them.
    pub source: Option<(usize, &'static str)>,
    /// Mark.
    pub mark: Mark,
    /// Points.
    pub points: Vec<(f64, f64)>,
}

impl Series<'_> {
    fn path(&self, x: &Scale, y: &Scale) -> String {
        let points = self.points.iter().map(|p| (x.at(p.0), y.at(p.1)));
        let stroke = |x: f64, from: f64, to: f64| format!("M{} {}V{}", coordinate(x), coordinate(from), coordinate(to));
        match self.mark {
            Mark::Line => polyline(points),
            Mark::Dots => dots(points),
            Mark::Stems => points.map(|(x, top)| stroke(x, y.at(0.0), top)).collect(),
            // Half a pixel at each end makes a single reading visible.
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

/// Draws the frame, the grid and the tick labels.
pub fn frame(x: &Scale, y: &Scale, x_label: &str, y_label: &str) -> Markup {
    html! {
        @for value in y.ticks() {
            @let at = coordinate(y.at(value));
            path class="grid" d=(format!("M{} {at}H{}", ACROSS[0], ACROSS[1])) {}
            text class="small soft right tick" x=(ACROSS[0] - 6.0) y=(coordinate(y.at(value) + 4.0)) { (text(value, y.step)) }
        }
        @for value in x.ticks() {
            @let at = coordinate(x.at(value));
            path class="grid" d=(format!("M{at} {}V{}", UP[0], UP[1])) {}
            text class="small soft middle" x=(at) y=(UP[0] + 16.0) { (text(value, x.step)) }
        }
        rect class="frame" x=(ACROSS[0]) y=(UP[1]) width=(ACROSS[1] - ACROSS[0]) height=(UP[0] - UP[1]) {}
        text class="middle" x=((ACROSS[0] + ACROSS[1]) / 2.0) y=(UP[0] + 36.0) { (x_label) }
        text class="middle" transform=(format!("translate(14 {}) rotate(-90)", (UP[0] + UP[1]) / 2.0)) { (y_label) }
    }
}

/// Minimum and maximum of the finite values.
pub fn span(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    values
        .into_iter()
        .filter(|value| value.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
}

/// Contents of a plot with straight axes.
pub struct Lines<'l> {
    /// Name of the file, without extension.
    pub name: String,
    /// Title.
    pub title: String,
    /// Caption.
    pub caption: String,
    /// Horizontal scale and label.
    pub x: (Scale, String),
    /// Vertical scale and label.
    pub y: (Scale, String),
    /// Series, in drawing order.
    pub series: Vec<Series<'l>>,
    /// Legend: CSS class and label of each entry.
    pub legend: Vec<(&'l str, String)>,
    /// Further elements, drawn on top.
    pub over: Markup,
}

impl Lines<'_> {
    /// Draws the plot.
    pub fn plot(self) -> Plot {
        let (keys, bottom) = if self.legend.is_empty() {
            (html! {}, HEIGHT - 6.0)
        } else {
            legend(&self.legend, LEFT, HEIGHT + 12.0, WIDTH - LEFT - RIGHT)
        };
        let inner = html! {
            (frame(&self.x.0, &self.y.0, &self.x.1, &self.y.1))
            @for series in &self.series {
                path class=(series.full_class()) data-run=[series.source.map(|s| s.0)] data-column=[series.source.map(|s| s.1)] d=(series.path(&self.x.0, &self.y.0)) {}
            }
            (self.over)
            (keys)
        };
        Plot::new(self.name, self.title, self.caption, [WIDTH, bottom + 10.0], inner)
    }
}
