//! Polar plots: the deviation of a ball bar, magnified, about a nominal circle.

use maud::{Markup, html};

use super::scale::{coordinate, polyline, round_up, text};
use super::{Plot, legend};

/// Divisions on either side of the nominal circle.
pub const DIVISIONS: f64 = 4.0;

/// One traversal of a polar plot.
pub struct Traversal<'t> {
    /// CSS class: `forward`, `backward` or `plain`.
    pub class: &'t str,
    /// Index among the traversals of its test. Only interactive plots have one.
    pub index: Option<usize>,
    /// Angle (°) and deviation (µm).
    pub points: Vec<(f64, f64)>,
}

/// Size of a polar plot.
#[derive(Clone, Copy)]
pub struct PolarSize {
    /// Side of the square around the circles, SVG units.
    pub side: f64,
    /// Whether angles and the symbols of start and end are drawn.
    pub detailed: bool,
}

impl PolarSize {
    /// A separate plot.
    pub const LARGE: PolarSize = PolarSize { side: 340.0, detailed: true };
    /// One of several in a plot, three to a row.
    pub const SMALL: PolarSize = PolarSize { side: super::WIDTH / 3.0, detailed: false };

    /// Distance of two neighbouring circles.
    pub fn division(self) -> f64 {
        self.side * 0.042
    }

    /// Radius of the nominal circle.
    pub fn nominal(self) -> f64 {
        self.side * 0.22
    }

    /// Coordinates of a reading.
    fn at(self, angle_deg: f64, divisions: f64) -> (f64, f64) {
        let radius = (self.nominal() + divisions * self.division()).max(0.0);
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        (self.side / 2.0 + radius * cos, self.side / 2.0 - radius * sin)
    }
}

/// The scale, µm per division, at which all points lie within the circles.
pub fn division_um<'p>(points: impl IntoIterator<Item = &'p (f64, f64)>) -> f64 {
    let maximum = points.into_iter().map(|(_, um)| um.abs()).fold(0.0, f64::max);
    round_up(maximum / DIVISIONS)
}

/// Draws circles, spokes, traversals and symbols.
pub fn drawing(size: PolarSize, division_um: f64, traversals: &[Traversal<'_>]) -> Markup {
    let centre = size.side / 2.0;
    html! {
        @for k in (-4..=4).filter(|k| *k != 0) {
            circle class="grid" cx=(centre) cy=(centre) r=(coordinate(size.nominal() + f64::from(k) * size.division())) {}
        }
        @for k in 0..8 {
            @let (x, y) = size.at(45.0 * f64::from(k), DIVISIONS);
            path class="grid" d=(polyline([(centre, centre), (x, y)])) {}
            @if size.detailed {
                @let (x, y) = size.at(45.0 * f64::from(k), DIVISIONS + 0.6);
                text class=(label_class(k)) x=(coordinate(x)) y=(coordinate(y + 4.0)) { (45 * k) "°" }
            }
        }
        circle class="nominal" cx=(centre) cy=(centre) r=(coordinate(size.nominal())) {}
        @for traversal in traversals {
            @let path = joined_along_arcs(&traversal.points).into_iter().map(|(angle, um)| size.at(angle, um / division_um));
            path class=(format!("run {}", traversal.class)) data-run=[traversal.index] d=(polyline(path)) {}
        }
        @if size.detailed {
            @for traversal in traversals {
                @let at = |point: &(f64, f64)| size.at(point.0, point.1 / division_um);
                @if let (Some(first), Some(last)) = (traversal.points.first().map(at), traversal.points.last().map(at)) {
                    circle class="start" data-run=[traversal.index] cx=(coordinate(first.0)) cy=(coordinate(first.1)) r="4" {}
                    rect class="end" data-run=[traversal.index] x=(coordinate(last.0 - 3.0)) y=(coordinate(last.1 - 3.0)) width="6" height="6" {}
                }
            }
        }
    }
}

/// Largest angle of a chord, °. Longer gaps are subdivided, so that the line follows the circle.
const CHORD_DEG: f64 = 4.0;

/// Joins distant readings along the arc. The deviation is interpolated linearly.
fn joined_along_arcs(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut path: Vec<(f64, f64)> = points.first().copied().into_iter().collect();
    for pair in points.windows(2) {
        let ((from, first), (to, second)) = (pair[0], pair[1]);
        let parts = ((to - from).abs() / CHORD_DEG).ceil().max(1.0);
        for k in 1..=parts as usize {
            let fraction = k as f64 / parts;
            path.push((from + fraction * (to - from), first + fraction * (second - first)));
        }
    }
    path
}

/// CSS classes that align the label of a spoke outside the circles.
fn label_class(spoke: i32) -> &'static str {
    match spoke {
        2 | 6 => "small soft middle",
        3..=5 => "small soft right",
        _ => "small soft",
    }
}

/// A separate polar plot.
pub fn plot(
    name: String,
    title: String,
    caption: String,
    angle: &str,
    traversals: &[Traversal<'_>],
    division_um: f64,
) -> Plot {
    let size = PolarSize::LARGE;
    let mut entries: Vec<(&str, String)> = Vec::new();
    for (class, label) in [("forward", "forward"), ("backward", "backward"), ("plain", "readings")] {
        if traversals.iter().any(|traversal| traversal.class == class) {
            entries.push((class, label.to_string()));
        }
    }
    entries.push(("nominal", "nominal".to_string()));
    entries.push(("key-start", "start".to_string()));
    entries.push(("key-end", "end".to_string()));
    let (keys, bottom) = legend(&entries, 10.0, size.side + 32.0, size.side - 20.0);
    let inner = html! {
        (drawing(size, division_um, traversals))
        text x="10" y=(size.side + 12.0) { tspan class="division" { (text(division_um, division_um)) } " µm per division; angle of " (angle) }
        (keys)
    };
    Plot::new(name, title, caption, [size.side, bottom + 10.0], inner)
}
