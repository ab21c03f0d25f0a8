//! `abbe fit --views`: readings and residuals of an R-test by direction, as CSV.

use std::path::Path;

use abbe::identify::directions::{DirectionFrame, views};
use abbe::identify::fit::Fit;
use abbe::identify::problem::Problem;

use super::failure::Failure;
use super::output;

/// Columns of one direction frame.
const DIRECTIONS: [&str; 9] = ["dx", "dy", "dz", "x_wise", "y_wise", "z_wise", "radial", "tangential", "axial"];

/// Writes the file.
pub fn write(problem: &Problem, fit: &Fit, path: &Path) -> Result<(), Failure> {
    let machine = &problem.session.machine;
    let mut header = vec!["test".to_string(), "run".to_string()];
    header.extend(machine.axes.iter().map(|axis| axis.column("")));
    header.extend(DIRECTIONS.map(|name| format!("{name}_um")));
    header.extend(DIRECTIONS.map(|name| format!("residual_{name}_um")));
    let mut rows = Vec::new();
    for (test, viewed) in problem.tests.iter().zip(views(problem, fit)?) {
        let Some(readings) = &test.readings else { continue };
        for (row, viewed) in viewed.iter().enumerate() {
            let run = readings.run.get(row).map_or(String::new(), i64::to_string);
            let mut cells = vec![test.name.clone(), run];
            let at = machine.axes.iter().zip(&readings.positions);
            cells.extend(at.map(|(axis, column)| format!("{:.6}", axis.kind.to_display(column[row]))));
            cells.extend(micrometres(&viewed.reading));
            cells.extend(micrometres(&viewed.residual));
            rows.push(cells);
        }
    }
    output::write_whole(path, &output::csv(&header, rows)?)
}

/// The cells of one direction frame. Radial, tangential and axial cells are empty unless exactly one rotary axis moves.
fn micrometres(view: &DirectionFrame) -> Vec<String> {
    let along = view.sensors.iter().chain(&view.wise).map(Some);
    let about = (0..3).map(|k| view.turning.as_ref().map(|turning| &turning[k]));
    along.chain(about).map(|mm| mm.map_or(String::new(), |mm| format!("{:.4}", mm * 1e3))).collect()
}
