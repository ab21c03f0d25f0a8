//! Figures of the standards: of ball bars (ISO 230-4) with their diagnosis, of positioning (ISO 230-2), of diagonals
//! (ISO 230-6), of straightness (ISO 230-1); their tables and plots.
//!
//! ISO 230-4:2022 uses the terms circular and radial *error*. The edition of 2005 used *deviation*, and the symbols are
//! from there. The hysteresis is from the edition of 1996.

use abbe::identify::circular::{CircularTest, Diagnosis};
use abbe::identify::figure::{
    Definition, Figure as StandardFigure, IN_BOTH_DIRECTIONS, IN_ONE_DIRECTION, OF_DIAGONALS, POSITIONING,
    STRAIGHTNESS, find,
};
use abbe::identify::positioning::diagonal::{DiagonalKind, DiagonalTest, LargestOfDiagonals};
use abbe::identify::positioning::{Approach, COVERAGE, Contributions, Deviations, Position, PositioningTest};
use abbe::identify::straightness::{StraightnessPosition, StraightnessTest};

use super::block::{Report, Text};
use super::figure::Figure;
use super::figure::lines::{Axis, Lines, Mark, Series};
use super::figure::scale::{Scale, span};
use super::number::{micrometres, unit};
use super::table::{Cell, Column, Table, cells, numbers, words};

/// Tests that a terminal shows without `--all`.
const MAX_TESTS: usize = 6;

/// The section of the figures and the diagnosis of each test, if there is one.
pub fn circular(report: &mut Report, tests: &[CircularTest]) {
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

fn cell(figures: &[StandardFigure], definition: &Definition) -> Cell {
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
    let row = |figure: &StandardFigure| cells![heading_of(figure.definition), Cell::fixed(figure.value, 2)];
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

/// Positions that a terminal shows without `--all`.
const MAX_ROWS: usize = 12;

/// The section of the figures of every test, if there is one.
pub fn positioning(report: &mut Report, tests: &[PositioningTest]) {
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
    let figures_of = |figures: &[StandardFigure]| -> Vec<Cell> {
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
fn value_and_expanded_u(figures: &[StandardFigure], id: &str) -> [Cell; 2] {
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
    report.figures([Figure::new(file, title, caption, plot(read, along))]);
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

/// The section of the figures of every test, if there is one.
pub fn straightness(report: &mut Report, tests: &[StraightnessTest]) {
    if tests.is_empty() {
        return;
    }
    report.section("Straightness figures");
    let row = |test: &StraightnessTest| {
        let mut cells = cells![&test.test, &test.axis, &test.channel];
        cells.extend(test.figures.iter().map(|figure| Cell::fixed(figure.value, 2)));
        cells
    };
    let figures = STRAIGHTNESS.iter().map(|definition| numbers(format!("{}, µm", definition.name)));
    let columns = ["test", "axis", "direction"].map(words).into_iter().chain(figures);
    report.key(Table::new(columns, tests.iter().map(row)).titled("Straightness error (ISO 230-1)"));
    report.figures(tests.iter().map(straightness_plot));
    report.page(Text::Note(
        "The straightness error is the range of the mean deviations about a line: that of least squares, or that through the \
         first and the last position. The figures describe the readings without any correction by the fit."
            .to_string(),
    ));
}

/// The deviations from both lines over the positions.
fn straightness_plot(test: &StraightnessTest) -> Figure {
    let points = |of: fn(&StraightnessPosition) -> f64| -> Vec<(f64, f64)> {
        test.positions.iter().map(|position| (position.at_mm, of(position))).collect()
    };
    let series = vec![
        Series::new("least squares", "forward", Mark::Line, points(|position| position.least_squares_um)),
        Series::new("end points", "backward", Mark::Line, points(|position| position.end_points_um)),
    ];
    let x = Scale::of_axis(span(test.positions.iter().map(|position| position.at_mm)), false);
    let y = Scale::with_zero(span(series.iter().flat_map(|series| series.points.iter().map(|point| point.1))), 6);
    let lines = Lines::new(Axis::new(&test.axis, "mm", x), Axis::new("deviation", "um", y), series);
    Figure::new(
        format!("straightness-{}-{}", test.test, test.channel),
        format!("{}: {} straightness of {}", test.test, test.channel, test.axis),
        "Means of the readings less the line of least squares, and less the line through the end points.",
        lines,
    )
}
