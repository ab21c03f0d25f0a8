//! Horizontal charts with one row per name: values with error bars, and bars.

use abbe::identify::results::MeasuredValue;
use abbe::model::words::cut;

use super::drawing::{Element, Place, WIDTH, legend};
use super::scale::{Placed, Scale, span, text};
use super::{Chart, Quantity};
use crate::report::table::{Cell, Table, cells, numbers, words};

/// Width of the names, SVG units.
const NAMES: f64 = 184.0;
/// Longest name, characters.
const MAX_NAME: usize = 23;
/// Height of a row, SVG units.
const ROW: f64 = 21.0;

/// The rows of a chart on the scale of its values and zero.
struct Rows {
    x: Placed,
    bottom: f64,
    elements: Vec<Element>,
}

impl Rows {
    /// Draws the grid, the tick labels, the label of the scale below the rows, and the line at zero.
    fn new(count: usize, values: impl Iterator<Item = f64>, quantity: &Quantity) -> Rows {
        let x = Scale::rounded(span(values.chain([0.0])), 6).between([NAMES, WIDTH - 18.0]);
        let bottom = 10.0 + ROW * count as f64;
        let mut elements = Vec::new();
        for (at, tick) in x.ticks() {
            elements.push(Element::line("grid", [(at, 8.0), (at, bottom)]));
            elements.push(Element::text("small soft middle", (at, bottom + 15.0), tick));
        }
        let middle = (x.coordinates[0] + x.coordinates[1]) / 2.0;
        elements.push(Element::text("middle", (middle, bottom + 32.0), quantity.label()));
        elements.push(Element::line("nominal", [(x.at(0.0), 8.0), (x.at(0.0), bottom)]));
        Rows { x, bottom, elements }
    }

    /// Draws the name of a row, `down` below its middle; returns the ordinate of the middle.
    fn name(&mut self, number: usize, name: &str, down: f64) -> f64 {
        let middle = 10.0 + ROW * (number as f64 + 0.5);
        let shown = cut(name, MAX_NAME);
        self.elements.push(Element::text("right", (NAMES - 10.0, middle + down), shown).titled(name));
        middle
    }

    /// The chart with its legend, which starts here below the rows, and a margin below it.
    fn chart<S: AsRef<str>>(
        mut self,
        kind: &'static str,
        keys: &[(S, String)],
        from: Place,
        margin: f64,
        table: Table,
    ) -> Chart {
        let (legend, end) = legend(keys, from.0, self.bottom + from.1, WIDTH - from.0);
        self.elements.extend(legend);
        Chart::new(kind, [WIDTH, end + margin], self.elements, table)
    }
}

/// A name with up to two values.
pub type Row = (String, [Option<MeasuredValue>; 2]);

/// Values with whiskers of ± 2 u, the rows from the top. The labels are those of the first and the second value of a row.
pub fn values(quantity: &Quantity, labels: [&str; 2], rows: &[Row]) -> Chart {
    let all = rows.iter().flat_map(|(_, values)| values).flatten();
    let mut drawn = Rows::new(rows.len(), all.flat_map(|v| [v.value - 2.0 * v.u, v.value + 2.0 * v.u]), quantity);
    for (number, (name, values)) in rows.iter().enumerate() {
        let y = drawn.name(number, name, 4.0);
        let beside = if values[0].is_some() { 3.5 } else { 0.0 };
        let drawings = values.iter().zip(labels).zip([("before", y - 3.5), ("after", y + beside)]);
        for ((value, label), (class, y)) in drawings {
            let Some(MeasuredValue { value, u }) = *value else { continue };
            let whisker = [-2.0, 2.0].map(|k| (drawn.x.at(value + k * u), y));
            let bar = Element::line(format!("whisker-{class}"), whisker);
            let dot = Element::circle(format!("dot-{class}"), (drawn.x.at(value), y), 3.2);
            let title = format!("{label}: {value:.4} ± {u:.2} {}", quantity.label());
            drawn.elements.push(Element::group((0.0, 0.0), vec![bar, dot]).titled(title));
        }
    }
    let has_before = rows.iter().any(|(_, values)| values[0].is_some());
    let [before, after] = labels.map(|label| format!("{label}, ± 2 u"));
    let keys = match has_before {
        true => vec![("whisker-before", before), ("whisker-after", after)],
        false => vec![("whisker-after", "value ± 2 u".to_string())],
    };
    let lines = rows.iter().flat_map(|(name, values)| {
        let values = values.iter().zip(labels);
        values.filter_map(move |(value, label)| {
            let MeasuredValue { value, u } = (*value)?;
            Some(cells![name, label, Cell::exact(value), Cell::exact(u)])
        })
    });
    let u = Quantity::new("u", &quantity.unit);
    let columns = [words("name"), words("model"), numbers(quantity.heading()), numbers(u.heading())];
    drawn.chart("values", &keys, (NAMES, 52.0), 10.0, Table::new(columns, lines))
}

/// The fill of the selected effect, or of the quantity itself.
pub const NAMED: &str = "named";
/// The fill of an alternative.
pub const ALIAS: &str = "alias";
/// The fill of others.
pub const OTHER: &str = "other";

/// Bars from zero: name, value and fill of each, from the top; the labels of the fills in the legend.
pub fn bars(quantity: &Quantity, rows: &[(String, f64, &str)], labels: &[(&str, &str)]) -> Chart {
    let mut drawn = Rows::new(rows.len(), rows.iter().map(|row| row.1), quantity);
    for (number, (name, value, fill)) in rows.iter().enumerate() {
        let y = drawn.name(number, name, 4.5);
        let width = (drawn.x.at(*value) - drawn.x.at(0.0)).abs();
        let corner = (drawn.x.at(value.min(0.0)), y - 6.5);
        let title = format!("{name}: {}", text(*value, drawn.x.scale.step / 10.0));
        drawn.elements.push(Element::rectangle(format!("bar-{fill}"), corner, [width, 13.0]).titled(title));
    }
    let keys: Vec<_> = labels.iter().map(|(fill, label)| (format!("key-{fill}"), label.to_string())).collect();
    let lines = rows.iter().map(|(name, value, fill)| {
        let label = labels.iter().find(|(labelled, _)| labelled == fill).map_or("", |(_, label)| label);
        cells![name, label, Cell::exact(*value)]
    });
    let columns = [words("name"), words("kind"), numbers(quantity.heading())];
    drawn.chart("bars", &keys, (20.0, 54.0), 12.0, Table::new(columns, lines).without_empty_columns())
}
