//! Ball-bar figures as a table: the words and units that ball-bar users know.

use abbe::identify::circular::{CircularTest, Diagnosis};

use super::table;

/// The columns of the table of faults.
pub const FAULTS: [&str; 6] = ["fault", "value", "u (k=1)", "unit", "share", "on the path"];

/// Which test it is, and its path.
pub fn heading(test: &CircularTest) -> String {
    let radius = test
        .radius_mm
        .map_or(String::new(), |radius| format!(", radius {radius:.1} mm"));
    let feed = test
        .feed_mm_min
        .map_or(String::new(), |feed| format!(", {feed:.0} mm/min"));
    let arc = if test.arc_deg < 359.0 {
        format!(", {:.0}°", test.arc_deg)
    } else {
        String::new()
    };
    format!("{}: circular path of {}{radius}{feed}{arc}", test.test, test.axes)
}

/// A row for each direction in which the path was run.
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

/// Prints the figures of every circular test.
pub fn print(tests: &[CircularTest]) {
    for test in tests {
        say!("\n{}", heading(test));
        let rows = direction_rows(test);
        table::print(&["direction", "runs", "G, µm", "F max, µm", "F min, µm"], &rows);
        if let (Some(both), Some(mean), Some(hysteresis)) = (
            test.bidirectional_circular_deviation_um,
            test.mean_bidirectional_radial_deviation_um,
            test.hysteresis_um,
        ) {
            say!("  both: G(b) {both:.2} µm, D {mean:.2} µm, H {hysteresis:.2} µm");
        }
        if !test.diagnosis.is_empty() {
            let rows: Vec<Vec<String>> = test.diagnosis.iter().flat_map(fault_rows).collect();
            table::print(&FAULTS, &rows);
            if let Some(rms) = test.diagnosis_rms_um {
                say!("  residual: {} rms", table::micrometres(rms));
            }
        }
        for line in &test.not_identifiable {
            say!("  not told: {line}");
        }
    }
}

/// A row for each figure of a fault; its share beside the first.
pub fn fault_rows(fault: &Diagnosis) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    for value in &fault.values {
        let (number, u) = if value.u > 0.0 {
            table::value_and_u(value.value, value.u)
        } else {
            (format!("{:.3}", value.value), String::new())
        };
        // A figure at an end of an axis names the axis itself.
        let name = if value.id.starts_with(&fault.axes) {
            format!("{} {}", fault.fault, value.id)
        } else {
            format!("{} {} {}", fault.fault, fault.axes, value.id.replace('_', " "))
        };
        let mut row = vec![name, number, u, value.unit.replace("um", "µm")];
        if rows.is_empty() {
            row.push(format!("{:.0} %", fault.share_percent));
            row.push(format!("{:.2} µm", fault.circularity_um));
        }
        rows.push(row);
    }
    rows
}
