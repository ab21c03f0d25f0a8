//! Drawings of set-ups: balls, bar, rotary axes and the frame R, in parallel projection along (1, 1, 1).

use abbe::identify::series::paths::SetUpPath;
use maud::{Markup, html};

use super::Kind;
use super::scale::{coordinate, dots, polyline, span};
use super::svg::{Drawing, label_place, legend, shortened};
use crate::report::table::{Cell, Table, cells, numbers, words};

/// Space around the drawing of a panel, SVG units.
const MARGIN: f64 = 26.0;
/// Length of the arrows of R, as a share of the extent of the set-up.
const FRAME: f64 = 0.22;
/// Length of the line of a rotary axis, as a share of the extent.
const AXIS: f64 = 0.45;

/// The set-ups of some tests, one panel each.
#[derive(Clone, Debug)]
pub struct SetUps {
    /// The tests.
    pub panels: Vec<SetUpPath>,
    /// Panels in a row.
    pub per_row: usize,
    /// Width of the drawing, SVG units. Letters have one size: the narrower the drawing, the larger they are in print.
    pub width: f64,
}

/// Right and down on the paper, for a point in R. Z points up.
pub(super) fn projected([x, y, z]: [f64; 3]) -> [f64; 2] {
    let (sin, cos) = std::f64::consts::FRAC_PI_6.sin_cos();
    [(y - x) * cos, (x + y) * sin - z]
}

pub(super) fn along([x, y, z]: [f64; 3], [dx, dy, dz]: [f64; 3], by: f64) -> [f64; 3] {
    [x + by * dx, y + by * dy, z + by * dz]
}

/// The projection of one set-up onto its panel.
struct Panel {
    /// Side of the panel, SVG units.
    side: f64,
    per_mm: f64,
    offset: [f64; 2],
    /// Largest extent of the points, mm.
    extent: f64,
}

impl Panel {
    fn of(path: &SetUpPath, side: f64) -> Panel {
        let own: Vec<[f64; 3]> = path.workpiece_mm.iter().chain(&path.tool_mm).copied().chain([[0.0; 3]]).collect();
        let spans = [0, 1, 2].map(|k| span(own.iter().map(|point| point[k])));
        let extent = spans.iter().map(|[low, high]| high - low).fold(1.0, f64::max);
        let lines = path.axes.iter().flat_map(|(_, at, d)| [-AXIS, AXIS].map(|by| along(*at, *d, by * extent)));
        let frame = [0, 1, 2].map(|k| std::array::from_fn(|i| if i == k { FRAME * extent } else { 0.0 }));
        let all: Vec<[f64; 2]> = own.iter().copied().chain(lines).chain(frame).map(projected).collect();
        let [across, down] = [0, 1].map(|k| span(all.iter().map(|point| point[k])));
        let per_mm = (side - 2.0 * MARGIN) / (across[1] - across[0]).max(down[1] - down[0]).max(1e-9);
        let offset = [across, down].map(|[low, high]| side / 2.0 - per_mm * (low + high) / 2.0);
        Panel { side, per_mm, offset, extent }
    }

    fn at(&self, point: [f64; 3]) -> (f64, f64) {
        let [x, y] = projected(point);
        (self.offset[0] + self.per_mm * x, self.offset[1] + self.per_mm * y)
    }

    fn line(&self, class: &str, from: [f64; 3], to: [f64; 3]) -> Markup {
        html! { path class=(class) d=(polyline([self.at(from), self.at(to)])) {} }
    }

    fn label(&self, text: &str, point: [f64; 3]) -> Markup {
        let ((x, y), text) = (self.at(point), shortened(text, 6));
        let (x, y) = label_place((x + 3.0, y - 3.0), &text, [self.side; 2]);
        html! { text class="small" x=(coordinate(x)) y=(coordinate(y)) { (text) } }
    }

    fn ball(&self, class: &str, point: [f64; 3]) -> Markup {
        let (x, y) = self.at(point);
        html! { circle class=(class) cx=(coordinate(x)) cy=(coordinate(y)) r="4" {} }
    }

    fn path(&self, class: &str, points: &[[f64; 3]], is_path: bool) -> Markup {
        let points = points.iter().map(|point| self.at(*point));
        html! {
            @if is_path { path class=(class) d=(polyline(points)) {} }
            @else { path class=(format!("{class} dots")) d=(dots(points)) {} }
        }
    }
}

fn panel(path: &SetUpPath, side: f64) -> Markup {
    let panel = Panel::of(path, side);
    let length = FRAME * panel.extent;
    html! {
        @for (name, at, direction) in &path.axes {
            @let [low, high] = [-AXIS, AXIS].map(|by| along(*at, *direction, by * panel.extent));
            (panel.line("found-line", low, high))
            (panel.label(name, high))
        }
        @for (k, name) in ["X", "Y", "Z"].into_iter().enumerate() {
            @let end = std::array::from_fn(|i| if i == k { length } else { 0.0 });
            (panel.line("motion", [0.0; 3], end))
            (panel.label(name, end))
        }
        (panel.path("after", &path.workpiece_mm, path.is_path))
        (panel.path("before", &path.tool_mm, path.is_path))
        @if let (Some(workpiece), Some(tool)) = (path.workpiece_mm.first(), path.tool_mm.first()) {
            (panel.line("nominal", *workpiece, *tool))
        }
        @if let Some(tool) = path.tool_mm.first() { (panel.ball("dot-before", *tool)) }
        @if let Some(workpiece) = path.workpiece_mm.first() { (panel.ball("dot-after", *workpiece)) }
        text class="middle" x=(panel.side / 2.0) y=(panel.side + 4.0) { (shortened(&path.test, 26)) }
    }
}

impl Kind for SetUps {
    fn drawing(&self) -> Drawing {
        let per_row = self.per_row.max(1);
        let side = self.width / per_row as f64;
        let row_height = side + 16.0;
        let rows = self.panels.len().div_ceil(per_row).max(1);
        let entries = [
            ("after", "point of the table frame"),
            ("before", "point of the tool frame"),
            ("nominal", "between them, at the start"),
            ("found-line", "rotary axis"),
            ("motion", "frame R"),
        ];
        let entries = entries.map(|(class, label)| (class, label.to_string()));
        let (keys, bottom) = legend(&entries, 10.0, row_height * rows as f64 + 16.0, self.width - 20.0);
        let inner = html! {
            @for (number, path) in self.panels.iter().enumerate() {
                @let (x, y) = ((number % per_row) as f64 * side, (number / per_row) as f64 * row_height);
                g transform=(format!("translate({x} {y})")) { (panel(path, side)) }
            }
            (keys)
        };
        Drawing::new([self.width, bottom + 10.0], inner)
    }

    /// One row per point.
    fn table(&self) -> Table {
        let rows = self.panels.iter().flat_map(|path| {
            let bodies = [("table", &path.workpiece_mm), ("tool", &path.tool_mm)];
            let point = |body: &str, point: &[f64; 3]| {
                let mut row = cells![&path.test, body];
                row.extend(point.map(Cell::exact));
                row
            };
            bodies.into_iter().flat_map(move |(body, points)| points.iter().map(move |mm| point(body, mm)))
        });
        let [x, y, z] = ["x_mm", "y_mm", "z_mm"].map(numbers);
        Table::new([words("test"), words("frame"), x, y, z], rows)
    }
}
