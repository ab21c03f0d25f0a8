//! Foreign files as they were understood: columns, first rows, what was assumed.

use abbe::import::{ImportResult, ImportedTest};
use abbe::model::words::counted;

use super::block::Report;
use super::plausibility;
use super::table::{Cell, Table, cells, words};

/// The report of an import into this session file.
pub fn report(result: &ImportResult, session: &str) -> Report {
    let mut report = Report::new(format!("Import into {session}"));
    report.warnings.clone_from(&result.warnings);
    report.method =
        "Layout, columns and units are guessed from the files; what they leave open, the nominal machine decides."
            .to_string();
    let rows: usize = result.tests.iter().map(|test| test.rows).sum();
    report.opening(
        "",
        [format!(
            "{session}: {} of {}, instrument {}",
            counted(rows, "row"),
            counted(result.tests.len(), "file"),
            result.instrument
        )],
    );
    if let Some([x, y, z]) = result.target_mm {
        report.key(format!(
            "no one states where the target or the ball is: found at [{x}, {y}, {z}] mm in the tool frame; the fit estimates it"
        ));
    }
    for test in &result.tests {
        of_test(&mut report, test);
    }
    plausibility::section(&mut report, &result.plausibility);
    report
}

fn of_test(report: &mut Report, test: &ImportedTest) {
    report.section(&format!("{} → test {}", test.file, test.test));
    let decimal = if test.decimal == "," { "comma" } else { "point" };
    report.key(format!(
        "{}, separator {}, decimal {decimal}, {} above",
        test.encoding,
        test.separator,
        counted(test.skipped_lines, "line")
    ));
    let read_as = |own: &Option<String>, direction: &Option<&str>| match (own, direction) {
        (Some(own), Some(direction)) => format!("{own}, {direction}"),
        (Some(own), None) => own.clone(),
        (None, _) => "–".to_string(),
    };
    let rows = test.columns.iter().map(|column| {
        let unit = match (&column.own, column.unit_is_stated) {
            (None, _) => "",
            (Some(_), true) => "stated",
            (Some(_), false) => "assumed",
        };
        cells![Cell::exact(column.number as f64), &column.name, read_as(&column.own, &column.direction), unit]
    });
    report.key(Table::new([">column", "in the file", "read as", "unit"], rows));
    let headings = test.columns.iter().map(|column| words(read_as(&column.own, &column.direction)));
    let shown = test.first_rows.iter().map(|row| row.iter().map(Cell::from).collect());
    let mut table = Table::new(headings, shown);
    table.title = format!("The first {} of {}", test.first_rows.len(), counted(test.rows, "row"));
    report.key(table);
    for reason in &test.normalised {
        report.key(format!("{reason}: a session reads {} in place of the file", test.data));
    }
}
