//! Polar charts: the deviation of a ball bar, magnified, about a nominal circle.

use maud::{Markup, html};
use serde_json::json;

use super::scale::{coordinate, polyline, round_up, text};
use super::svg::{Drawing, WIDTH, legend, shortened};
use super::{Kind, Quantity};
use crate::present::table::{Cell, Column, Table, cells, numbers, words};

/// Divisions on either side of the nominal circle.
pub const DIVISIONS: f64 = 4.0;
/// Side of the square around the circles of a separate chart, SVG units.
const SIDE: f64 = 340.0;
/// Panels in a row.
const PER_ROW: usize = 3;
/// Largest angle of a chord, °. Longer gaps are subdivided, so that the line follows the circle.
const CHORD_DEG: f64 = 4.0;

/// One traversal.
#[derive(Clone, Debug)]
pub struct Traversal {
    /// CSS class: `forward`, `backward` or `plain`.
    pub class: &'static str,
    /// Index among the traversals of its test. Only a chart that the script of the page redraws has one.
    pub index: Option<usize>,
    /// Angle (°) and deviation (µm).
    pub points: Vec<(f64, f64)>,
}

/// Deviations about a nominal circle.
#[derive(Clone, Debug)]
pub struct Polar {
    /// The axis whose angle is shown.
    pub axis: String,
    /// What is magnified: `deviation`, `residual`.
    pub quantity: &'static str,
    /// Scale, µm per division.
    pub division_um: f64,
    /// Traversals.
    pub traversals: Vec<Traversal>,
    /// Index of the test and data column of the readings behind it.
    pub live: (usize, &'static str),
}

/// Several deviations about nominal circles at one scale.
#[derive(Clone, Debug)]
pub struct Panels {
    /// The axis whose angle is shown.
    pub axis: String,
    /// What is magnified: `deviation`.
    pub quantity: &'static str,
    /// Scale, µm per division.
    pub division_um: f64,
    /// Panels: cause, its size, and angle (°) and deviation (µm).
    pub panels: Vec<(String, &'static str, Vec<(f64, f64)>)>,
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
    fn drawing(self, traversals: &[Traversal]) -> Markup {
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
            @for traversal in traversals {
                @let path = joined_along_arcs(&traversal.points).into_iter().map(|point| self.point(point));
                path class=(format!("run {}", traversal.class)) data-run=[traversal.index] d=(polyline(path)) {}
            }
            @for traversal in traversals.iter().filter(|_| self.detailed) {
                @if let (Some(first), Some(last)) = (traversal.points.first(), traversal.points.last()) {
                    @let (first, last) = (self.point(*first), self.point(*last));
                    circle class="start" data-run=[traversal.index] cx=(coordinate(first.0)) cy=(coordinate(first.1))
                        r="4" {}
                    rect class="end" data-run=[traversal.index] x=(coordinate(last.0 - 3.0))
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
        let runs = [("forward", "forward"), ("backward", "backward"), ("plain", "readings")];
        let is_there = |class: &str| self.traversals.iter().any(|traversal| traversal.class == class);
        let entries: Vec<(&str, String)> = runs
            .into_iter()
            .filter(|(class, _)| is_there(class))
            .chain([("nominal", "nominal"), ("key-start", "start"), ("key-end", "end")])
            .map(|(class, label)| (class, label.to_string()))
            .collect();
        let (keys, bottom) = legend(&entries, 10.0, SIDE + 32.0, SIDE - 20.0);
        let um = self.division_um;
        let inner = html! {
            (circles.drawing(&self.traversals))
            text x="10" y=(SIDE + 12.0) {
                tspan class="division" { (text(um, um)) } " µm per division; angle of " (self.axis)
            }
            (keys)
        };
        let interaction = json!({
            "kind": "polar", "test": self.live.0, "column": self.live.1, "x0": SIDE / 2.0, "y0": SIDE / 2.0,
            "r": circles.nominal(), "px": circles.division(), "um": um, "abscissa": "x",
        });
        Drawing { size: [SIDE, bottom + 10.0], inner, interaction: Some(interaction.to_string()) }
    }

    /// One row per point.
    fn table(&self) -> Table {
        let rows = self.traversals.iter().enumerate().flat_map(|(number, traversal)| {
            let point = move |(angle, um): &(f64, f64)| {
                cells![traversal.class, (number + 1).to_string(), Cell::exact(*angle), Cell::exact(*um)]
            };
            traversal.points.iter().map(point)
        });
        Table::new([words("direction"), numbers("traversal"), angle(&self.axis), micrometres(self.quantity)], rows)
    }
}

fn angle(axis: &str) -> Column {
    numbers(Quantity::new(axis, "deg").heading())
}

fn micrometres(quantity: &str) -> Column {
    numbers(Quantity::new(quantity, "um").heading())
}

impl Kind for Panels {
    fn drawing(&self) -> Drawing {
        let side = WIDTH / PER_ROW as f64;
        let circles = Circles { side, detailed: false, division_um: self.division_um };
        let row_height = side + 22.0;
        let inner = html! {
            @for (number, (cause, size, points)) in self.panels.iter().enumerate() {
                @let (x, y) = ((number % PER_ROW) as f64 * side, (number / PER_ROW) as f64 * row_height);
                g transform=(format!("translate({x} {y})")) {
                    (circles.drawing(&[Traversal { class: "forward", index: None, points: points.clone() }]))
                    text class="middle" x=(side / 2.0) y=(side + 8.0) { (shortened(cause, 18)) " = " (size) }
                }
            }
        };
        let rows = self.panels.len().div_ceil(PER_ROW).max(1);
        Drawing::new([WIDTH, row_height * rows as f64 + 6.0], inner)
    }

    /// One row per point.
    fn table(&self) -> Table {
        let rows = self.panels.iter().flat_map(|(cause, size, points)| {
            points.iter().map(move |(angle, um)| cells![cause, *size, Cell::exact(*angle), Cell::exact(*um)])
        });
        Table::new([words("cause"), words("size"), angle(&self.axis), micrometres(self.quantity)], rows)
    }
}
