//! Polar charts: the deviation of a ball bar, magnified, about a nominal circle.

use abbe::model::words::cut;

use serde_json::json;

use super::drawing::{Element, Place, WIDTH, legend};
use super::lines::{self, Series};
use super::scale::{round_up, text};
use super::{Chart, Quantity};

/// Divisions on either side of the nominal circle.
pub const DIVISIONS: f64 = 4.0;
/// Side of the square around the circles of a separate chart, SVG units.
const SIDE: f64 = 340.0;
/// Panels in a row.
const PER_ROW: usize = 3;
/// Largest angle of a chord, °. Longer gaps are subdivided, so that the line follows the circle.
const CHORD_DEG: f64 = 4.0;

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
    fn at(self, angle_deg: f64, divisions: f64) -> Place {
        let radius = (self.nominal() + divisions * self.division()).max(0.0);
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        (self.side / 2.0 + radius * cos, self.side / 2.0 - radius * sin)
    }

    /// Coordinates of a reading.
    fn point(self, (angle_deg, um): (f64, f64)) -> Place {
        self.at(angle_deg, um / self.division_um)
    }

    /// Draws circles, spokes, traversals and symbols.
    fn elements(self, series: &[Series]) -> Vec<Element> {
        let centre = (self.side / 2.0, self.side / 2.0);
        let circle = |class: &str, radius: f64| Element::circle(class, centre, radius);
        let divisions = (-4..=4).filter(|k| *k != 0);
        let mut elements: Vec<Element> =
            divisions.map(|k| circle("grid", self.nominal() + f64::from(k) * self.division())).collect();
        for k in 0..8 {
            let angle = 45.0 * f64::from(k);
            elements.push(Element::line("grid", [centre, self.at(angle, DIVISIONS)]));
            if self.detailed {
                let (x, y) = self.at(angle, DIVISIONS + 0.6);
                elements.push(Element::text(label_class(k), (x, y + 4.0), format!("{angle}°")));
            }
        }
        elements.push(circle("nominal", self.nominal()));
        elements.extend(series.iter().map(|series| {
            let path = joined_along_arcs(&series.points).into_iter().map(|point| self.point(point));
            Element::line(format!("run {}", series.class), path).of(series.source)
        }));
        for series in series.iter().filter(|_| self.detailed) {
            if let (Some(first), Some(last)) = (series.points.first(), series.points.last()) {
                let (x, y) = self.point(*last);
                elements.push(Element::circle("start", self.point(*first), 4.0).of(series.source));
                elements.push(Element::rectangle("end", (x - 3.0, y - 3.0), [6.0; 2]).of(series.source));
            }
        }
        elements
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

/// Deviations about a nominal circle, `um` a division: traversals by angle (°) and deviation (µm), which are those of this
/// test and data column.
pub fn polar(
    [angle, deviation]: [&Quantity; 2],
    um: f64,
    series: &[Series],
    (test, column): (usize, &'static str),
) -> Chart {
    let circles = Circles { side: SIDE, detailed: true, division_um: um };
    let mut entries = lines::entries(series);
    let symbols = [("nominal", "nominal"), ("key-start", "start"), ("key-end", "end")];
    entries.extend(symbols.map(|(class, label)| (class.to_string(), label.to_string())));
    let (keys, bottom) = legend(&entries, 10.0, SIDE + 32.0, SIDE - 20.0);
    let mut elements = circles.elements(series);
    let words = format!("{} µm per division; angle of {}", text(um, um), angle.name);
    elements.push(Element::text("division", (10.0, SIDE + 12.0), words));
    elements.extend(keys);
    let interaction = json!({
        "kind": "polar", "test": test, "column": column, "x0": SIDE / 2.0, "y0": SIDE / 2.0,
        "r": circles.nominal(), "px": circles.division(), "um": um, "abscissa": "x",
    });
    Chart::new("polar", [SIDE, bottom + 10.0], elements, lines::table(series, angle, deviation)).live(&interaction)
}

/// Several deviations about nominal circles at one scale, `um` a division: a panel for each series, with its label.
pub fn panels([angle, deviation]: [&Quantity; 2], um: f64, series: &[Series]) -> Chart {
    let side = WIDTH / PER_ROW as f64;
    let circles = Circles { side, detailed: false, division_um: um };
    let row_height = side + 22.0;
    let panel = |(number, series): (usize, &Series)| {
        let mut elements = circles.elements(std::slice::from_ref(series));
        elements.push(Element::text("middle", (side / 2.0, side + 8.0), cut(&series.label, 26)));
        Element::group(((number % PER_ROW) as f64 * side, (number / PER_ROW) as f64 * row_height), elements)
    };
    let elements = series.iter().enumerate().map(panel).collect();
    let rows = series.len().div_ceil(PER_ROW).max(1);
    let size = [WIDTH, row_height * rows as f64 + 6.0];
    Chart::new("polar", size, elements, lines::table(series, angle, deviation))
}
