//! Figures of ISO 230-2: the table and the plot of an axis.

use abbe::identify::positioning::{Approach, PositioningTest};

use super::block::{Report, Text};
use super::figure::lines::{Axis, Lines, Mark, Series};
use super::figure::scale::{Scale, span};
use super::figure::{Chart, Figure};
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
    for test in tests {
        report.key(figures(test).titled(format!("{}: positioning of {} (ISO 230-2)", test.test, test.axis)));
        report.detail(positions(test).folded(MAX_ROWS));
        report.figures([plot(test)]);
    }
    report.page(Text::Note(
        "The figures describe the readings without any correction by the fit; s is the standard deviation of approaches in \
         one direction."
            .to_string(),
    ));
}

/// The figures of an axis, with the symbols of the standard: bidirectional, in positive, in negative direction.
fn figures(test: &PositioningTest) -> Table {
    let of = |value: Option<f64>| Cell::or_dash(value.map(|value| Cell::fixed(value, 2)));
    let rows = [
        ("accuracy A", test.accuracy, test.accuracy_forward, test.accuracy_backward),
        ("repeatability R", test.repeatability, test.repeatability_forward, test.repeatability_backward),
        ("systematic deviation E", test.systematic, test.systematic_forward, test.systematic_backward),
        ("mean bidirectional deviation M", test.mean_range, None, None),
        ("reversal value B", test.reversal, None, None),
        ("mean reversal value", test.mean_reversal, None, None),
    ];
    let rows = rows.map(|(name, both, forward, backward)| cells![name, of(both), of(forward), of(backward)]);
    let heading = unit(&test.unit);
    Table::new([words(""), numbers(format!("both, {heading}")), numbers("↑"), numbers("↓")], rows)
}

/// Mean, standard deviation and reversal value at every position.
fn positions(test: &PositioningTest) -> Table {
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
    let position = format!("{}, {}", test.axis, unit(&test.position_unit));
    let columns = [position.as_str(), "mean ↑", "s ↑", "mean ↓", "s ↓", "B"].map(numbers);
    Table::new(columns, rows).titled(format!("Deviations in {}", unit(&test.unit)))
}

/// Means and ±2s of both directions over the positions.
fn plot(test: &PositioningTest) -> Figure {
    let points = |direction: usize, deviations: f64| -> Vec<(f64, f64)> {
        let at = |position: &abbe::identify::positioning::Position| {
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
    let x = Axis::new(&test.axis, if test.position_unit == "deg" { "deg" } else { "mm" }, x);
    let lines = Lines::new(x, Axis::new("deviation", if test.unit == "um" { "um" } else { "arcsec" }, y), series);
    Figure::new(
        format!("positioning-{}", test.test),
        format!("{}: deviation of {}", test.test, test.axis),
        "Means and two standard deviations of the approaches in either direction.",
        Chart::Lines(lines),
    )
}
