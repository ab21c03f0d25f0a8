//! Ball-bar figures of ISO 230-4 and their diagnosis as tables.

use abbe::identify::circular::{CircularTest, Diagnosis};

use super::table;

/// The columns of the table of faults.
pub const FAULTS: [&str; 6] = ["fault", "value", "u (k=1)", "unit", "share", "on the path"];

/// The test and its path.
pub fn heading(test: &CircularTest) -> String {
    let radius = test.radius_mm.map_or(String::new(), |radius| format!(", radius {radius:.1} mm"));
    let feed = test.feed_mm_min.map_or(String::new(), |feed| format!(", {feed:.0} mm/min"));
    let arc = if test.arc_deg < 359.0 { format!(", {:.0}°", test.arc_deg) } else { String::new() };
    format!("{}: circular path of {}{radius}{feed}{arc}", test.test, test.axes)
}

/// One row per direction of the path.
pub fn direction_rows(test: &CircularTest) -> Vec<Vec<String>> {
    let directions = test.directions.iter();
    directions
        .map(|direction| {
            vec![
                direction.direction.clone(),
                direction.runs.to_string(),
                format!("{:.2}", direction.circular_deviation_um),
                format!("{:.2}", direction.radial_deviation_max_um),
                format!("{:.2}", direction.radial_deviation_min_um),
            ]
        })
        .collect()
}

/// Circular tests that the first screen shows.
const MAX_TESTS: usize = 6;

/// Prints the figures of circular tests, one row per test; with `all`, the figures of each direction, the diagnosis and
/// its limitations.
pub fn print(tests: &[CircularTest], all: bool) {
    if all {
        tests.iter().for_each(print_in_full);
        return;
    }
    if tests.is_empty() {
        return;
    }
    say!("\nBall-bar figures (ISO 230-4); --all lists directions, diagnosis and limitations:");
    let header = ["test", "path of", "G(b), µm", "D, µm", "H, µm", "largest fault"];
    let with_faults = tests.iter().any(|test| !test.diagnosis.is_empty());
    let columns = header.len() - usize::from(!with_faults);
    let mut rows: Vec<Vec<String>> = tests.iter().take(MAX_TESTS).map(test_row).collect();
    rows.iter_mut().for_each(|row| row.truncate(columns));
    table::print_aligned(&header[..columns], &rows, &[0, 1, 5]);
    if tests.len() > MAX_TESTS {
        say!("  … {} more", tests.len() - MAX_TESTS);
    }
}

/// The figures of a test in one row.
fn test_row(test: &CircularTest) -> Vec<String> {
    let figure = |um: Option<f64>| um.map_or("–".to_string(), |um| format!("{um:.2}"));
    let arc = if test.arc_deg < 359.0 { format!("{}, {:.0}°", test.axes, test.arc_deg) } else { test.axes.clone() };
    let fault = test
        .diagnosis
        .first()
        .map_or(String::new(), |fault| format!("{} {}, {:.0} %", fault.fault, fault.axes, fault.share_percent));
    vec![
        test.test.clone(),
        arc,
        figure(test.bidirectional_circular_deviation_um),
        figure(test.mean_bidirectional_radial_deviation_um),
        figure(test.hysteresis_um),
        fault,
    ]
}

fn print_in_full(test: &CircularTest) {
    say!("\n{}", heading(test));
    let rows = direction_rows(test);
    table::print(&["direction", "runs", "G, µm", "F max, µm", "F min, µm"], &rows);
    if let (Some(both), Some(mean), Some(hysteresis)) =
        (test.bidirectional_circular_deviation_um, test.mean_bidirectional_radial_deviation_um, test.hysteresis_um)
    {
        say!("  both directions: G(b) {both:.2} µm, D {mean:.2} µm, H {hysteresis:.2} µm");
    }
    if !test.diagnosis.is_empty() {
        let rows: Vec<Vec<String>> = test.diagnosis.iter().flat_map(fault_rows).collect();
        table::print(&FAULTS, &rows);
        if let Some(rms) = test.diagnosis_rms_um {
            say!("  residual of the diagnosis: {} rms", table::micrometres(rms));
        }
    }
    for line in &test.not_identifiable {
        say!("  limitation: {line}");
    }
}

/// One row per figure of a fault; the first row has its share.
pub fn fault_rows(fault: &Diagnosis) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    for value in &fault.values {
        let (number, u) = if value.u > 0.0 {
            table::value_and_u(value.value, value.u)
        } else {
            (format!("{:.3}", value.value), String::new())
        };
        // The name of a figure at one end of an axis begins with the axis.
        let name = if value.id.starts_with(&fault.axes) {
            format!("{} {}", fault.fault, value.id)
        } else {
            format!("{} {} {}", fault.fault, fault.axes, value.id.replace('_', " "))
        };
        let mut row = vec![name, number, u, table::unit(&value.unit)];
        if rows.is_empty() {
            row.push(format!("{:.0} %", fault.share_percent));
            row.push(format!("{:.2} µm", fault.circularity_um));
        }
        rows.push(row);
    }
    rows
}
