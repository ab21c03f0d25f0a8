//! Sensitivity of each test to each error: `∂L/∂error` along the first run (as in Jiang 2014, Figs. 3.7, 3.8). For
//! poses, which have no path, its root mean square.
//!
//! Jiang (2014): X. Jiang, *Characterising Geometric Errors in Rotary Axes of 5-axis Machine Tools*, PhD thesis,
//! University of Birmingham.

use abbe_model::Diagnostic;
use abbe_model::sensitivity::TestModel;

use super::abscissa::Abscissa;
use crate::linear::is_of_interest;
use crate::parameters::Parameter;
use crate::problem::{Problem, RowBlock};

/// Maximum number of points along a run.
const MAX_POINTS: usize = 181;
/// Sensitivity below which an error does not affect a test, µm per unit. Smaller values are second-order contributions
/// of other errors.
const MIN_SENSITIVITY_UM: f64 = 1e-3;

/// The sensitivities of one test.
#[derive(Clone, Debug)]
pub struct TestSensitivities {
    /// Its name.
    pub test: String,
    /// Its abscissa, thinned as the columns.
    pub way: Abscissa,
    /// The channel of the columns; `None` if a reading has only one.
    pub channel: Option<&'static str>,
    /// The errors that affect the test.
    pub columns: Vec<Sensitivity>,
}

/// The sensitivity of one test to one error.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    /// The error.
    pub id: String,
    /// Its unit.
    pub unit: String,
    /// µm per unit: along the abscissa, or one root mean square.
    pub values: Vec<f64>,
}

/// The sensitivity of the tests' first runs to every error to be estimated, at the parameters `beta`; for vector
/// readings channel by channel.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn sensitivities(problem: &Problem, beta: &[f64]) -> Result<Vec<TestSensitivities>, Diagnostic> {
    let values = problem.slot_values(beta);
    let list = &problem.parameters.list;
    let mut of_tests = Vec::new();
    for (number, test) in problem.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        let Some(run) = readings.runs().first().cloned() else {
            continue;
        };
        let every = run.len().div_ceil(MAX_POINTS).max(1);
        let mut picked: Vec<usize> = (0..run.len()).step_by(every).collect();
        // A closed path has to close.
        if picked.last() != Some(&(run.len() - 1)) {
            picked.push(run.len() - 1);
        }
        let mut way = Abscissa::of(&problem.session.machine, readings);
        way.values = picked.iter().map(|i| way.values[run.start + i]).collect();
        let block = RowBlock { test: number, rows: run };
        let rows = problem.rows(&values, &block)?;
        let channels = problem.models[number].channels();
        for (channel, of) in channels.iter().enumerate() {
            let columns = (0..list.len())
                .filter(|j| is_of_interest(&list[*j]))
                .filter_map(|j| {
                    let scale = 1e3 / list[j].unit.display_per_internal;
                    let value = |i: &usize| rows[(i * channels.len() + channel, j)] * scale;
                    let values: Vec<f64> = picked.iter().map(value).collect();
                    let moves = values.iter().any(|value| value.abs() > MIN_SENSITIVITY_UM);
                    moves.then(|| sensitivity(&list[j], values))
                })
                .collect();
            of_tests.push(TestSensitivities {
                test: test.name.clone(),
                way: way.clone(),
                channel: (channels.len() > 1).then_some(of.name),
                columns,
            });
        }
    }
    Ok(of_tests)
}

/// The sensitivity of the poses to every error to be estimated: the root mean square length over all poses, at the
/// parameters `beta`.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn over_poses(problem: &Problem, beta: &[f64]) -> Result<Vec<Sensitivity>, Diagnostic> {
    let values = problem.slot_values(beta);
    let list = &problem.parameters.list;
    let mut squares = vec![0.0; list.len()];
    for block in problem.blocks() {
        let rows = problem.rows(&values, &block)?;
        for (j, square) in squares.iter_mut().enumerate() {
            *square += rows.col(j).squared_norm_l2();
        }
    }
    let readings = problem.models.iter().map(TestModel::rows).sum::<usize>().max(1) as f64;
    let wanted = list.iter().zip(squares).filter(|(parameter, _)| is_of_interest(parameter));
    Ok(wanted
        .map(|(parameter, square)| {
            let rms_um = (square / readings).sqrt() * 1e3 / parameter.unit.display_per_internal;
            sensitivity(parameter, vec![rms_um])
        })
        .filter(|found| found.values[0] > MIN_SENSITIVITY_UM)
        .collect())
}

fn sensitivity(parameter: &Parameter, values: Vec<f64>) -> Sensitivity {
    Sensitivity { id: parameter.id.to_string(), unit: parameter.unit.name.clone(), values }
}
