//! Diagram of the kinematic chain from the workpiece over the bed to the tool.

use abbe::model::axis::{Axis, AxisKind};
use abbe::model::chain::Machine;
use maud::{Markup, html};

use super::scale::text;
use super::{Plot, WIDTH, shortened, wrapped};

/// Width of a body, SVG units.
const BODY: f64 = 98.0;
/// Height of a body, SVG units.
const HEIGHT: f64 = 74.0;
/// Distance of two bodies, SVG units.
const GAP: f64 = (WIDTH - 8.0 - BODIES_PER_ROW as f64 * BODY) / (BODIES_PER_ROW - 1) as f64;
/// Bodies in a row.
const BODIES_PER_ROW: usize = 4;

enum Body<'m> {
    Workpiece,
    Bed,
    Tool,
    Axis(&'m Axis),
}

/// Draws the chain with the estimated errors beneath each axis.
pub fn plot(machine: &Machine, errors: &[String]) -> Plot {
    let (table, tool) = machine.axes.split_at(machine.workpiece_side);
    let bodies: Vec<Body<'_>> = std::iter::once(Body::Workpiece)
        .chain(table.iter().map(Body::Axis))
        .chain(std::iter::once(Body::Bed))
        .chain(tool.iter().map(Body::Axis))
        .chain(std::iter::once(Body::Tool))
        .collect();
    let errors_of = |axis: &Axis| -> Vec<String> {
        let own = |id: &&String| owner(id) == axis.name;
        wrapped(&errors.iter().filter(own).cloned().collect::<Vec<_>>().join(" "), 15)
    };
    let max_lines = machine.axes.iter().map(|axis| errors_of(axis).len()).max().unwrap_or(0);
    let row_height = HEIGHT + 26.0 + 14.0 * max_lines as f64;
    let rows = bodies.len().div_ceil(BODIES_PER_ROW);
    let last_lines = bodies[(rows - 1) * BODIES_PER_ROW..].iter().map(|body| match body {
        Body::Axis(axis) => errors_of(axis).len(),
        _ => 0,
    });
    let last_height = HEIGHT + 8.0 + 14.0 * last_lines.max().unwrap_or(0) as f64;
    let inner = html! {
        @for (number, body) in bodies.iter().enumerate() {
            @let x = 4.0 + (number % BODIES_PER_ROW) as f64 * (BODY + GAP);
            @let y = 6.0 + (number / BODIES_PER_ROW) as f64 * row_height;
            @if !number.is_multiple_of(BODIES_PER_ROW) {
                path class="link" d=(format!("M{} {}h{}", x - GAP, y + HEIGHT / 2.0, GAP)) {}
            }
            @match body {
                Body::Workpiece => { (fixed(x, y, "workpiece", "w")) }
                Body::Bed => { (fixed(x, y, "bed", "b")) }
                Body::Tool => { (fixed(x, y, "tool", "t")) }
                Body::Axis(axis) => {
                    (moving(x, y, axis))
                    @for (line, words) in errors_of(axis).iter().enumerate() {
                        text class="small soft middle" x=(x + BODY / 2.0) y=(y + HEIGHT + 15.0 + 14.0 * line as f64) { (shortened(words, 17)) }
                    }
                }
            }
        }
    };
    Plot::new(
        "machine",
        format!("{}: {}", machine.name, machine.code()),
        "Kinematic chain from the workpiece over the bed to the tool, with the estimated errors beneath each axis. d: direction, o: origin in mm; both in \
         the reference frame, all axes at zero.",
        [WIDTH, 6.0 + (rows - 1) as f64 * row_height + last_height],
        inner,
    )
}

/// Name of the axis of an error or of an effect's component: the text after `EX0` or `EX`.
fn owner(id: &str) -> &str {
    let component = id.split('~').next().unwrap_or(id);
    let rest = component.get(2..).unwrap_or("");
    rest.strip_prefix('0').unwrap_or(rest)
}

fn fixed(x: f64, y: f64, label: &str, letter: &str) -> Markup {
    html! {
        rect class="body" x=(x) y=(y) width=(BODY) height=(HEIGHT) rx="4" stroke-dasharray="4 3" {}
        text class="title middle" x=(x + BODY / 2.0) y=(y + 32.0) { (letter) }
        text class="small soft middle" x=(x + BODY / 2.0) y=(y + 52.0) { (label) }
    }
}

fn moving(x: f64, y: f64, axis: &Axis) -> Markup {
    let three = |values: [f64; 3]| {
        let number = |v: f64| text(v, if v == v.round() { 1.0 } else { 0.01 });
        values.map(number).join(" ")
    };
    let middle = x + BODY / 2.0;
    html! {
        g {
            title { (axis.name) ": direction " (three(axis.direction)) ", origin " (three(axis.origin_mm)) " mm" }
            rect class="body" x=(x) y=(y) width=(BODY) height=(HEIGHT) rx="4" {}
            text class="title" x=(x + 9.0) y=(y + 24.0) { (shortened(&axis.name, 5)) }
            @match axis.kind {
                AxisKind::Rotary => {
                    path class="motion" d=(format!("M{} {}a11 11 0 1 1 -3 -7.5m0 0l-.5 -6m.5 6l-6 .5", middle + 33.0, y + 20.0)) {}
                }
                AxisKind::Linear => {
                    path class="motion" d=(format!("M{} {}h34m-6 -4l6 4l-6 4m-22 -8l-6 4l6 4", middle + 4.0, y + 20.0)) {}
                }
            }
            text class="small soft middle" x=(middle) y=(y + 50.0) { "d " (shortened(&three(axis.direction), 13)) }
            text class="small soft middle" x=(middle) y=(y + 66.0) { "o " (shortened(&three(axis.origin_mm), 13)) }
        }
    }
}
