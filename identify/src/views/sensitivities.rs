//! What each single error does to the trace of each test: `∂L/∂error` along the first run (Figs. 3.7, 3.8 of the thesis are such patterns).

use super::way::Way;
use crate::error::IdentifyError;
use crate::plan::linear::is_wanted;
use crate::problem::{Block, Problem};

/// Points along a run at most.
const MOST_POINTS: usize = 181;
/// µm of reading a unit below which an error does nothing to a test: what other errors make of it, second order, is not its pattern.
const NOTHING: f64 = 1e-3;

/// The sensitivities of one test.
#[derive(Clone, Debug)]
pub struct TestSensitivities {
    /// Its name.
    pub test: String,
    /// What it goes along, thinned like the columns.
    pub way: Way,
    /// The errors that move it.
    pub columns: Vec<Sensitivity>,
}

/// One error's sensitivity along one test.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    /// The error.
    pub id: String,
    /// Its unit.
    pub unit: String,
    /// µm of reading a unit, along the way; for three coordinates the length.
    pub values: Vec<f64>,
}

/// The sensitivity to every error that is to be identified, at the values `beta` of the unknowns.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn sensitivities(problem: &Problem<'_>, beta: &[f64]) -> Result<Vec<TestSensitivities>, IdentifyError> {
    let values = problem.slot_values(beta);
    let coordinates = problem.coordinates();
    let list = &problem.parameters.list;
    let mut of_tests = Vec::new();
    for (number, test) in problem.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        let Some(run) = readings.runs().first().cloned() else {
            continue;
        };
        let every = run.len().div_ceil(MOST_POINTS).max(1);
        let mut picked: Vec<usize> = (0..run.len()).step_by(every).collect();
        // A closed trace has to close.
        if picked.last() != Some(&(run.len() - 1)) {
            picked.push(run.len() - 1);
        }
        let mut way = Way::of(&problem.session.machine, readings);
        way.values = picked.iter().map(|i| way.values[run.start + i]).collect();
        let block = Block {
            test: number,
            rows: run,
        };
        let rows = problem.rows(&values, &block)?;
        let columns = (0..list.len())
            .filter(|j| is_wanted(&list[*j]))
            .filter_map(|j| {
                let scale = 1e3 / list[j].unit.per_inside;
                let value = |i: &usize| {
                    if coordinates == 1 {
                        return rows[(*i, j)] * scale;
                    }
                    let square = |c: usize| rows[(i * coordinates + c, j)].powi(2);
                    (0..coordinates).map(square).sum::<f64>().sqrt() * scale
                };
                let values: Vec<f64> = picked.iter().map(value).collect();
                let moves = values.iter().any(|value| value.abs() > NOTHING);
                moves.then(|| Sensitivity {
                    id: list[j].id.clone(),
                    unit: list[j].unit.name.clone(),
                    values,
                })
            })
            .collect();
        of_tests.push(TestSensitivities {
            test: test.name.clone(),
            way,
            columns,
        });
    }
    Ok(of_tests)
}
