//! Diagram of the kinematic chain from the workpiece over the bed to the tool.

use abbe::model::axis::{Axis, AxisKind};
use abbe::model::chain::Machine;
use abbe::model::component::ErrorName;
use maud::{Markup, html};

use super::scale::text;
use super::svg::{Drawing, WIDTH, shortened, wrapped};
use super::{Chart, Figure, Kind};
use crate::report::table::{Cell, Table, cells, numbers, words};

/// Width of a body, SVG units.
const BODY: f64 = 98.0;
/// Height of a body, SVG units.
const HEIGHT: f64 = 74.0;
/// Distance of two bodies, SVG units.
const GAP: f64 = (WIDTH - 8.0 - BODIES_PER_ROW as f64 * BODY) / (BODIES_PER_ROW - 1) as f64;
/// Bodies in a row.
const BODIES_PER_ROW: usize = 4;

/// The bodies of a chain, from the workpiece to the tool.
#[derive(Clone, Debug)]
pub struct Chain(Vec<Body>);

/// A body of a chain.
#[derive(Clone, Debug)]
struct Body {
    /// Name of the axis; `workpiece`, `bed` or `tool`.
    name: String,
    /// The axis that moves it, if one does.
    axis: Option<Axis>,
    /// Identifiers of the estimated errors.
    errors: Vec<String>,
}

/// The chain with the estimated errors of each axis.
pub fn figure(machine: &Machine, errors: &[(&ErrorName, String)]) -> Figure {
    let fixed = |name: &str| Body { name: name.to_string(), axis: None, errors: Vec::new() };
    let moving = machine.axes.iter().map(|axis| Body {
        name: axis.name.clone(),
        axis: Some(axis.clone()),
        errors: errors.iter().filter(|(name, _)| name.axis == axis.name).map(|(_, id)| id.clone()).collect(),
    });
    let mut bodies: Vec<Body> = moving.collect();
    bodies.insert(machine.workpiece_side, fixed("bed"));
    bodies.insert(0, fixed("workpiece"));
    bodies.push(fixed("tool"));
    Figure::new(
        "machine",
        format!("{}: {}", machine.name, machine.code()),
        "Kinematic chain from the workpiece over the bed to the tool, with the estimated errors beneath each axis. \
         d: direction, o: origin in mm; both in the reference frame, all axes at zero.",
        Chart::Chain(Chain(bodies)),
    )
}

impl Body {
    /// Its errors in lines.
    fn lines(&self) -> Vec<String> {
        wrapped(&self.errors.join(" "), 15)
    }

    fn drawing(&self, x: f64, y: f64) -> Markup {
        let middle = x + BODY / 2.0;
        html! {
            @if let Some(axis) = &self.axis {
                (moving(x, y, axis))
                @for (number, line) in self.lines().iter().enumerate() {
                    @let baseline = y + HEIGHT + 15.0 + 14.0 * number as f64;
                    text class="small soft middle" x=(middle) y=(baseline) { (shortened(line, 17)) }
                }
            } @else {
                rect class="body" x=(x) y=(y) width=(BODY) height=(HEIGHT) rx="4" stroke-dasharray="4 3" {}
                text class="title middle" x=(middle) y=(y + 32.0) { (self.name.get(..1).unwrap_or_default()) }
                text class="small soft middle" x=(middle) y=(y + 52.0) { (self.name) }
            }
        }
    }
}

impl Kind for Chain {
    fn drawing(&self) -> Drawing {
        let max_lines = |bodies: &[Body]| bodies.iter().map(|body| body.lines().len()).max().unwrap_or(0) as f64;
        let row_height = HEIGHT + 26.0 + 14.0 * max_lines(&self.0);
        let rows = self.0.len().div_ceil(BODIES_PER_ROW).max(1) - 1;
        let last_height = HEIGHT + 8.0 + 14.0 * max_lines(&self.0[rows * BODIES_PER_ROW..]);
        let inner = html! {
            @for (number, body) in self.0.iter().enumerate() {
                @let x = 4.0 + (number % BODIES_PER_ROW) as f64 * (BODY + GAP);
                @let y = 6.0 + (number / BODIES_PER_ROW) as f64 * row_height;
                @if !number.is_multiple_of(BODIES_PER_ROW) {
                    path class="link" d=(format!("M{} {}h{}", x - GAP, y + HEIGHT / 2.0, GAP)) {}
                }
                (body.drawing(x, y))
            }
        };
        Drawing::new([WIDTH, 6.0 + rows as f64 * row_height + last_height], inner)
    }

    /// One row per body.
    fn table(&self) -> Table {
        let rows = self.0.iter().map(|body| {
            let axis = body.axis.as_ref();
            let kind = axis.map_or("fixed", |axis| match axis.kind {
                AxisKind::Linear => "linear",
                AxisKind::Rotary => "rotary",
            });
            let mut row = cells![&body.name, kind];
            for vector in [axis.map(|axis| axis.direction), axis.map(|axis| axis.origin_mm)] {
                row.extend((0..3).map(|k| vector.map_or("".into(), |vector| Cell::exact(vector[k]))));
            }
            row.push(body.errors.join(" ").into());
            row
        });
        let of = |name: &str, unit: &str| ["x", "y", "z"].map(|along| numbers(format!("{name}_{along}{unit}")));
        let mut columns = vec![words("body"), words("kind")];
        columns.extend(of("direction", "").into_iter().chain(of("origin", "_mm")));
        columns.push(words("errors"));
        Table::new(columns, rows)
    }
}

fn moving(x: f64, y: f64, axis: &Axis) -> Markup {
    let three = |values: [f64; 3]| {
        let number = |v: f64| text(v, if v == v.round() { 1.0 } else { 0.01 });
        values.map(number).join(" ")
    };
    let middle = x + BODY / 2.0;
    let (start, arrow) = match axis.kind {
        AxisKind::Rotary => (33.0, "a11 11 0 1 1 -3 -7.5m0 0l-.5 -6m.5 6l-6 .5"),
        AxisKind::Linear => (4.0, "h34m-6 -4l6 4l-6 4m-22 -8l-6 4l6 4"),
    };
    html! {
        g {
            title { (axis.name) ": direction " (three(axis.direction)) ", origin " (three(axis.origin_mm)) " mm" }
            rect class="body" x=(x) y=(y) width=(BODY) height=(HEIGHT) rx="4" {}
            text class="title" x=(x + 9.0) y=(y + 24.0) { (shortened(&axis.name, 5)) }
            path class="motion" d=(format!("M{} {}{arrow}", middle + start, y + 20.0)) {}
            text class="small soft middle" x=(middle) y=(y + 50.0) { "d " (shortened(&three(axis.direction), 13)) }
            text class="small soft middle" x=(middle) y=(y + 66.0) { "o " (shortened(&three(axis.origin_mm), 13)) }
        }
    }
}
