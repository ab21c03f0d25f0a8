//! Ball-bar figures of ISO 230-4 and their diagnosis.
//!
//! ISO 230-4:2022 uses the terms circular and radial *error*. The edition of 2005 used *deviation*, and the symbols are
//! from there. The hysteresis is from the edition of 1996.

use abbe::identify::circular::{CircularTest, Diagnosis};
use abbe::identify::figure::{Definition, Figure, IN_BOTH_DIRECTIONS, IN_ONE_DIRECTION, find};

use super::block::{Report, Text};
use super::number::{micrometres, unit};
use super::table::{Cell, Column, Table, cells, numbers, words};

/// Tests that a terminal shows without `--all`.
const MAX_TESTS: usize = 6;

/// The section of the figures and the diagnosis of each test, if there is one.
pub fn section(report: &mut Report, tests: &[CircularTest]) {
    if tests.is_empty() {
        return;
    }
    report.section("Ball-bar figures");
    report.key(summary(tests).titled("Ball-bar figures (ISO 230-4)").folded(MAX_TESTS));
    report.brief(Text::Note("directions, diagnosis and limitations".to_string()));
    report.page(
        "Terms of ISO 230-4:2022, symbols of the edition of 2005 in brackets. The figures describe the readings without \
         any correction by the fit. Centre and radius are those of the least-squares circle.",
    );
    for test in tests {
        report.detail(Text::Heading(heading(test)));
        tables(test).into_iter().for_each(|table| report.detail(table));
        let limitations = test.not_identifiable.iter().map(|line| format!("limitation: {line}"));
        report.detail(Text::List(limitations.collect()));
    }
}

/// The test and its path.
fn heading(test: &CircularTest) -> String {
    let radius = test.radius_mm.map_or(String::new(), |radius| format!(", radius {radius:.1} mm"));
    let feed = test.feed_mm_min.map_or(String::new(), |feed| format!(", {feed:.0} mm/min"));
    let arc = if test.arc_deg < 359.0 { format!(", {:.0}°", test.arc_deg) } else { String::new() };
    let name = test.iso_10791_6.as_ref().map_or(String::new(), |name| format!(", motion {name} of ISO 10791-6"));
    let bar = test.bar_direction.as_ref().map_or(String::new(), |direction| format!(", bar {direction}"));
    format!("{}: circular path of {}{name}{bar}{radius}{feed}{arc}", test.test, test.axes)
}

/// The edition whose names are printed.
const STANDARD: &str = "ISO 230-4:2022";

/// The name and the symbol of a figure, with the edition of an earlier one: `circular error (G)`.
fn heading_of(definition: &Definition) -> String {
    let Definition { symbol, name, standard, .. } = definition;
    match standard.strip_prefix("ISO 230-4:") {
        _ if symbol.is_empty() => name.to_string(),
        Some(edition) if *standard != STANDARD => format!("{name} ({symbol}, edition of {edition})"),
        _ => format!("{name} ({symbol})"),
    }
}

fn cell(figures: &[Figure], definition: &Definition) -> Cell {
    Cell::or_dash(find(figures, definition.id).map(|figure| Cell::fixed(figure.value, 2)))
}

/// The figures of both directions together and the largest fault, one row per test.
fn summary(tests: &[CircularTest]) -> Table {
    let rows = tests.iter().map(|test| {
        let arc =
            if test.arc_deg < 359.0 { format!("{}, {:.0}°", test.axes, test.arc_deg) } else { test.axes.clone() };
        let fault = test
            .diagnosis
            .first()
            .map_or(String::new(), |fault| format!("{} {}, {:.0} %", fault.fault, fault.axes, fault.share_percent));
        let mut cells = cells![&test.test, arc];
        cells.extend(IN_BOTH_DIRECTIONS.iter().map(|definition| cell(&test.figures, definition)));
        cells.push(fault.into());
        cells
    });
    let figures = IN_BOTH_DIRECTIONS.iter().map(|definition| numbers(format!("{}, µm", definition.symbol)));
    let columns = ["test", "path of"].map(words).into_iter().chain(figures).chain([words("largest fault")]);
    let columns: Vec<Column> = columns.collect();
    let has_faults = tests.iter().any(|test| !test.diagnosis.is_empty());
    let count = columns.len() - usize::from(!has_faults);
    Table::new(columns, rows).first_columns(count)
}

/// All tables of a test: each direction, both together, the diagnosis.
fn tables(test: &CircularTest) -> Vec<Table> {
    let mut tables = vec![directions(test), both(test), faults(test)];
    tables.retain(|table| !table.rows.is_empty());
    tables
}

/// One row per direction of the path, with the figures of every standard of which there is one.
fn directions(test: &CircularTest) -> Table {
    let found = || test.directions.iter().flat_map(|direction| &direction.figures);
    let is_shown = |definition: &&Definition| found().any(|own| own.definition.standard == definition.standard);
    let shown: Vec<&Definition> = IN_ONE_DIRECTION.iter().filter(is_shown).collect();
    let rows = test.directions.iter().map(|direction| {
        let mut cells = cells![&direction.direction, direction.runs.to_string()];
        cells.extend(shown.iter().map(|definition| cell(&direction.figures, definition)));
        cells
    });
    let figures = shown.iter().map(|definition| numbers(format!("{}, µm", heading_of(definition))));
    Table::new([words("direction"), numbers("runs")].into_iter().chain(figures), rows)
}

/// The figures of both directions together that the test has.
fn both(test: &CircularTest) -> Table {
    let row = |figure: &Figure| cells![heading_of(figure.definition), Cell::fixed(figure.value, 2)];
    Table::new(["both directions", ">µm"], test.figures.iter().map(row))
}

/// One row per figure of a fault; the first row of a fault has its share.
fn faults(test: &CircularTest) -> Table {
    let columns = ["fault", ">value", ">u", "unit", ">share", ">on the path"];
    let mut table = Table::new(columns, test.diagnosis.iter().flat_map(fault_rows));
    if let (Some(rms), false) = (test.diagnosis_rms_um, test.diagnosis.is_empty()) {
        table.notes.push(format!("residual of the diagnosis: {} rms", micrometres(rms)));
    }
    table
}

fn fault_rows(fault: &Diagnosis) -> Vec<Vec<Cell>> {
    let mut rows = Vec::new();
    for value in &fault.values {
        let [number, u] =
            if value.u > 0.0 { Cell::estimate(value.value, value.u) } else { [Cell::fixed(value.value, 3), "".into()] };
        // The name of a figure at one end of an axis begins with the axis.
        let name = if value.id.starts_with(&fault.axes) {
            format!("{} {}", fault.fault, value.id)
        } else {
            format!("{} {} {}", fault.fault, fault.axes, value.id.replace('_', " "))
        };
        let mut row = cells![name, number, u, unit(&value.unit)];
        if rows.is_empty() {
            row.extend(cells![format!("{:.0} %", fault.share_percent), format!("{:.2} µm", fault.circularity_um)]);
        }
        rows.push(row);
    }
    rows
}
