//! Figures of ISO 230-2 and ISO 230-6: the table and the plot of an axis, and of a diagonal.

use abbe::identify::figure::{Figure, OF_DIAGONALS, POSITIONING, find};
use abbe::identify::positioning::diagonal::{DiagonalKind, DiagonalTest, LargestOfDiagonals};
use abbe::identify::positioning::{Approach, COVERAGE, Contributions, Deviations, Position, PositioningTest};

use super::block::{Report, Text};
use super::figure;
use super::figure::lines::{Axis, Lines, Mark, Series};
use super::figure::scale::{Scale, span};
use super::number::unit;
use super::table::{Cell, Table, cells, numbers, words};

/// Positions that a terminal shows without `--all`.
const MAX_ROWS: usize = 12;

/// The section of the figures of every test, if there is one.
pub fn section(report: &mut Report, tests: &[PositioningTest]) {
    if tests.is_empty() {
        return;
    }
    report.section("Positioning figures");
    for PositioningTest { test, axis, read } in tests {
        report.key(figures(read).titled(format!("{test}: positioning of {axis} (ISO 230-2)")));
        detail(report, read, axis, format!("positioning-{test}"), format!("{test}: deviation of {axis}"));
    }
    notes(report, tests.iter().any(|test| test.read.uncertainty.is_some()));
}

/// The section of the figures of every diagonal, if there is one.
pub fn diagonals(report: &mut Report, tests: &[DiagonalTest], largest: &[LargestOfDiagonals]) {
    if tests.is_empty() {
        return;
    }
    report.section("Figures of diagonals");
    report.key(overview(tests, largest));
    for one in tests {
        let (test, read, name) = (&one.test, &one.read, named(one));
        report.detail(figures(read).titled(format!("{test}: {name}")));
        detail(report, read, "distance", format!("diagonal-{test}"), format!("{test}: deviation of {name}"));
    }
    notes(report, tests.iter().any(|test| test.read.uncertainty.is_some()));
}

/// A diagonal in words: `body diagonal XYZ PPP`.
fn named(test: &DiagonalTest) -> String {
    let step = if test.in_turn { " in steps" } else { "" };
    format!("{} diagonal {} {}{step}", kind(test.kind), test.axes.concat(), test.direction)
}

fn kind(kind: DiagonalKind) -> &'static str {
    match kind {
        DiagonalKind::Face => "face",
        DiagonalKind::Body => "body",
    }
}

/// The figures of a diagonal in the table of all.
const OVERVIEW: [&str; 6] =
    ["systematic", "systematic_forward", "systematic_backward", "repeatability", "reversal", "mean_range"];

/// The figures of every diagonal, and the largest; beside those of both directions the expanded uncertainty, if a session
/// states contributors.
fn overview(tests: &[DiagonalTest], largest: &[LargestOfDiagonals]) -> Table {
    let is_stated = tests.iter().any(|test| test.read.uncertainty.is_some());
    let has_u = |id: &str| is_stated && OF_DIAGONALS.contains(&id);
    let figures_of = |figures: &[Figure]| -> Vec<Cell> {
        let cells = OVERVIEW.iter().flat_map(|id| {
            let [value, u] = value_and_expanded_u(figures, id);
            std::iter::once(value).chain(has_u(id).then_some(u))
        });
        cells.collect()
    };
    let rows = tests.iter().map(|test| {
        let mut cells = cells![&test.test, named(test), Cell::fixed(test.length_mm, 3)];
        cells.extend(figures_of(&test.read.figures));
        cells
    });
    let last = largest.iter().map(|one| {
        let step = if one.in_turn { " in steps" } else { "" };
        let words = format!("largest of {} {} diagonals{step}", one.tests.len(), kind(one.kind));
        let mut cells = cells!["", words, Cell::or_dash(None)];
        cells.extend(figures_of(&one.figures));
        cells
    });
    let mut columns = vec![words("test"), words("diagonal"), numbers("length, mm")];
    for definition in OVERVIEW.iter().filter_map(|id| POSITIONING.iter().find(|definition| definition.id == *id)) {
        let is_first = definition.id == OVERVIEW[0];
        let in_unit = if is_first { format!(", {}", unit(&tests[0].read.unit)) } else { String::new() };
        columns.push(numbers(format!("{}{in_unit}", definition.symbol)));
        columns.extend(has_u(definition.id).then(|| numbers("U")));
    }
    Table::new(columns, rows.chain(last)).titled("Diagonals (ISO 230-6)")
}

/// A figure and its expanded uncertainty, k = 2.
fn value_and_expanded_u(figures: &[Figure], id: &str) -> [Cell; 2] {
    let found = find(figures, id);
    let [value, u] = [found.map(|figure| figure.value), found.and_then(|figure| figure.u).map(|u| COVERAGE * u)];
    [value, u].map(|number| Cell::or_dash(number.map(|number| Cell::fixed(number, 2))))
}

/// The contributors to the uncertainty, the deviations at every position and their plot; `along` is the axis of positions.
fn detail(report: &mut Report, read: &Deviations, along: &str, file: String, title: String) {
    if let Some(uncertainty) = &read.uncertainty {
        report.detail(contributors(uncertainty, &read.unit));
    }
    report.detail(positions(read, along).folded(MAX_ROWS));
    let caption = "Means and two standard deviations of the approaches in either direction.";
    report.figures([figure::Figure::new(file, title, caption, plot(read, along))]);
}

fn notes(report: &mut Report, is_uncertainty_stated: bool) {
    report.page(Text::Note(
        "The figures describe the readings without any correction by the fit; s is the standard deviation of approaches in \
         one direction."
            .to_string(),
    ));
    if is_uncertainty_stated {
        report.page(Text::Note(
            "U is the expanded uncertainty of the measurement, k = 2, from the contributors that the session states (ISO/TR \
             230-9)."
                .to_string(),
        ));
    }
}

/// The figures, with the symbols of the standard: bidirectional, in positive, in negative direction; each with its
/// expanded uncertainty, if the session states contributors.
fn figures(read: &Deviations) -> Table {
    let with_u = |[value, u]: [Cell; 2]| std::iter::once(value).chain(read.uncertainty.is_some().then_some(u));
    let rows = POSITIONING.chunk_by(|a, b| a.name == b.name).map(|group| {
        let label = format!("{} {}", group[0].name, group[0].symbol);
        let mut cells = cells![label.trim_end()];
        for direction in 0..3 {
            let id = group.get(direction).map_or("", |definition| definition.id);
            cells.extend(with_u(value_and_expanded_u(&read.figures, id)));
        }
        cells
    });
    let heading = format!("both, {}", unit(&read.unit));
    let mut columns = vec![words("")];
    for name in [heading.as_str(), "↑", "↓"] {
        columns.extend(with_u([name.into(), "U".into()]).map(|heading| numbers(heading.to_string())));
    }
    Table::new(columns, rows)
}

/// The contributors to the uncertainty.
fn contributors(of: &Contributions, in_unit: &str) -> Table {
    let rows = [
        ("device", of.device),
        ("misalignment of the beam", of.misalignment),
        ("temperature", of.temperature),
        ("coefficient of expansion", of.expansion),
        ("environment, one reading", of.environment),
        ("set-up", of.setup),
    ];
    let rows = rows.map(|(name, u)| cells![name, Cell::fixed(u, 2)]);
    let heading = format!("U (k = 2), {}", unit(in_unit));
    Table::new([words("contributor"), numbers(heading)], rows).titled("Contributors to the uncertainty")
}

/// Mean, standard deviation and reversal value at every position.
fn positions(read: &Deviations, along: &str) -> Table {
    let mean = |approach: Option<Approach>| Cell::or_dash(approach.map(|one| Cell::fixed(one.mean, 3)));
    let deviation =
        |approach: Option<Approach>| Cell::or_dash(approach.and_then(|one| one.deviation).map(|s| Cell::fixed(s, 3)));
    let rows = read.positions.iter().map(|position| {
        let reversal = position.forward.zip(position.backward).map(|(forward, backward)| forward.mean - backward.mean);
        cells![
            Cell::fixed(position.at, 4),
            mean(position.forward),
            deviation(position.forward),
            mean(position.backward),
            deviation(position.backward),
            Cell::or_dash(reversal.map(|reversal| Cell::fixed(reversal, 3))),
        ]
    });
    let position = format!("{along}, {}", unit(&read.position_unit));
    let columns = [position.as_str(), "mean ↑", "s ↑", "mean ↓", "s ↓", "B"].map(numbers);
    Table::new(columns, rows).titled(format!("Deviations in {}", unit(&read.unit)))
}

/// Means and ±2s of both directions over the positions.
fn plot(read: &Deviations, along: &str) -> Lines {
    let points = |direction: usize, deviations: f64| -> Vec<(f64, f64)> {
        let at = |position: &Position| {
            let one = [position.forward, position.backward][direction]?;
            Some((position.at, one.mean + deviations * one.deviation.unwrap_or(0.0)))
        };
        read.positions.iter().filter_map(at).collect()
    };
    let series: Vec<Series> = ["forward", "backward"]
        .into_iter()
        .enumerate()
        .flat_map(|(direction, class)| {
            [("mean", 0.0), ("+2s", 2.0), ("−2s", -2.0)].map(|(name, deviations)| {
                Series::new(format!("{class} {name}"), class, Mark::Line, points(direction, deviations))
            })
        })
        .collect();
    let x = Scale::of_axis(span(read.positions.iter().map(|position| position.at)), read.position_unit == "deg");
    let y = Scale::with_zero(span(series.iter().flat_map(|series| series.points.iter().map(|point| point.1))), 6);
    let x = Axis::new(along, &read.position_unit, x);
    Lines::new(x, Axis::new("deviation", &read.unit, y), series)
}
