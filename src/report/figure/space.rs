//! Drawings in space, in parallel projection along (1, 1, 1): a machine with its axes and bodies, and the set-ups of tests
//! with balls, bar, rotary axes and the frame R.

use abbe::identify::series::paths::SetUpPath;
use abbe::model::axis::AxisKind;
use abbe::model::body::BodyShape;
use abbe::model::chain::Machine;
use abbe::model::words::cut;

use super::Chart;
use super::drawing::{Element, Place, label, legend};
use super::scale::span;
use crate::report::table::{Cell, Table, cells, numbers, words};

/// A point in R, mm.
type Point = [f64; 3];

/// Right and down on the paper, for a point in R. Z points up.
fn projected([x, y, z]: Point) -> [f64; 2] {
    let (sin, cos) = std::f64::consts::FRAC_PI_6.sin_cos();
    [(y - x) * cos, (x + y) * sin - z]
}

fn along([x, y, z]: Point, [dx, dy, dz]: [f64; 3], by: f64) -> Point {
    [x + by * dx, y + by * dy, z + by * dz]
}

/// The largest extent of points along an axis of R, at least this much.
fn extent(points: &[Point], least: f64) -> f64 {
    let spans = [0, 1, 2].map(|k| span(points.iter().map(|point| point[k])));
    spans.iter().map(|[low, high]| high - low).fold(least, f64::max)
}

/// Places points on the paper.
struct Paper {
    per_mm: f64,
    offset: [f64; 2],
    size: [f64; 2],
}

impl Paper {
    /// Paper of this width that holds the points, as high as it is wide or as they need, with a margin.
    fn of(points: &[Point], width: f64, is_square: bool, margin: f64) -> Paper {
        let flat: Vec<[f64; 2]> = points.iter().copied().map(projected).collect();
        let spans = [0, 1].map(|k| span(flat.iter().map(|point| point[k])));
        let [across, down] = spans.map(|[low, high]| high - low);
        let per_mm = (width - 2.0 * margin) / across.max(down).max(1e-9);
        let size = [width, if is_square { width } else { per_mm * down + 2.0 * margin }];
        let offset = [0, 1].map(|k| (size[k] - per_mm * (spans[k][0] + spans[k][1])) / 2.0);
        Paper { per_mm, offset, size }
    }

    fn at(&self, point: Point) -> Place {
        let [x, y] = projected(point);
        (self.offset[0] + self.per_mm * x, self.offset[1] + self.per_mm * y)
    }

    fn line(&self, class: &str, ends: [Point; 2]) -> Element {
        Element::line(class, ends.map(|end| self.at(end)))
    }

    fn circle(&self, class: &str, point: Point, radius: f64) -> Element {
        Element::circle(class, self.at(point), radius)
    }

    /// Words beside a point.
    fn label(&self, class: &str, words: &str, max: usize, point: Point, [right, down]: [f64; 2]) -> Element {
        let (x, y) = self.at(point);
        label(class, (x + right, y + down), &cut(words, max), self.size)
    }
}

/// Entries of a legend.
fn keys<const N: usize>(entries: [(&'static str, &str); N]) -> [(&'static str, String); N] {
    entries.map(|(class, label)| (class, label.to_string()))
}

/// Length of the line of a rotary axis of a machine, and of the arrow of a linear one, as a share of the extent.
const AXIS: f64 = 0.5;
const ARROW: f64 = 0.3;
/// Distance of the arrows from the bodies, as a share of their width.
const BESIDE: f64 = 0.35;
/// Head of an arrow, as a share of its length.
const HEAD: f64 = 0.16;

/// The machine with all axes at zero, in a drawing of this width. Letters have one size: the narrower the drawing, the
/// larger they are in print.
pub fn machine(machine: &Machine, width: f64) -> Chart {
    let bodies: Vec<Vec<[Point; 2]>> = machine.bodies.iter().map(|body| edges(&body.shape)).collect();
    let corners: Vec<Point> = bodies.iter().flatten().flatten().copied().collect();
    // Arrows of linear axes start beside table and spindle.
    let [x, y, z] = [0, 1, 2].map(|k| span(corners.iter().map(|point| point[k]).chain([-100.0, 100.0])));
    let right = y[1] + BESIDE * (y[1] - y[0]);
    let with_origin: Vec<Point> = corners.into_iter().chain([[0.0; 3]]).collect();
    let extent = extent(&with_origin, 300.0);
    let is_on_table = |index: usize| index < machine.workpiece_side;
    let lines = machine.axes.iter().enumerate().map(|(index, axis)| match axis.kind {
        AxisKind::Rotary => [-AXIS, AXIS].map(|by| along(axis.origin_mm, axis.direction, by * extent)),
        AxisKind::Linear => {
            let start = if is_on_table(index) { [x[1], right, z[0]] } else { [x[0], right, z[1]] };
            [start, along(start, axis.direction, ARROW * extent)]
        }
    });
    let lines: Vec<[Point; 2]> = lines.collect();
    let all: Vec<Point> = with_origin.into_iter().chain(lines.iter().flatten().copied()).collect();
    let paper = Paper::of(&all, width, false, 34.0);
    let mut elements = Vec::new();
    for (body, edges) in machine.bodies.iter().zip(&bodies) {
        elements.extend(edges.iter().map(|edge| paper.line("frame", *edge)));
        elements.extend(edges.last().map(|[corner, _]| paper.label("", &body.name, 16, *corner, [4.0, -4.0])));
    }
    let moves = |index: usize| if is_on_table(index) { "table" } else { "tool" };
    for ((index, axis), ends) in machine.axes.iter().enumerate().zip(&lines) {
        match axis.kind {
            AxisKind::Rotary => elements.push(paper.line("found-line", *ends)),
            AxisKind::Linear => elements.extend(arrow("motion", ends.map(|end| paper.at(end)))),
        }
        // Below the end of a line that comes from above, else above it, so that neither covers the other.
        let [from, to] = ends.map(|end| paper.at(end).1);
        let beside = if to <= from { [4.0, -4.0] } else { [-12.0, 15.0] };
        elements.push(paper.label("", &format!("{} ({})", axis.name, moves(index)), 16, ends[1], beside));
    }
    let (x, y) = paper.at([0.0; 3]);
    elements.extend([paper.circle("dot-after", [0.0; 3], 3.0), Element::text("", (x + 5.0, y + 12.0), "R")]);
    let entries = keys([("frame", "body"), ("found-line", "rotary axis"), ("motion", "linear axis, positive")]);
    let (legend, bottom) = legend(&entries, 10.0, paper.size[1] + 14.0, width - 20.0);
    elements.extend(legend);
    let rows = machine.axes.iter().enumerate().map(|(index, axis)| {
        let mut row = cells![&axis.name, moves(index), axis.kind.to_string()];
        row.extend(axis.direction.map(Cell::exact));
        row
    });
    let directions = ["x", "y", "z"].map(|name| numbers(format!("direction_{name}")));
    let columns = ["axis", "moves", "kind"].map(words).into_iter().chain(directions);
    Chart::new("machine", [width, bottom + 8.0], elements, Table::new(columns, rows))
}

/// The edges of a shape; of a surface, those of its box.
fn edges(shape: &BodyShape) -> Vec<[Point; 2]> {
    let of_box = |low: Point, high: Point| {
        let corner = |bits: usize| std::array::from_fn(|k| if bits >> k & 1 == 1 { high[k] } else { low[k] });
        let joined = |bits: usize| (0..3).filter(move |k| bits >> k & 1 == 0).map(move |k| [bits, bits | 1 << k]);
        (0..8).flat_map(joined).map(|pair| pair.map(corner)).collect()
    };
    match shape {
        BodyShape::Box { low_mm, high_mm } => of_box(*low_mm, *high_mm),
        BodyShape::Capsule { ends_mm: [from, to], radius_mm } => {
            let low = std::array::from_fn(|k| from[k].min(to[k]) - radius_mm);
            of_box(low, std::array::from_fn(|k| from[k].max(to[k]) + radius_mm))
        }
        BodyShape::Mesh { triangles_mm, .. } => {
            let spans = [0, 1, 2].map(|k| span(triangles_mm.iter().flatten().map(|corner| corner[k])));
            of_box(spans.map(|[low, _]| low), spans.map(|[_, high]| high))
        }
    }
}

/// A line with a head at its end.
fn arrow(class: &str, [(x0, y0), (x1, y1)]: [Place; 2]) -> [Element; 2] {
    let (dx, dy) = ((x1 - x0) * HEAD, (y1 - y0) * HEAD);
    let side = |sign: f64| (x1 - dx - sign * 0.5 * dy, y1 - dy + sign * 0.5 * dx);
    let head = Element::line(class, [side(1.0), (x1, y1), side(-1.0)]);
    [Element::line(class, [(x0, y0), (x1, y1)]), head]
}

/// Length of the arrows of R, as a share of the extent of the set-up.
const FRAME: f64 = 0.22;
/// Length of the line of a rotary axis of a set-up, as a share of the extent.
const AXIS_OF_SET_UP: f64 = 0.45;

/// The set-ups of some tests, one panel each, in a drawing of this width.
pub fn set_ups(tests: &[SetUpPath], per_row: usize, width: f64) -> Chart {
    let side = width / per_row as f64;
    let row_height = side + 16.0;
    let rows = tests.len().div_ceil(per_row).max(1);
    let entries = keys([
        ("after", "point of the table frame"),
        ("before", "point of the tool frame"),
        ("nominal", "between them, at the start"),
        ("found-line", "rotary axis"),
        ("motion", "frame R"),
    ]);
    let (legend, bottom) = legend(&entries, 10.0, row_height * rows as f64 + 16.0, width - 20.0);
    let placed = |(number, path): (usize, &SetUpPath)| {
        let at = ((number % per_row) as f64 * side, (number / per_row) as f64 * row_height);
        Element::group(at, set_up(path, side))
    };
    let elements = tests.iter().enumerate().map(placed).chain(legend).collect();
    let rows = tests.iter().flat_map(|path| {
        let points = [("table", &path.workpiece_mm), ("tool", &path.tool_mm)].into_iter();
        let points = points.flat_map(|(body, points)| points.iter().map(move |mm| (body, mm)));
        points.map(|(body, mm)| {
            let mut row = cells![&path.test, body];
            row.extend(mm.map(Cell::exact));
            row
        })
    });
    let columns = ["test", "frame"].map(words).into_iter().chain(["x_mm", "y_mm", "z_mm"].map(numbers));
    Chart::new("set-ups", [width, bottom + 10.0], elements, Table::new(columns, rows))
}

/// The panel of a set-up.
fn set_up(path: &SetUpPath, side: f64) -> Vec<Element> {
    let own: Vec<Point> = path.workpiece_mm.iter().chain(&path.tool_mm).copied().chain([[0.0; 3]]).collect();
    let extent = extent(&own, 1.0);
    let ends = |at: Point, d: [f64; 3]| [-AXIS_OF_SET_UP, AXIS_OF_SET_UP].map(|by| along(at, d, by * extent));
    let axes = path.axes.iter().map(|(name, at, d)| ("found-line", name.as_str(), ends(*at, *d)));
    let frame = ["X", "Y", "Z"].into_iter().enumerate();
    let frame = frame.map(|(k, name)| {
        ("motion", name, [[0.0; 3], std::array::from_fn(|i| if i == k { FRAME * extent } else { 0.0 })])
    });
    let lines: Vec<(&str, &str, [Point; 2])> = axes.chain(frame).collect();
    let all: Vec<Point> = own.into_iter().chain(lines.iter().flat_map(|(.., ends)| *ends)).collect();
    let paper = Paper::of(&all, side, true, 26.0);
    let mut elements = Vec::new();
    for (class, name, ends) in lines {
        elements.push(paper.line(class, ends));
        elements.push(paper.label("small", name, 6, ends[1], [3.0, -3.0]));
    }
    for (class, points) in [("after", &path.workpiece_mm), ("before", &path.tool_mm)] {
        let points = points.iter().map(|point| paper.at(*point));
        elements.push(match path.is_path {
            true => Element::line(class, points),
            false => Element::dots(format!("{class} dots"), points),
        });
    }
    let starts = [path.tool_mm.first(), path.workpiece_mm.first()];
    if let [Some(tool), Some(workpiece)] = starts {
        elements.push(paper.line("nominal", [*workpiece, *tool]));
    }
    let balls = starts.into_iter().zip(["dot-before", "dot-after"]);
    elements.extend(balls.filter_map(|(at, class)| Some(paper.circle(class, *at?, 4.0))));
    elements.push(Element::text("middle", (side / 2.0, side + 4.0), cut(&path.test, 26)));
    elements
}
