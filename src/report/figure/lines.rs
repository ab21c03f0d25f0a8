//! Charts with two straight axes: lines, dots, stems, ranges and flags.

use abbe::model::words::cut;

use serde_json::json;

use super::drawing::{Element, Place, WIDTH, legend};
use super::scale::{Placed, Scale};
use super::{Chart, Quantity};
use crate::report::table::{Cell, Table, cells, numbers, words};

/// Space of the tick labels and the label of the ordinate, SVG units.
const LEFT: f64 = 62.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 12.0;
/// Space of the tick labels and the label of the abscissa.
const BELOW: f64 = 45.0;
/// A series with fewer dots than this has larger dots.
const SPARSE: usize = 150;
/// The labels of flags closer to the right edge of the frame than this are aligned to the right.
const LABEL_LIMIT: f64 = 144.0;

/// The size of a drawing with straight axes without its legend, SVG units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

impl Size {
    /// Two such drawings stand beside one another at 1,280 px.
    pub const WIDE: Size = Size { width: WIDTH, height: 254.0 };
    /// Three such drawings stand beside one another at 1,280 px.
    pub const SMALL: Size = Size { width: PANEL, height: 225.0 };
    /// As small, with a square frame.
    pub const SQUARE: Size = Size { width: PANEL, height: PANEL - LEFT - RIGHT + TOP + BELOW };

    /// The size of a drawing of this width, whose frame shows ranges of equal scale.
    pub(super) fn of_equal_scales(width: f64, x: Scale, y: Scale) -> Size {
        let range = |scale: Scale| scale.values[1] - scale.values[0];
        let height = (width - LEFT - RIGHT) * range(y) / range(x);
        Size { width, height: height + TOP + BELOW }
    }

    /// Horizontal coordinates of the frame.
    fn across(self) -> [f64; 2] {
        [LEFT, self.width - RIGHT]
    }

    /// Vertical coordinates of the frame: of the minimum, of the maximum.
    fn up(self) -> [f64; 2] {
        [self.height - BELOW, TOP]
    }

    /// Both axes in the frame.
    pub(super) fn placed(self, x: &Axis, y: &Axis) -> [Placed; 2] {
        [x.scale.between(self.across()), y.scale.between(self.up())]
    }

    /// A legend below the frame, with the ordinate of its last line.
    fn legend(self, entries: &[(String, String)]) -> (Vec<Element>, f64) {
        match entries {
            [] => (Vec::new(), self.height - 6.0),
            _ => legend(entries, LEFT, self.height + 12.0, self.width - LEFT - RIGHT),
        }
    }
}

/// Width of a small drawing.
const PANEL: f64 = 320.0;

/// How the points of a series are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mark {
    /// Joined points. A point with a name has a dot.
    Line,
    /// Separate points.
    Dots,
    /// Vertical strokes from zero, displaced by this number of units of x, so that two series stand side by side.
    Stems(f64),
    /// Vertical strokes, each from an odd point to the next point.
    Bars,
    /// Strokes in any direction, each from an odd point to the next point.
    Vectors,
    /// Names at the top, each with a line down to its point.
    Flags,
}

/// A series of points.
#[derive(Clone, Debug)]
pub struct Series {
    /// Label in the legend and the table; empty without an entry.
    pub label: String,
    /// CSS class of its colour and line.
    pub class: &'static str,
    /// Mark.
    pub mark: Mark,
    /// Points: x, y.
    pub points: Vec<(f64, f64)>,
    /// Names of the last points, as many as have one.
    pub names: Vec<Name>,
    /// Index of the traversal and name of the data column in a chart that the script of the page redraws.
    pub source: Option<(usize, &'static str)>,
    /// Index and name of the test in a chart of several tests. The script of the page hides a test by its index.
    pub test: Option<(usize, String)>,
}

/// The name of a point.
#[derive(Clone, Debug)]
pub struct Name {
    /// Name.
    pub text: String,
    /// Remark, shown under the pointer.
    pub note: String,
    /// Whether there is space for the name itself.
    pub shown: bool,
}

impl Series {
    /// A series without names.
    pub fn new(label: impl Into<String>, class: &'static str, mark: Mark, points: Vec<(f64, f64)>) -> Series {
        Series { label: label.into(), class, mark, points, names: Vec::new(), source: None, test: None }
    }

    /// The points that have a name.
    fn named(&self) -> impl Iterator<Item = (&(f64, f64), &Name)> {
        self.points.iter().skip(self.points.len() - self.names.len()).zip(&self.names)
    }

    fn lines(&self, x: &Placed, y: &Placed) -> Vec<Vec<Place>> {
        let at = |p: &(f64, f64)| (x.at(p.0), y.at(p.1));
        match self.mark {
            Mark::Line | Mark::Flags => vec![self.points.iter().map(at).collect()],
            Mark::Dots => self.points.iter().map(|point| vec![at(point)]).collect(),
            Mark::Stems(beside) => {
                let foot = |p: &(f64, f64)| (x.at(p.0 + beside), y.at(0.0));
                self.points.iter().map(|point| vec![foot(point), (foot(point).0, at(point).1)]).collect()
            }
            // Half a pixel at each end makes a single reading visible.
            Mark::Bars => {
                let bar = |from: Place, to: Place| vec![(from.0, from.1 + 0.5), (from.0, to.1 - 0.5)];
                self.points.chunks_exact(2).map(|pair| bar(at(&pair[0]), at(&pair[1]))).collect()
            }
            Mark::Vectors => self.points.chunks_exact(2).map(|pair| pair.iter().map(at).collect()).collect(),
        }
    }

    /// CSS classes of the path.
    fn classes(&self) -> String {
        let test = self.test.as_ref().map_or(String::new(), |(test, _)| format!(" of-test-{test}"));
        let mark = match self.mark {
            Mark::Dots if self.points.len() < SPARSE => " dots sparse",
            Mark::Dots => " dots",
            Mark::Stems(_) => " stem",
            Mark::Bars | Mark::Vectors => " bars",
            Mark::Line | Mark::Flags => "",
        };
        format!("run {}{test}{mark}", self.class)
    }

    /// CSS classes of the entry in the legend.
    fn key(&self) -> String {
        let mark = match self.mark {
            Mark::Dots => " dots",
            Mark::Bars | Mark::Vectors => " bars",
            _ => "",
        };
        format!("{}{mark}", self.class)
    }

    fn elements(&self, x: &Placed, y: &Placed) -> Vec<Element> {
        let mut elements = Vec::new();
        if self.mark == Mark::Flags {
            for (number, ((at, top), flag)) in self.named().enumerate() {
                let [bottom, frame_top] = y.coordinates;
                let (at, top, baseline) = (x.at(*at), y.at(*top), frame_top + 12.0 + 12.0 * (number % 3) as f64);
                let is_right = at > x.coordinates[1] - LABEL_LIMIT;
                let (class, beside) = if is_right { ("small right", -4.0) } else { ("small", 4.0) };
                let pole = [(at, (top - 3.0).max(baseline + 2.0)), (at, baseline + 2.0)];
                elements.push(Element::line("found-line", pole));
                elements
                    .push(Element::line("found", [(at, bottom), (at - 4.0, bottom + 8.0), (at + 4.0, bottom + 8.0)]));
                let name = cut(&flag.text, 24);
                elements.push(Element::text(class, (at + beside, baseline), name).titled(&flag.text));
            }
            return elements;
        }
        elements.push(Element::lines(self.classes(), self.lines(x, y)).of(self.source));
        for ((at, top), dot) in self.named() {
            let (at, top) = (x.at(*at), y.at(*top));
            let title = format!("{}: {}", dot.text, dot.note);
            elements.push(Element::circle(format!("dot-{}", self.class), (at, top), 3.4).titled(title));
            let name = dot.shown.then(|| cut(&dot.text, 26));
            elements.extend(name.map(|name| Element::text("small", (at + 6.0, top - 7.0), name)));
        }
        elements
    }
}

/// A straight axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// What it shows.
    pub quantity: Quantity,
    /// Its scale.
    pub scale: Scale,
}

impl Axis {
    /// An axis.
    pub fn new(name: impl Into<String>, unit: impl Into<String>, scale: Scale) -> Axis {
        Axis { quantity: Quantity::new(name, unit), scale }
    }
}

/// The readings behind a chart that the script of the page redraws.
#[derive(Clone, Debug)]
pub struct Live {
    /// Index of the test.
    pub test: usize,
    /// Data column.
    pub column: &'static str,
    /// Data column of the abscissa.
    pub abscissa: String,
    /// Whether the script may magnify the ordinate: it has four divisions on either side of zero.
    pub scaled: bool,
}

/// A chart with straight axes.
#[derive(Clone, Debug)]
pub struct Lines {
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Series, in drawing order.
    pub series: Vec<Series>,
    /// Its size.
    pub size: Size,
    /// The readings behind it. `None` for a static chart.
    pub live: Option<Live>,
}

impl Lines {
    /// A static chart.
    pub fn new(x: Axis, y: Axis, series: Vec<Series>) -> Lines {
        Lines { x, y, series, size: Size::WIDE, live: None }
    }

    /// The same in another size.
    #[must_use]
    pub fn sized(self, size: Size) -> Lines {
        Lines { size, ..self }
    }

    fn table(&self) -> Table {
        let mut table = table(&self.series, &self.x.quantity, &self.y.quantity);
        let heading = self.x.quantity.heading();
        let column = table.columns.iter().position(|column| column.heading == heading);
        if let (Some(words), Some(column)) = (self.x.scale.words, column) {
            for row in &mut table.rows {
                if let Some(Cell::Number(value, _)) = row.get(column) {
                    row[column] = words(*value).into();
                }
            }
        }
        table
    }
}

/// Entries of the legend: CSS classes and label, in the order of the first series of each.
pub(super) fn entries(series: &[Series]) -> Vec<(String, String)> {
    let mut entries: Vec<(String, String)> = Vec::new();
    for entry in series.iter().map(|series| (series.key(), series.label.clone())) {
        if !entry.1.is_empty() && !entries.contains(&entry) {
            entries.push(entry);
        }
    }
    entries
}

/// The points of all series, one row each.
pub(super) fn table(series: &[Series], x: &Quantity, y: &Quantity) -> Table {
    let rows = series.iter().flat_map(|series| {
        let names = series.points.iter().map(|_| "").skip(series.names.len());
        let names = names.chain(series.names.iter().map(|name| name.text.as_str()));
        series.points.iter().zip(names).map(|((x, y), name)| {
            let test = series.test.as_ref().map_or("", |(_, name)| name);
            let traversal = series.source.map_or(String::new(), |(traversal, _)| (traversal + 1).to_string());
            cells![test, &series.label, traversal, Cell::exact(*x), Cell::exact(*y), name]
        })
    });
    let [x, y] = [x, y].map(|quantity| numbers(quantity.heading()));
    let columns = [words("test"), words("series"), numbers("traversal"), x, y, words("name")];
    Table::new(columns, rows).without_empty_columns()
}

/// The grid, the tick labels, the frame and the labels of the axes.
pub(super) fn frame(x: &Placed, y: &Placed, [x_label, y_label]: [String; 2]) -> Vec<Element> {
    let ([left, right], [bottom, top]) = (x.coordinates, y.coordinates);
    let mut elements = Vec::new();
    for (at, label) in y.ticks() {
        elements.push(Element::line("grid", [(left, at), (right, at)]));
        elements.push(Element::text("small soft right tick", (left - 6.0, at + 4.0), label));
    }
    for (at, label) in x.ticks() {
        elements.push(Element::line("grid", [(at, bottom), (at, top)]));
        elements.push(Element::text("small soft middle", (at, bottom + 16.0), label));
    }
    elements.extend([
        Element::rectangle("frame", (left, top), [right - left, bottom - top]),
        Element::text("middle", ((left + right) / 2.0, bottom + 36.0), x_label),
        Element::upwards("middle", (14.0, (bottom + top) / 2.0), y_label),
    ]);
    elements
}

impl From<Lines> for Chart {
    fn from(lines: Lines) -> Chart {
        let Lines { x: across, y: up, series, size, live } = &lines;
        let [x, y] = size.placed(across, up);
        let (keys, bottom) = size.legend(&entries(series));
        let mut elements = frame(&x, &y, [across.quantity.label(), up.quantity.label()]);
        elements.extend(series.iter().flat_map(|series| series.elements(&x, &y)));
        elements.extend(keys);
        let chart = Chart::new("lines", [size.width, bottom + 10.0], elements, lines.table());
        let Some(live) = live else { return chart };
        let um = if live.scaled { y.scale.step } else { 1.0 };
        chart.live(&json!({
            "kind": "line", "test": live.test, "column": live.column, "abscissa": live.abscissa,
            "x0": x.at(0.0), "kx": x.per_unit(), "y0": y.at(0.0), "px": y.per_unit().abs() * um, "um": um,
            "scaled": live.scaled,
        }))
    }
}
