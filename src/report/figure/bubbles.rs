//! Two sizes at each of many places: hollow circles before, filled ones after, over two axes of equal scale.

use abbe::identify::series::places::{Cell as Bubble, View};

use super::drawing::{Element, Place};
use super::lines::{Axis, Size, frame};
use super::scale::{Scale, round_up, span, text};
use super::{Chart, Quantity};
use crate::report::number::quantity;
use crate::report::table::{Cell, Table, numbers};

/// Width of a drawing, SVG units: two stand beside one another at 1,280 px, and one fills a screen of 400 px.
const WIDTH: f64 = 420.0;
/// Largest ratio of the height of the frame to its width.
const MAX_ASPECT: f64 = 1.1;
/// Least radius of a circle, SVG units: smaller ones are invisible.
const MIN_RADIUS: f64 = 0.4;

/// The axes of a view with scales that hold all circles, and one step, so that the grid is square. A tall range gets space
/// beside it.
fn scaled(view: &View) -> [Axis; 2] {
    let spans = [0, 1].map(|k| {
        let [low, high] = span(view.cells.iter().map(|bubble| bubble.at[k]));
        [low - view.cell, high + view.cell]
    });
    let [width, height] = spans.map(|[low, high]| high - low);
    let beside = ((height / MAX_ASPECT - width) / 2.0).max(0.0);
    let spans = [[spans[0][0] - beside, spans[0][1] + beside], spans[1]];
    let scales = spans.map(|range| Scale::over(range, 6));
    let step = scales[0].step.max(scales[1].step);
    [0, 1].map(|k| Axis::new(&view.names[k], view.unit, Scale { step, ..scales[k] }))
}

/// The sizes in the cells of a view, before only if it is drawn. The largest circle fills its cell.
pub fn bubbles(view: &View, size: &Quantity, has_before: bool) -> Chart {
    let [across, up] = scaled(view);
    let frame_size = Size::of_equal_scales(WIDTH, across.scale, up.scale);
    let [x, y] = frame_size.placed(&across, &up);
    let drawn = |bubble: &Bubble| if has_before { bubble.before.max(bubble.after) } else { bubble.after };
    let largest = view.cells.iter().map(drawn).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let per_unit = x.per_unit() * view.cell / 2.0 / largest;
    let mut elements = frame(&x, &y, [across.quantity.label(), up.quantity.label()]);
    let mut circles = |class: &str, of: fn(&Bubble) -> f64| {
        let place = |bubble: &Bubble| -> Place { (x.at(bubble.at[0]), y.at(bubble.at[1])) };
        let circle = |one: &Bubble| Element::circle(class, place(one), (of(one) * per_unit).max(MIN_RADIUS));
        elements.extend(view.cells.iter().map(circle));
    };
    if has_before {
        circles("bubble-before", |bubble| bubble.before);
    }
    circles("bubble-after", |bubble| bubble.after);
    // The key is a circle of a round size.
    let round = round_up(largest / 2.0);
    let key = quantity(&text(round, round), &size.unit);
    let entries =
        [("bubble-before", "before", 5.0), ("bubble-after", "after", 5.0), ("bubble-key", &key, round * per_unit)];
    let baseline = frame_size.height + 12.0;
    for (number, (class, words, radius)) in entries.into_iter().skip(usize::from(!has_before)).enumerate() {
        let left = 72.0 + 95.0 * number as f64;
        elements.push(Element::circle(class, (left, baseline - 4.0), radius));
        elements.push(Element::text("", (left + 14.0, baseline), words));
    }
    let sized = |when: &str| numbers(Quantity::new(format!("{} {when}", size.name), &size.unit).heading());
    let columns = [across.quantity.heading(), up.quantity.heading()].map(numbers).into_iter();
    let columns = columns.chain(has_before.then(|| sized("before"))).chain([sized("after")]);
    let rows = view.cells.iter().map(|bubble| {
        let before = has_before.then_some(bubble.before);
        bubble.at.into_iter().chain(before).chain([bubble.after]).map(Cell::exact).collect()
    });
    Chart::new("bubbles", [WIDTH, baseline + 10.0], elements, Table::new(columns, rows))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::drawing::Shape;

    #[test]
    fn the_largest_circle_fills_its_cell_and_both_axes_have_one_scale() {
        let bubble = |x: f64, y: f64, before: f64| Bubble { at: [x, y], readings: 1, before, after: before / 2.0 };
        let names = ["X", "Y"].map(str::to_string);
        let view = View { names, unit: "mm", cell: 10.0, cells: vec![bubble(0.0, 0.0, 8.0), bubble(100.0, 40.0, 4.0)] };
        let [x, y] = scaled(&view);
        let size = Size::of_equal_scales(WIDTH, x.scale, y.scale);
        let [x, y] = size.placed(&x, &y);
        assert!((x.per_unit() + y.per_unit()).abs() < 1e-9);
        let chart = bubbles(&view, &Quantity::new("residual", "um"), true);
        let radii = chart.drawing.elements.iter().filter_map(|element| match element.shape {
            Shape::Circle(_, radius) => Some(radius),
            _ => None,
        });
        // 10 mm of 120 mm in the frame of 342 units: a diameter of 28.5.
        assert!((radii.fold(0.0, f64::max) - 14.25).abs() < 1e-9);
        assert_eq!(chart.table.columns[2].heading, "residual_before_um");
    }
}
