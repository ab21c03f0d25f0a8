//! `--residuals FILE`: reading and residual of every reading of the session, as a CSV file.

use std::path::Path;

use abbe::identify::fit::Fit;
use abbe::identify::problem::Problem;

use super::failure::Failure;
use super::output;

/// Writes the file: one row per reading.
///
/// # Errors
/// If the file cannot be written.
pub fn write(problem: &Problem, fit: &Fit, path: &Path) -> Result<(), Failure> {
    let machine = &problem.session.machine;
    let coordinates = problem.coordinates();
    let labels: &[&str] = if coordinates == 3 { &["_x", "_y", "_z"] } else { &[""] };
    let mut header: Vec<String> = ["test", "run", "line"].map(String::from).to_vec();
    header.extend(machine.axes.iter().map(|axis| axis.column("")));
    header.extend(labels.iter().map(|label| format!("reading{label}_mm")));
    header.extend(labels.iter().map(|label| format!("residual{label}_um")));
    header.extend(labels.iter().map(|label| format!("standardised_residual{label}")));
    header.push("counts".into());
    let mut rows = Vec::new();
    for (number, test) in problem.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        for row in 0..readings.rows() {
            let own = row * coordinates..(row + 1) * coordinates;
            let mut cells = vec![
                test.name.clone(),
                readings.run.get(row).map_or(String::new(), i64::to_string),
                readings.line(row).map_or(String::new(), |line| line.to_string()),
            ];
            let at = machine.axes.iter().zip(&readings.positions);
            cells.extend(at.map(|(axis, column)| format!("{:.6}", axis.kind.to_display(column[row]))));
            cells.extend(own.clone().map(|k| {
                let observed = readings.observed.get(k);
                observed.map_or(String::new(), |mm| format!("{mm:.6}"))
            }));
            let residuals = &fit.residuals[number][own];
            cells.extend(residuals.iter().map(|mm| format!("{:.4}", mm * 1e3)));
            cells.extend(residuals.iter().map(|mm| format!("{:.4}", mm / problem.noise.sigma_mm)));
            cells.push(if problem.rejected[number][row] { "outlier" } else { "yes" }.into());
            rows.push(cells);
        }
    }
    output::write_whole(path, &output::csv(&header, rows)?)
}
