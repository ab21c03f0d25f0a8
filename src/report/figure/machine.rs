//! Drawing of a machine with its axes and bodies, all axes at zero, in parallel projection along (1, 1, 1).

use abbe::model::axis::AxisKind;
use abbe::model::body::BodyShape;
use abbe::model::chain::Machine;
use maud::{Markup, html};

use super::Kind;
use super::scale::{coordinate, polyline, span};
use super::set_up::{along, projected};
use super::svg::{Drawing, label_place, legend, shortened};
use crate::report::table::{Cell, Table, cells, numbers, words};

/// Space around the drawing, SVG units.
const MARGIN: f64 = 34.0;
/// Length of the line of an axis, as a share of the extent.
const AXIS: f64 = 0.5;
const ARROW: f64 = 0.3;
/// Distance of the arrows from the bodies, as a share of their width.
const BESIDE: f64 = 0.35;
/// Head of an arrow, as a share of its length.
const HEAD: f64 = 0.16;

/// A machine with its axes.
#[derive(Clone, Debug)]
pub struct MachineAxes {
    /// Width of the drawing, SVG units. Letters have one size: the narrower the drawing, the larger they are in print.
    pub width: f64,
    bodies: Vec<Wires>,
    axes: Vec<Line>,
}

/// The edges of a body.
#[derive(Clone, Debug)]
struct Wires {
    name: String,
    edges: Vec<[[f64; 3]; 2]>,
}

/// An axis: a line through a point.
#[derive(Clone, Debug)]
struct Line {
    name: String,
    at: [f64; 3],
    direction: [f64; 3],
    is_rotary: bool,
    moves: &'static str,
}

impl MachineAxes {
    /// The machine with its axes at zero.
    pub fn of(machine: &Machine, width: f64) -> MachineAxes {
        let bodies: Vec<Wires> =
            machine.bodies.iter().map(|body| Wires { name: body.name.clone(), edges: edges(&body.shape) }).collect();
        let points = || bodies.iter().flat_map(|body| body.edges.iter().flatten());
        // Arrows of linear axes start beside table and spindle.
        let [x, y, z] = [0, 1, 2].map(|k| span(points().map(|point| point[k]).chain([-100.0, 100.0])));
        let axes = machine.axes.iter().enumerate().map(|(index, axis)| {
            let on_table = index < machine.workpiece_side;
            let right = y[1] + BESIDE * (y[1] - y[0]);
            let beside = if on_table { [x[1], right, z[0]] } else { [x[0], right, z[1]] };
            let is_rotary = axis.kind == AxisKind::Rotary;
            Line {
                name: axis.name.clone(),
                at: if is_rotary { axis.origin_mm } else { beside },
                direction: axis.direction,
                is_rotary,
                moves: if on_table { "table" } else { "tool" },
            }
        });
        let axes = axes.collect();
        MachineAxes { width, bodies, axes }
    }

    /// Both ends of the line of an axis, for drawings of this extent.
    fn ends(line: &Line, extent: f64) -> [[f64; 3]; 2] {
        match line.is_rotary {
            true => [-AXIS, AXIS].map(|by| along(line.at, line.direction, by * extent)),
            false => [line.at, along(line.at, line.direction, ARROW * extent)],
        }
    }
}

/// The edges of a shape; of a surface, those of its box.
fn edges(shape: &BodyShape) -> Vec<[[f64; 3]; 2]> {
    let of_box = |low: [f64; 3], high: [f64; 3]| {
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

/// Places points on the paper.
struct Paper {
    per_mm: f64,
    offset: [f64; 2],
    size: [f64; 2],
}

impl Paper {
    fn of(points: &[[f64; 3]], width: f64) -> (Paper, f64) {
        let flat: Vec<[f64; 2]> = points.iter().copied().map(projected).collect();
        let [across, down] = [0, 1].map(|k| span(flat.iter().map(|point| point[k])));
        let per_mm = (width - 2.0 * MARGIN) / (across[1] - across[0]).max(down[1] - down[0]).max(1e-9);
        let height = per_mm * (down[1] - down[0]) + 2.0 * MARGIN;
        let offset = [width / 2.0 - per_mm * (across[0] + across[1]) / 2.0, MARGIN - per_mm * down[0]];
        (Paper { per_mm, offset, size: [width, height] }, height)
    }

    fn at(&self, point: [f64; 3]) -> (f64, f64) {
        let [x, y] = projected(point);
        (self.offset[0] + self.per_mm * x, self.offset[1] + self.per_mm * y)
    }

    fn line(&self, class: &str, ends: [[f64; 3]; 2]) -> Markup {
        html! { path class=(class) d=(polyline(ends.map(|end| self.at(end)))) {} }
    }

    /// A line with a head at its end.
    fn arrow(&self, class: &str, [from, to]: [[f64; 3]; 2]) -> Markup {
        let ((x0, y0), (x1, y1)) = (self.at(from), self.at(to));
        let (dx, dy) = ((x1 - x0) * HEAD, (y1 - y0) * HEAD);
        let side = |sign: f64| (x1 - dx - sign * 0.5 * dy, y1 - dy + sign * 0.5 * dx);
        html! {
            path class=(class) d=(polyline([(x0, y0), (x1, y1)])) {}
            path class=(class) d=(polyline([side(1.0), (x1, y1), side(-1.0)])) {}
        }
    }

    fn label(&self, text: &str, point: [f64; 3]) -> Markup {
        let ((x, y), text) = (self.at(point), shortened(text, 16));
        let (x, y) = label_place((x + 4.0, y - 4.0), &text, self.size);
        html! { text x=(coordinate(x)) y=(coordinate(y)) { (text) } }
    }

    /// A label at the end of a line: below it if the line comes from above, else above it, so that neither covers the other.
    fn label_of_line(&self, text: &str, [from, to]: [[f64; 3]; 2]) -> Markup {
        let ((_, y0), (x1, y1)) = (self.at(from), self.at(to));
        if y1 <= y0 {
            return self.label(text, to);
        }
        let text = shortened(text, 16);
        let (x, y) = label_place((x1 - 12.0, y1 + 15.0), &text, self.size);
        html! { text x=(coordinate(x)) y=(coordinate(y)) { (text) } }
    }
}

impl Kind for MachineAxes {
    fn drawing(&self) -> Drawing {
        let of_bodies: Vec<[f64; 3]> =
            self.bodies.iter().flat_map(|body| body.edges.iter().flatten()).copied().chain([[0.0; 3]]).collect();
        let spans = [0, 1, 2].map(|k| span(of_bodies.iter().map(|point| point[k])));
        let extent = spans.iter().map(|[low, high]| high - low).fold(300.0, f64::max);
        let lines: Vec<[[f64; 3]; 2]> = self.axes.iter().map(|line| MachineAxes::ends(line, extent)).collect();
        let all: Vec<[f64; 3]> = of_bodies.iter().copied().chain(lines.iter().flatten().copied()).collect();
        let (paper, height) = Paper::of(&all, self.width);
        let entries = [("frame", "body"), ("found-line", "rotary axis"), ("motion", "linear axis, positive")];
        let entries = entries.map(|(class, label)| (class, label.to_string()));
        let (keys, bottom) = legend(&entries, 10.0, height + 14.0, self.width - 20.0);
        let (x, y) = paper.at([0.0; 3]);
        let inner = html! {
            @for body in &self.bodies {
                @for edge in &body.edges { (paper.line("frame", *edge)) }
                @if let Some([corner, _]) = body.edges.last() { (paper.label(&body.name, *corner)) }
            }
            @for (line, ends) in self.axes.iter().zip(&lines) {
                @if line.is_rotary { (paper.line("found-line", *ends)) } @else { (paper.arrow("motion", *ends)) }
                (paper.label_of_line(&format!("{} ({})", line.name, line.moves), *ends))
            }
            circle class="dot-after" cx=(coordinate(x)) cy=(coordinate(y)) r="3" {}
            text x=(coordinate(x + 5.0)) y=(coordinate(y + 12.0)) { "R" }
            (keys)
        };
        Drawing::new([self.width, bottom + 8.0], inner)
    }

    /// One row per axis.
    fn table(&self) -> Table {
        let rows = self.axes.iter().map(|line| {
            let mut row = cells![&line.name, line.moves, if line.is_rotary { "rotary" } else { "linear" }];
            row.extend(line.direction.map(Cell::exact));
            row
        });
        let [x, y, z] = ["x", "y", "z"].map(|name| numbers(format!("direction_{name}")));
        Table::new([words("axis"), words("moves"), words("kind"), x, y, z], rows)
    }
}
