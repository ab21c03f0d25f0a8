//! The change of the readings by each error alone.

use abbe::identify::patterns::{Pattern, Patterns};
use abbe::model::instrument::channel::labels;
use abbe::model::session::Session;

use super::block::Report;
use super::number::unit;
use super::table::{Cell, Column, Table, cells, numbers, words};

/// The report of patterns.
pub fn report(session: &Session, patterns: &[Pattern]) -> Report {
    let mut report = Report::new(format!("Trace patterns of {}", session.machine.name));
    report.method = "The change of each reading by each error alone, by the exact chain.".to_string();
    report.section("Sizes");
    report.key(sizes(patterns));
    report
}

/// The size of each pattern.
fn sizes(patterns: &[Pattern]) -> Table {
    let rows = patterns.iter().map(|pattern| {
        let size = format!("{} {}", pattern.size, unit(&pattern.unit));
        let [largest, mean, deviation] =
            [pattern.largest_um, pattern.mean_um, pattern.standard_deviation_um].map(|um| Cell::fixed(um, 3));
        cells![&pattern.test, &pattern.error, size, largest, mean, deviation]
    });
    Table::new(["test", "error", ">size", ">largest, µm", ">mean, µm", ">standard deviation, µm"], rows)
}

/// One row per reading and error: test, error and its size, run, positions of the axes, deviation.
pub fn readings(found: &Patterns, session: &Session) -> Table {
    let axes = &session.machine.axes;
    let mut columns: Vec<Column> = ["test", "error", "size", "unit", "run"].map(words).into();
    columns.extend(axes.iter().map(|axis| numbers(axis.column(""))));
    let channels = session.tests.first().map_or(&[][..], |test| test.station.channels());
    columns.extend(labels(channels).into_iter().map(|label| match label {
        "" => numbers("deviation_um"),
        label => numbers(format!("deviation_{label}_um")),
    }));
    let mut rows = Vec::new();
    for pattern in &found.patterns {
        let Some((name, states)) = found.tests.iter().find(|(name, _)| *name == pattern.test) else {
            continue;
        };
        for (row, deviations) in pattern.deviations_um.chunks(states.channels.max(1)).enumerate() {
            let run = states.run.get(row).map_or(String::new(), ToString::to_string);
            let mut cells = cells![name, &pattern.error, Cell::exact(pattern.size), &pattern.unit, run];
            // Rounded to 1e-9 to omit rounding errors of the last digits.
            let shown = |position: f64| (position * 1e9).round() / 1e9 + 0.0;
            let at = axes.iter().zip(&states.positions);
            cells.extend(at.map(|(axis, column)| Cell::exact(shown(axis.kind.to_display(column[row])))));
            cells.extend(deviations.iter().map(|deviation| Cell::fixed(*deviation, 6)));
            rows.push(cells);
        }
    }
    Table::new(columns, rows)
}
