//! `abbe fit --views`: readings and residuals of an R-test by direction, as a CSV file.

use std::fmt::Write;
use std::path::Path;

use abbe::identify::directions::{View, views};
use abbe::identify::fit::Fit;
use abbe::identify::problem::Problem;
use abbe::model::axis::AxisKind;

use super::failure::Failure;
use super::output;

/// Names of the columns of one view.
const VIEW: [&str; 9] = [
    "dx",
    "dy",
    "dz",
    "x_wise",
    "y_wise",
    "z_wise",
    "radial",
    "tangential",
    "axial",
];

/// Writes the file.
pub fn write(problem: &Problem<'_>, fit: &Fit, path: &Path) -> Result<(), Failure> {
    let machine = &problem.session.machine;
    let mut header = vec!["test".to_string(), "run".to_string()];
    for axis in &machine.axes {
        let unit = match axis.kind {
            AxisKind::Linear => "mm",
            AxisKind::Rotary => "deg",
        };
        header.push(format!("{}_{unit}", axis.name.to_lowercase()));
    }
    header.extend(VIEW.map(|name| format!("{name}_um")));
    header.extend(VIEW.map(|name| format!("residual_{name}_um")));
    let mut text = header.join(",");
    text.push('\n');
    for (test, viewed) in problem.tests.iter().zip(views(problem, fit)?) {
        let Some(readings) = &test.readings else { continue };
        for (row, viewed) in viewed.iter().enumerate() {
            let run = readings.run.get(row).map_or(String::new(), i64::to_string);
            // Writing to a String does not fail.
            let _ = write!(text, "{},{run}", quoted(&test.name));
            for (axis, column) in machine.axes.iter().zip(&readings.positions) {
                let shown = match axis.kind {
                    AxisKind::Linear => column[row],
                    AxisKind::Rotary => column[row].to_degrees(),
                };
                let _ = write!(text, ",{shown:.6}");
            }
            push(&mut text, &viewed.reading);
            push(&mut text, &viewed.residual);
            text.push('\n');
        }
    }
    output::write_whole(path, text.as_bytes())
}

fn push(text: &mut String, view: &View) {
    for mm in view.sensors.iter().chain(&view.wise) {
        let _ = write!(text, ",{:.4}", mm * 1e3);
    }
    match view.turning {
        Some(turning) => turning.iter().for_each(|mm| {
            let _ = write!(text, ",{:.4}", mm * 1e3);
        }),
        None => text.push_str(",,,"),
    }
}

/// A cell of a CSV file: in quotes where it has to be.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_string()
    }
}
