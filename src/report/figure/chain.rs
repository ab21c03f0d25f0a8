//! Diagram of the kinematic chain from the workpiece over the bed to the tool.

use abbe::model::axis::{Axis, AxisKind};
use abbe::model::chain::Machine;
use abbe::model::component::ErrorName;
use abbe::model::words::cut;

use super::drawing::{Element, Place, WIDTH, wrapped};
use super::scale::text;
use super::{Chart, Figure};
use crate::report::table::{Cell, Table, cells, numbers, words};

/// Width of a body, SVG units.
const BODY: f64 = 98.0;
/// Height of a body, SVG units.
const HEIGHT: f64 = 74.0;
/// Distance of two bodies, SVG units.
const GAP: f64 = (WIDTH - 8.0 - BODIES_PER_ROW as f64 * BODY) / (BODIES_PER_ROW - 1) as f64;
/// Bodies in a row.
const BODIES_PER_ROW: usize = 4;

/// A body of a chain: its name, the axis that moves it, if one does, and identifiers of the estimated errors.
type Body<'m> = (&'m str, Option<&'m Axis>, String);

/// The chain with the estimated errors of each axis.
pub fn figure(machine: &Machine, errors: &[(&ErrorName, String)]) -> Figure {
    let moving = machine.axes.iter().map(|axis| {
        let own = errors.iter().filter(|(name, _)| name.axis == axis.name).map(|(_, id)| id.as_str());
        (axis.name.as_str(), Some(axis), own.collect::<Vec<_>>().join(" "))
    });
    let mut bodies: Vec<Body> = moving.collect();
    let fixed = |name| (name, None, String::new());
    bodies.insert(machine.workpiece_side, fixed("bed"));
    bodies.insert(0, fixed("workpiece"));
    bodies.push(fixed("tool"));
    Figure::new(
        "machine",
        format!("{}: {}", machine.name, machine.code()),
        "Kinematic chain from the workpiece over the bed to the tool, with the estimated errors beneath each axis. \
         d: direction, o: origin in mm; both in the reference frame, all axes at zero.",
        chart(&bodies),
    )
}

fn chart(bodies: &[Body]) -> Chart {
    let lines = |(.., errors): &Body| wrapped(errors, 15);
    let max_lines = |bodies: &[Body]| bodies.iter().map(|body| lines(body).len()).max().unwrap_or(0) as f64;
    let row_height = HEIGHT + 26.0 + 14.0 * max_lines(bodies);
    let rows = bodies.len().div_ceil(BODIES_PER_ROW).max(1) - 1;
    let last_height = HEIGHT + 8.0 + 14.0 * max_lines(&bodies[rows * BODIES_PER_ROW..]);
    let mut elements = Vec::new();
    for (number, body) in bodies.iter().enumerate() {
        let x = 4.0 + (number % BODIES_PER_ROW) as f64 * (BODY + GAP);
        let y = 6.0 + (number / BODIES_PER_ROW) as f64 * row_height;
        if !number.is_multiple_of(BODIES_PER_ROW) {
            elements.push(Element::line("link", [(x - GAP, y + HEIGHT / 2.0), (x, y + HEIGHT / 2.0)]));
        }
        let middle = x + BODY / 2.0;
        match body {
            (_, Some(axis), _) => elements.push(moving((x, y), axis)),
            (name, None, _) => elements.extend([
                Element::rectangle("body at-rest", (x, y), [BODY, HEIGHT]).rounded(4.0),
                Element::text("title middle", (middle, y + 32.0), name.get(..1).unwrap_or_default()),
                Element::text("small soft middle", (middle, y + 52.0), *name),
            ]),
        }
        elements.extend(lines(body).iter().enumerate().map(|(number, line)| {
            let baseline = y + HEIGHT + 15.0 + 14.0 * number as f64;
            Element::text("small soft middle", (middle, baseline), cut(line, 17))
        }));
    }
    Chart::new("chain", [WIDTH, 6.0 + rows as f64 * row_height + last_height], elements, table(bodies))
}

/// One row per body.
fn table(bodies: &[Body]) -> Table {
    let rows = bodies.iter().map(|(name, axis, errors)| {
        let kind = axis.map_or("fixed", |axis| match axis.kind {
            AxisKind::Linear => "linear",
            AxisKind::Rotary => "rotary",
        });
        let mut row = cells![*name, kind];
        for vector in [axis.map(|axis| axis.direction), axis.map(|axis| axis.origin_mm)] {
            row.extend((0..3).map(|k| vector.map_or("".into(), |vector| Cell::exact(vector[k]))));
        }
        row.push(errors.into());
        row
    });
    let of = |name: &str, unit: &str| ["x", "y", "z"].map(|along| numbers(format!("{name}_{along}{unit}")));
    let columns = [words("body"), words("kind")].into_iter().chain(of("direction", "")).chain(of("origin", "_mm"));
    Table::new(columns.chain([words("errors")]), rows)
}

/// The body that an axis moves, with the arrow of its motion.
fn moving((x, y): Place, axis: &Axis) -> Element {
    let three = |values: [f64; 3]| {
        let number = |v: f64| text(v, if v == v.round() { 1.0 } else { 0.01 });
        values.map(number).join(" ")
    };
    let [direction, origin] = [axis.direction, axis.origin_mm].map(three);
    let middle = x + BODY / 2.0;
    let arrow = match axis.kind {
        AxisKind::Rotary => {
            let turn = (0..=32).map(|k| {
                let (sin, cos) = (f64::from(k) * 9.9).to_radians().sin_cos();
                (11.0 * cos, 11.0 * sin)
            });
            vec![turn.collect(), vec![(7.5, -13.5), (8.0, -7.5)], vec![(8.0, -7.5), (2.0, -7.0)]]
        }
        AxisKind::Linear => {
            let head = |at: f64, by: f64| vec![(at - by, -4.0), (at, 0.0), (at - by, 4.0)];
            vec![vec![(-18.0, 0.0), (16.0, 0.0)], head(16.0, 6.0), head(-18.0, -6.0)]
        }
    };
    let placed =
        |line: Vec<Place>| line.into_iter().map(|(right, down)| (middle + 22.0 + right, y + 20.0 + down)).collect();
    let drawn = vec![
        Element::rectangle("body", (x, y), [BODY, HEIGHT]).rounded(4.0),
        Element::text("title", (x + 9.0, y + 24.0), cut(&axis.name, 5)),
        Element::lines("motion", arrow.into_iter().map(placed)),
        Element::text("small soft middle", (middle, y + 50.0), format!("d {}", cut(&direction, 13))),
        Element::text("small soft middle", (middle, y + 66.0), format!("o {}", cut(&origin, 13))),
    ];
    let title = format!("{}: direction {direction}, origin {origin} mm", axis.name);
    Element::group((0.0, 0.0), drawn).titled(title)
}
