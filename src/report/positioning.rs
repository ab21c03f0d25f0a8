//! Figures of ISO 230-2 and ISO 230-6: the table and the plot of an axis, and of a diagonal.

use abbe::identify::positioning::diagonal::{DiagonalKind, DiagonalTest, LargestOfDiagonals};
use abbe::identify::positioning::{Approach, FigureUncertainties, Figures, Position, PositioningTest};

use super::block::{Report, Text};
use super::figure::lines::{Axis, Lines, Mark, Series};
use super::figure::scale::{Scale, span};
use super::figure::{Chart, Figure};
use super::number::unit;
use super::table::{Cell, Table, cells, numbers, words};

/// Positions that a terminal shows without `--all`.
const MAX_ROWS: usize = 12;

/// What has been read at positions of a way: an axis or a diagonal.
struct Way<'t> {
    test: &'t str,
    /// `X`, `XYZ PPP`.
    name: String,
    unit: &'t str,
    position_unit: &'t str,
    positions: &'t [Position],
    figures: &'t Figures,
    uncertainty: Option<&'t FigureUncertainties>,
}

/// The section of the figures of every test, if there is one.
pub fn section(report: &mut Report, tests: &[PositioningTest]) {
    if tests.is_empty() {
        return;
    }
    report.section("Positioning figures");
    for test in tests {
        let way = Way {
            test: &test.test,
            name: test.axis.clone(),
            unit: &test.unit,
            position_unit: &test.position_unit,
            positions: &test.positions,
            figures: &test.figures,
            uncertainty: test.uncertainty.as_ref(),
        };
        report.key(figures(&way).titled(format!("{}: positioning of {} (ISO 230-2)", test.test, test.axis)));
        detail(report, &way, format!("positioning-{}", test.test));
    }
    notes(report, tests.iter().any(|test| test.uncertainty.is_some()));
}

/// The section of the figures of every diagonal, if there is one.
pub fn diagonals(report: &mut Report, tests: &[DiagonalTest], largest: &[LargestOfDiagonals]) {
    if tests.is_empty() {
        return;
    }
    report.section("Figures of diagonals");
    report.key(overview(tests, largest));
    for test in tests {
        let way = Way {
            test: &test.test,
            name: named(test),
            unit: &test.unit,
            position_unit: "mm",
            positions: &test.positions,
            figures: &test.figures,
            uncertainty: test.uncertainty.as_ref(),
        };
        report.detail(figures(&way).titled(format!("{}: {}", test.test, way.name)));
        detail(report, &way, format!("diagonal-{}", test.test));
    }
    notes(report, tests.iter().any(|test| test.uncertainty.is_some()));
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

/// The figures of every diagonal, and the largest; E, R, B and M with their expanded uncertainties, if a session states
/// contributors.
fn overview(tests: &[DiagonalTest], largest: &[LargestOfDiagonals]) -> Table {
    let of = |value: Option<f64>| Cell::or_dash(value.map(|value| Cell::fixed(value, 2)));
    let is_stated = tests.iter().any(|test| test.uncertainty.is_some());
    let with = |value: Option<f64>, u: Option<f64>| {
        let u = is_stated.then(|| of(u));
        std::iter::once(of(value)).chain(u)
    };
    let row = |test: &DiagonalTest| {
        let (found, u) = (test.figures, test.uncertainty.map(|uncertainty| uncertainty.figures).unwrap_or_default());
        let mut cells = cells![&test.test, named(test), Cell::fixed(test.length_mm, 3)];
        cells.extend(with(found.systematic, u.systematic));
        cells.extend([found.systematic_forward, found.systematic_backward].map(of));
        cells.extend(with(found.repeatability, u.repeatability));
        cells.extend(with(found.reversal, u.reversal));
        cells.extend(with(found.mean_range, u.mean_range));
        cells
    };
    let last = largest.iter().map(|one| {
        let step = if one.in_turn { " in steps" } else { "" };
        let words = format!("largest of {} {} diagonals{step}", one.tests.len(), kind(one.kind));
        let mut cells = cells!["", words, Cell::or_dash(None)];
        cells.extend(with(one.systematic, None));
        cells.extend([None, None].map(of));
        cells.extend([one.repeatability, one.reversal, one.mean_range].into_iter().flat_map(|value| with(value, None)));
        cells
    });
    let e = format!("E, {}", unit(&tests[0].unit));
    let named = |name: &str| [Some(name.to_string()), is_stated.then(|| "U".to_string())].into_iter().flatten();
    let mut columns = vec![words("test"), words("diagonal"), numbers("length, mm")];
    columns.extend(
        named(&e).chain(["E↑".into(), "E↓".into()]).chain(["R", "B", "M"].into_iter().flat_map(named)).map(numbers),
    );
    Table::new(columns, tests.iter().map(row).chain(last)).titled("Diagonals (ISO 230-6)")
}

fn detail(report: &mut Report, way: &Way<'_>, name: String) {
    if let Some(uncertainty) = way.uncertainty {
        report.detail(contributors(uncertainty, way.unit));
    }
    report.detail(positions(way).folded(MAX_ROWS));
    report.figures([plot(way, name)]);
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
fn figures(way: &Way<'_>) -> Table {
    let rows = |of: &Figures| {
        [
            ("accuracy A", [of.accuracy, of.accuracy_forward, of.accuracy_backward]),
            ("repeatability R", [of.repeatability, of.repeatability_forward, of.repeatability_backward]),
            ("systematic deviation E", [of.systematic, of.systematic_forward, of.systematic_backward]),
            ("mean bidirectional deviation M", [of.mean_range, None, None]),
            ("reversal value B", [of.reversal, None, None]),
            ("mean reversal value", [of.mean_reversal, None, None]),
        ]
    };
    let cell = |value: Option<f64>| Cell::or_dash(value.map(|value| Cell::fixed(value, 2)));
    let heading = format!("both, {}", unit(way.unit));
    let names = [heading.as_str(), "↑", "↓"];
    let Some(uncertainty) = way.uncertainty else {
        let rows = rows(way.figures)
            .map(|(name, [both, forward, backward])| cells![name, cell(both), cell(forward), cell(backward)]);
        return Table::new([words("")].into_iter().chain(names.map(numbers)), rows);
    };
    let expanded = rows(&uncertainty.figures);
    let rows = rows(way.figures).into_iter().zip(expanded).map(|((name, values), (_, u))| {
        let [both, forward, backward] = values.map(cell);
        let [u_both, u_forward, u_backward] = u.map(cell);
        cells![name, both, u_both, forward, u_forward, backward, u_backward]
    });
    let columns = names.into_iter().flat_map(|name| [numbers(name), numbers("U")]);
    Table::new([words("")].into_iter().chain(columns), rows)
}

/// The contributors to the uncertainty.
fn contributors(of: &FigureUncertainties, in_unit: &str) -> Table {
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
fn positions(test: &Way<'_>) -> Table {
    let mean = |approach: Option<Approach>| Cell::or_dash(approach.map(|one| Cell::fixed(one.mean, 3)));
    let deviation =
        |approach: Option<Approach>| Cell::or_dash(approach.and_then(|one| one.deviation).map(|s| Cell::fixed(s, 3)));
    let rows = test.positions.iter().map(|position| {
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
    let position = format!("{}, {}", axis(test), unit(test.position_unit));
    let columns = [position.as_str(), "mean ↑", "s ↑", "mean ↓", "s ↓", "B"].map(numbers);
    Table::new(columns, rows).titled(format!("Deviations in {}", unit(test.unit)))
}

/// The name of the axis of positions.
fn axis<'w>(way: &'w Way<'_>) -> &'w str {
    if way.name.contains(' ') { "distance" } else { &way.name }
}

/// Means and ±2s of both directions over the positions.
fn plot(test: &Way<'_>, name: String) -> Figure {
    let points = |direction: usize, deviations: f64| -> Vec<(f64, f64)> {
        let at = |position: &Position| {
            let one = [position.forward, position.backward][direction]?;
            Some((position.at, one.mean + deviations * one.deviation.unwrap_or(0.0)))
        };
        test.positions.iter().filter_map(at).collect()
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
    let x = Scale::of_axis(span(test.positions.iter().map(|position| position.at)), test.position_unit == "deg");
    let y = Scale::with_zero(span(series.iter().flat_map(|series| series.points.iter().map(|point| point.1))), 6);
    let x = Axis::new(axis(test), if test.position_unit == "deg" { "deg" } else { "mm" }, x);
    let lines = Lines::new(x, Axis::new("deviation", if test.unit == "um" { "um" } else { "arcsec" }, y), series);
    Figure::new(
        name,
        format!("{}: deviation of {}", test.test, test.name),
        "Means and two standard deviations of the approaches in either direction.",
        Chart::Lines(lines),
    )
}
