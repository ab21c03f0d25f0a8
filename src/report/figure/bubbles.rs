//! Two sizes at each of many places: hollow circles before, filled ones after, over two axes of equal scale.

use maud::{Markup, html};

use super::lines::{Axis, Size, frame};
use super::scale::{Scale, coordinate, round_up, span, text};
use super::svg::Drawing;
use super::{Kind, Quantity};
use crate::report::number::quantity;
use crate::report::table::{Cell, Table, numbers};

/// Width of a drawing, SVG units: two stand beside one another at 1,280 px, and one fills a screen of 400 px.
const WIDTH: f64 = 420.0;
/// Largest ratio of the height of the frame to its width.
const MAX_ASPECT: f64 = 1.1;
/// Least radius of a circle, SVG units: smaller ones are invisible.
const MIN_RADIUS: f64 = 0.4;

/// The sizes at one place.
#[derive(Clone, Copy, Debug)]
pub struct Bubble {
    /// The place.
    pub at: [f64; 2],
    /// Size before.
    pub before: f64,
    /// Size after.
    pub after: f64,
}

/// Sizes over two coordinates of one unit.
#[derive(Clone, Debug)]
pub struct Bubbles {
    /// Horizontal and vertical coordinate.
    pub axes: [Quantity; 2],
    /// What the size is.
    pub size: Quantity,
    /// Distance of neighbouring places: the largest circle has this diameter.
    pub apart: f64,
    /// Whether the size before is drawn.
    pub has_before: bool,
    /// The places.
    pub bubbles: Vec<Bubble>,
}

impl Bubbles {
    /// The axes with scales that hold all circles, and one step, so that the grid is square. A tall range gets space beside
    /// it.
    fn scaled(&self) -> [Axis; 2] {
        let spans = [0, 1].map(|k| {
            let [low, high] = span(self.bubbles.iter().map(|bubble| bubble.at[k]));
            [low - self.apart, high + self.apart]
        });
        let [width, height] = spans.map(|[low, high]| high - low);
        let beside = ((height / MAX_ASPECT - width) / 2.0).max(0.0);
        let spans = [[spans[0][0] - beside, spans[0][1] + beside], spans[1]];
        let scales = spans.map(|range| Scale::over(range, 6));
        let step = scales[0].step.max(scales[1].step);
        [0, 1].map(|k| Axis { quantity: self.axes[k].clone(), scale: Scale { step, ..scales[k] } })
    }

    fn largest(&self) -> f64 {
        let drawn = |bubble: &Bubble| if self.has_before { bubble.before.max(bubble.after) } else { bubble.after };
        self.bubbles.iter().map(drawn).fold(0.0, f64::max)
    }
}

impl Kind for Bubbles {
    fn drawing(&self) -> Drawing {
        let [across, up] = self.scaled();
        let size = Size::of_equal_scales(WIDTH, across.scale, up.scale);
        let [x, y] = size.placed(&across, &up);
        let largest = self.largest().max(f64::MIN_POSITIVE);
        let per_unit = x.per_unit() * self.apart / 2.0 / largest;
        let circles = |class: &str, of: &dyn Fn(&Bubble) -> f64| -> Markup {
            html! {
                g class=(class) {
                    @for bubble in &self.bubbles {
                        circle cx=(coordinate(x.at(bubble.at[0]))) cy=(coordinate(y.at(bubble.at[1])))
                            r=(coordinate((of(bubble) * per_unit).max(MIN_RADIUS))) {}
                    }
                }
            }
        };
        // The key is a circle of a round size.
        let round = round_up(largest / 2.0);
        let key = quantity(&text(round, round), &self.size.unit);
        let entries = [("bubble-before", "before", 5.0), ("bubble-after", "after", 5.0)];
        let shown = entries.into_iter().filter(|(class, ..)| self.has_before || *class == "bubble-after");
        let entries = shown.chain([("bubble-key", key.as_str(), round * per_unit)]);
        let baseline = size.height + 12.0;
        let inner = html! {
            (frame(&x, &y, [across.quantity.label(), up.quantity.label()]))
            @if self.has_before { (circles("bubble-before", &|bubble| bubble.before)) }
            (circles("bubble-after", &|bubble| bubble.after))
            @for (number, (class, words, radius)) in entries.enumerate() {
                @let left = 72.0 + 95.0 * number as f64;
                circle class=(class) cx=(left) cy=(baseline - 4.0) r=(coordinate(radius)) {}
                text x=(left + 14.0) y=(baseline) { (words) }
            }
        };
        Drawing::new([WIDTH, baseline + 10.0], inner)
    }

    fn table(&self) -> Table {
        let [x, y] = self.axes.each_ref().map(|quantity| numbers(quantity.heading()));
        let heading =
            |when: &str| numbers(Quantity::new(format!("{} {when}", self.size.name), &self.size.unit).heading());
        let rows = self.bubbles.iter().map(|bubble| {
            let [x, y] = bubble.at.map(Cell::exact);
            let before = self.has_before.then(|| Cell::exact(bubble.before));
            [x, y].into_iter().chain(before).chain([Cell::exact(bubble.after)]).collect::<Vec<_>>()
        });
        let before = self.has_before.then(|| heading("before"));
        Table::new([x, y].into_iter().chain(before).chain([heading("after")]), rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_circle_fills_its_cell_and_both_axes_have_one_scale() {
        let bubble = |x: f64, y: f64, before: f64| Bubble { at: [x, y], before, after: before / 2.0 };
        let chart = Bubbles {
            axes: ["X", "Y"].map(|name| Quantity::new(name, "mm")),
            size: Quantity::new("residual", "um"),
            apart: 10.0,
            has_before: true,
            bubbles: vec![bubble(0.0, 0.0, 8.0), bubble(100.0, 40.0, 4.0)],
        };
        let [x, y] = chart.scaled();
        let size = Size::of_equal_scales(WIDTH, x.scale, y.scale);
        let [x, y] = size.placed(&x, &y);
        assert!((x.per_unit() + y.per_unit()).abs() < 1e-9);
        let drawn = chart.drawing().inner.into_string();
        // 10 mm of 120 mm in the frame of 342 units: a diameter of 28.5.
        assert!(drawn.contains("r=\"14.3\"") || drawn.contains("r=\"14.2\""), "{drawn}");
        assert_eq!(chart.table().columns[2].heading, "residual_before_um");
    }
}
