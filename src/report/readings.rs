//! Every reading of a session with its residual, for spreadsheets.

use abbe::identify::directions::{DirectionFrame, views};
use abbe::identify::fit::Fit;
use abbe::identify::problem::Problem;
use abbe::model::Diagnostic;
use abbe::model::instrument::channel;
use abbe::model::session::readings::Readings;

use super::table::{Cell, Column, Table, cells, numbers, words};

/// Names of the directions of an R-test.
const DIRECTIONS: [&str; 9] = ["dx", "dy", "dz", "x_wise", "y_wise", "z_wise", "radial", "tangential", "axial"];

/// The first cells of a row: the test and the run.
fn start(test: &str, readings: &Readings, row: usize) -> Vec<Cell> {
    cells![test, readings.run.get(row).map_or(String::new(), i64::to_string)]
}

/// The positions of all axes in a row.
fn positions<'r>(problem: &'r Problem, readings: &'r Readings, row: usize) -> impl Iterator<Item = Cell> + 'r {
    let at = problem.session.machine.axes.iter().zip(&readings.positions);
    at.map(move |(axis, column)| Cell::fixed(axis.kind.to_display(column[row]), 6))
}

/// Columns of the positions of all axes.
fn axes<'r>(problem: &'r Problem) -> impl Iterator<Item = Column> + 'r {
    problem.session.machine.axes.iter().map(|axis| numbers(axis.column("")))
}

/// The channels of all tests, each once: their names in columns, and the units of reading and residual.
fn labels(problem: &Problem) -> Vec<(String, [&'static str; 2])> {
    let mut labels: Vec<(String, [&'static str; 2])> = Vec::new();
    for model in &problem.models {
        for (channel, label) in model.channels().iter().zip(channel::labels(model.channels())) {
            let name = if label.is_empty() { String::new() } else { format!("_{label}") };
            if labels.iter().all(|(known, _)| *known != name) {
                labels.push((name, if channel.is_angle() { ["arcsec"; 2] } else { ["mm", "um"] }));
            }
        }
    }
    labels
}

/// Reading, residual and residual over the noise standard deviation, and whether the reading counts or is an outlier.
pub fn residuals(problem: &Problem, fit: &Fit) -> Table {
    let labels = labels(problem);
    let mut columns: Vec<Column> = ["test", "run", "line"].map(words).into();
    columns.extend(axes(problem));
    columns.extend(labels.iter().map(|(label, [unit, _])| numbers(format!("reading{label}_{unit}"))));
    columns.extend(labels.iter().map(|(label, [_, unit])| numbers(format!("residual{label}_{unit}"))));
    columns.extend(labels.iter().map(|(label, _)| numbers(format!("standardised_residual{label}"))));
    columns.push(words("counts"));
    let mut rows = Vec::new();
    for (number, test) in problem.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        let model = &problem.models[number];
        let channels = model.channels();
        // The column of each channel of this test.
        let own = channel::labels(channels);
        let place = |column: usize| own.iter().position(|label| *label == labels[column].0.trim_start_matches('_'));
        let places: Vec<Option<usize>> = (0..labels.len()).map(place).collect();
        for row in 0..readings.rows() {
            let mut cells = start(&test.name, readings, row);
            cells.push(readings.line(row).map_or(String::new(), |line| line.to_string()).into());
            cells.extend(positions(problem, readings, row));
            let mut column = |value: &dyn Fn(usize, usize) -> Option<f64>, places_of_decimals: usize| {
                cells.extend(places.iter().map(|place| {
                    let found = place.and_then(|channel| value(row * channels.len() + channel, channel));
                    found.map_or("".into(), |value| Cell::fixed(value, places_of_decimals))
                }));
            };
            let display = |channel: usize| channels[channel].unit.displayed().per_internal();
            let read = |k: usize| readings.observed.get(k).copied().filter(|value| !value.is_nan());
            let unit = |channel: usize| if channels[channel].is_angle() { display(channel) } else { 1.0 };
            column(&|k, channel| Some(read(k)? / model.weights()[channel] * unit(channel)), 6);
            let residual = |k: usize| read(k).map(|_| fit.residuals[number][k]);
            column(&|k, channel| Some(residual(k)? / model.weights()[channel] * display(channel)), 4);
            column(&|k, _| Some(residual(k)? / problem.noise.sigma_mm), 4);
            cells.push(if problem.rejected[number][row] { "outlier" } else { "yes" }.into());
            rows.push(cells);
        }
    }
    Table::new(columns, rows)
}

/// Readings and residuals of an R-test by direction.
///
/// # Errors
/// If the session is of another instrument.
pub fn by_direction(problem: &Problem, fit: &Fit) -> Result<Table, Diagnostic> {
    let mut columns: Vec<Column> = ["test", "run"].map(words).into();
    columns.extend(axes(problem));
    columns.extend(DIRECTIONS.map(|name| numbers(format!("{name}_um"))));
    columns.extend(DIRECTIONS.map(|name| numbers(format!("residual_{name}_um"))));
    let mut rows = Vec::new();
    for (test, viewed) in problem.tests.iter().zip(views(problem, fit)?) {
        let Some(readings) = &test.readings else { continue };
        rows.extend(viewed.iter().enumerate().map(|(row, viewed)| {
            let mut cells = start(&test.name, readings, row);
            cells.extend(positions(problem, readings, row));
            cells.extend(micrometres(&viewed.reading));
            cells.extend(micrometres(&viewed.residual));
            cells
        }));
    }
    Ok(Table::new(columns, rows))
}

/// The cells of one direction frame. Radial, tangential and axial cells are empty unless exactly one rotary axis moves.
fn micrometres(view: &DirectionFrame) -> Vec<Cell> {
    let along = view.sensors.iter().chain(&view.wise).map(Some);
    let about = (0..3).map(|k| view.turning.as_ref().map(|turning| &turning[k]));
    along.chain(about).map(|mm| mm.map_or("".into(), |mm| Cell::fixed(mm * 1e3, 4))).collect()
}
