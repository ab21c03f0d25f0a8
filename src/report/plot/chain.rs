//! The machine drawn as its chain: from the workpiece over the bed to the tool, each axis with what it does.

use abbe::model::axis::{Axis, AxisKind};
use abbe::model::chain::Machine;
use maud::{Markup, html};

use super::scale::text;
use super::{Plot, cut, wrapped};

const WIDTH: f64 = 560.0;
const BODY: f64 = 92.0;
const HIGH: f64 = 74.0;
const GAP: f64 = 24.0;
const AXES_PER_ROW: usize = 5;

enum Body<'m> {
    Workpiece,
    Bed,
    Tool,
    Axis(&'m Axis),
}

/// The chain, with the errors that were asked for beneath each axis.
pub fn plot(machine: &Machine, errors: &[String]) -> Plot {
    let (table, tool) = machine.axes.split_at(machine.workpiece_side);
    let bodies: Vec<Body<'_>> = std::iter::once(Body::Workpiece)
        .chain(table.iter().map(Body::Axis))
        .chain(std::iter::once(Body::Bed))
        .chain(tool.iter().map(Body::Axis))
        .chain(std::iter::once(Body::Tool))
        .collect();
    let of = |axis: &Axis| -> Vec<String> {
        let own = |id: &&String| owner(id) == axis.name;
        wrapped(
            &errors.iter().filter(own).cloned().collect::<Vec<_>>().join(" "),
            15,
        )
    };
    let most_lines = machine.axes.iter().map(|axis| of(axis).len()).max().unwrap_or(0);
    let row_height = HIGH + 26.0 + 14.0 * most_lines as f64;
    let rows = bodies.len().div_ceil(AXES_PER_ROW);
    let inner = html! {
        @for (number, body) in bodies.iter().enumerate() {
            @let x = 4.0 + (number % AXES_PER_ROW) as f64 * (BODY + GAP - 4.0);
            @let y = 6.0 + (number / AXES_PER_ROW) as f64 * row_height;
            @if !number.is_multiple_of(AXES_PER_ROW) {
                path class="link" d=(format!("M{} {}h{}", x - (GAP - 4.0), y + HIGH / 2.0, GAP - 4.0)) {}
            }
            @match body {
                Body::Workpiece => { (plain(x, y, "workpiece", "w")) }
                Body::Bed => { (plain(x, y, "bed", "b")) }
                Body::Tool => { (plain(x, y, "tool", "t")) }
                Body::Axis(axis) => {
                    (moving(x, y, axis))
                    @for (line, words) in of(axis).iter().enumerate() {
                        text class="small soft middle" x=(x + BODY / 2.0) y=(y + HIGH + 15.0 + 14.0 * line as f64) { (cut(words, 17)) }
                    }
                }
            }
        }
    };
    Plot::still(
        "machine",
        format!("{}: {}", machine.name, machine.code()),
        "The chain from the workpiece over the bed to the tool; beneath each axis the errors that are identified. Direction and origin (mm) in the \
         reference frame, all axes at zero.",
        [WIDTH, 6.0 + rows as f64 * row_height],
        inner,
    )
}

/// The axis that an error or an effect's component belongs to: what follows `EX0` or `EX`.
fn owner(id: &str) -> &str {
    let component = id.split('~').next().unwrap_or(id);
    let rest = component.get(2..).unwrap_or("");
    rest.strip_prefix('0').unwrap_or(rest)
}

fn plain(x: f64, y: f64, words: &str, letter: &str) -> Markup {
    html! {
        rect class="body" x=(x) y=(y) width=(BODY) height=(HIGH) rx="4" stroke-dasharray="4 3" {}
        text class="title middle" x=(x + BODY / 2.0) y=(y + 32.0) { (letter) }
        text class="small soft middle" x=(x + BODY / 2.0) y=(y + 52.0) { (words) }
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
            rect class="body" x=(x) y=(y) width=(BODY) height=(HIGH) rx="4" {}
            text class="title" x=(x + 9.0) y=(y + 24.0) { (cut(&axis.name, 5)) }
            @match axis.kind {
                AxisKind::Rotary => {
                    path class="motion" d=(format!("M{} {}a11 11 0 1 1 -3 -7.5m0 0l-.5 -6m.5 6l-6 .5", middle + 33.0, y + 20.0)) {}
                }
                AxisKind::Linear => {
                    path class="motion" d=(format!("M{} {}h34m-6 -4l6 4l-6 4m-22 -8l-6 4l6 4", middle + 4.0, y + 20.0)) {}
                }
            }
            text class="small soft middle" x=(middle) y=(y + 50.0) { "d " (cut(&three(axis.direction), 13)) }
            text class="small soft middle" x=(middle) y=(y + 66.0) { "o " (cut(&three(axis.origin_mm), 13)) }
        }
    }
}
