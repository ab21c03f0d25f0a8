//! Polar charts: the deviation of a ball bar, magnified, about a nominal circle.

use maud::{Markup, html};
use serde_json::json;

use super::lines::{self, Series};
use super::scale::{coordinate, polyline, round_up, text};
use super::svg::{Drawing, WIDTH, legend, shortened};
use super::{Kind, Quantity};
use crate::report::table::Table;

/// Divisions on either side of the nominal circle.
pub const DIVISIONS: f64 = 4.0;
/// Side of the square around the circles of a separate chart, SVG units.
const SIDE: f64 = 340.0;
/// Panels in a row.
const PER_ROW: usize = 3;
/// Largest angle of a chord, °. Longer gaps are subdivided, so that the line follows the circle.
const CHORD_DEG: f64 = 4.0;

/// Deviations about a nominal circle.
#[derive(Clone, Debug)]
pub struct Polar {
    /// The angle.
    pub angle: Quantity,
    /// What is magnified.
    pub deviation: Quantity,
    /// Scale, µm per division.
    pub division_um: f64,
    /// Traversals: angle (°) and deviation (µm).
    pub series: Vec<Series>,
    /// Index of the test and data column of the readings behind it.
    pub live: (usize, &'static str),
}

/// Several deviations about nominal circles at one scale.
#[derive(Clone, Debug)]
pub struct Panels {
    /// The angle.
    pub angle: Quantity,
    /// What is magnified.
    pub deviation: Quantity,
    /// Scale, µm per division.
    pub division_um: f64,
    /// One panel each, with its label: angle (°) and deviation (µm).
    pub series: Vec<Series>,
}

/// The scale, µm per division, at which all values lie within the circles.
pub fn division_um(values_um: impl IntoIterator<Item = f64>) -> f64 {
    round_up(values_um.into_iter().map(f64::abs).fold(0.0, f64::max) / DIVISIONS)
}

/// Circles and spokes in a square.
#[derive(Clone, Copy)]
struct Circles {
    /// Side of the square, SVG units.
    side: f64,
    /// Whether angles and the symbols of start and end are drawn.
    detailed: bool,
    /// Scale, µm per division.
    division_um: f64,
}

impl Circles {
    /// Distance of two neighbouring circles.
    fn division(self) -> f64 {
        self.side * 0.042
    }

    /// Radius of the nominal circle.
    fn nominal(self) -> f64 {
        self.side * 0.22
    }

    /// Coordinates at an angle, a number of divisions outside the nominal circle.
    fn at(self, angle_deg: f64, divisions: f64) -> (f64, f64) {
        let radius = (self.nominal() + divisions * self.division()).max(0.0);
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        (self.side / 2.0 + radius * cos, self.side / 2.0 - radius * sin)
    }

    /// Coordinates of a reading.
    fn point(self, (angle_deg, um): (f64, f64)) -> (f64, f64) {
        self.at(angle_deg, um / self.division_um)
    }

    /// Draws circles, spokes, traversals and symbols.
    fn drawing(self, series: &[Series]) -> Markup {
        let centre = self.side / 2.0;
        html! {
            @for k in (-4..=4).filter(|k| *k != 0) {
                @let radius = self.nominal() + f64::from(k) * self.division();
                circle class="grid" cx=(centre) cy=(centre) r=(coordinate(radius)) {}
            }
            @for k in 0..8 {
                @let (x, y) = self.at(45.0 * f64::from(k), DIVISIONS);
                path class="grid" d=(polyline([(centre, centre), (x, y)])) {}
                @if self.detailed {
                    @let (x, y) = self.at(45.0 * f64::from(k), DIVISIONS + 0.6);
                    text class=(label_class(k)) x=(coordinate(x)) y=(coordinate(y + 4.0)) { (45 * k) "°" }
                }
            }
            circle class="nominal" cx=(centre) cy=(centre) r=(coordinate(self.nominal())) {}
            @for series in series {
                @let path = joined_along_arcs(&series.points).into_iter().map(|point| self.point(point));
                path class=(format!("run {}", series.class)) data-run=[series.traversal()] d=(polyline(path)) {}
            }
            @for series in series.iter().filter(|_| self.detailed) {
                @if let (Some(first), Some(last)) = (series.points.first(), series.points.last()) {
                    @let (first, last) = (self.point(*first), self.point(*last));
                    circle class="start" data-run=[series.traversal()] cx=(coordinate(first.0)) cy=(coordinate(first.1))
                        r="4" {}
                    rect class="end" data-run=[series.traversal()] x=(coordinate(last.0 - 3.0))
                        y=(coordinate(last.1 - 3.0)) width="6" height="6" {}
                }
            }
        }
    }
}

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

impl Kind for Polar {
    fn drawing(&self) -> Drawing {
        let circles = Circles { side: SIDE, detailed: true, division_um: self.division_um };
        let mut entries = lines::entries(&self.series);
        let symbols = [("nominal", "nominal"), ("key-start", "start"), ("key-end", "end")];
        entries.extend(symbols.map(|(class, label)| (class.to_string(), label.to_string())));
        let (keys, bottom) = legend(&entries, 10.0, SIDE + 32.0, SIDE - 20.0);
        let um = self.division_um;
        let inner = html! {
            (circles.drawing(&self.series))
            text x="10" y=(SIDE + 12.0) {
                tspan class="division" { (text(um, um)) } " µm per division; angle of " (self.angle.name)
            }
            (keys)
        };
        let interaction = json!({
            "kind": "polar", "test": self.live.0, "column": self.live.1, "x0": SIDE / 2.0, "y0": SIDE / 2.0,
            "r": circles.nominal(), "px": circles.division(), "um": um, "abscissa": "x",
        });
        Drawing { size: [SIDE, bottom + 10.0], inner, interaction: Some(interaction.to_string()) }
    }

    fn table(&self) -> Table {
        lines::table(&self.series, &self.angle, &self.deviation)
    }
}

impl Kind for Panels {
    fn drawing(&self) -> Drawing {
        let side = WIDTH / PER_ROW as f64;
        let circles = Circles { side, detailed: false, division_um: self.division_um };
        let row_height = side + 22.0;
        let inner = html! {
            @for (number, series) in self.series.iter().enumerate() {
                @let (x, y) = ((number % PER_ROW) as f64 * side, (number / PER_ROW) as f64 * row_height);
                g transform=(format!("translate({x} {y})")) {
                    (circles.drawing(std::slice::from_ref(series)))
                    text class="middle" x=(side / 2.0) y=(side + 8.0) { (shortened(&series.label, 26)) }
                }
            }
        };
        let rows = self.series.len().div_ceil(PER_ROW).max(1);
        Drawing::new([WIDTH, row_height * rows as f64 + 6.0], inner)
    }

    fn table(&self) -> Table {
        lines::table(&self.series, &self.angle, &self.deviation)
    }
}
