//! What each single error does to each test: `∂L/∂error` along the first run (Figs. 3.7, 3.8 of the thesis are such patterns); of poses, which follow
//! no way, its root mean square.

use abbe_model::instrument::Station;
use abbe_model::sensitivity::TestModel;

use super::abscissa::Abscissa;
use crate::error::IdentifyError;
use crate::parameters::Parameter;
use crate::plan::linear::is_of_interest;
use crate::problem::{Block, Problem};

/// Points along a run at most.
const MAX_POINTS: usize = 181;
/// µm of reading a unit below which an error does nothing to a test: what other errors make of it, second order, is not its pattern.
const NOTHING: f64 = 1e-3;

/// The sensitivities of one test.
#[derive(Clone, Debug)]
pub struct TestSensitivities {
    /// Its name.
    pub test: String,
    /// What it goes along, thinned like the columns.
    pub way: Abscissa,
    /// Which of a reading's three coordinates the columns are of; `None` for a length.
    pub coordinate: Option<&'static str>,
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
    /// µm of reading a unit: along the way, or one root mean square.
    pub values: Vec<f64>,
}

/// The sensitivity to every error that is to be identified along the tests' runs, at the values `beta` of the unknowns; of three coordinates one after the other.
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
        let every = run.len().div_ceil(MAX_POINTS).max(1);
        let mut picked: Vec<usize> = (0..run.len()).step_by(every).collect();
        // A closed trace has to close.
        if picked.last() != Some(&(run.len() - 1)) {
            picked.push(run.len() - 1);
        }
        let mut way = Abscissa::of(&problem.session.machine, readings);
        way.values = picked.iter().map(|i| way.values[run.start + i]).collect();
        let block = Block {
            test: number,
            rows: run,
        };
        let rows = problem.rows(&values, &block)?;
        let names = names(&test.station);
        for coordinate in 0..coordinates {
            let columns = (0..list.len())
                .filter(|j| is_of_interest(&list[*j]))
                .filter_map(|j| {
                    let scale = 1e3 / list[j].unit.display_per_internal;
                    let value = |i: &usize| rows[(i * coordinates + coordinate, j)] * scale;
                    let values: Vec<f64> = picked.iter().map(value).collect();
                    let moves = values.iter().any(|value| value.abs() > NOTHING);
                    moves.then(|| sensitivity(&list[j], values))
                })
                .collect();
            of_tests.push(TestSensitivities {
                test: test.name.clone(),
                way: way.clone(),
                coordinate: (coordinates > 1).then(|| names[coordinate]),
                columns,
            });
        }
    }
    Ok(of_tests)
}

/// The root mean square over all poses of the length by which every error that is to be identified moves a reading, at the values `beta` of the unknowns.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn over_poses(problem: &Problem<'_>, beta: &[f64]) -> Result<Vec<Sensitivity>, IdentifyError> {
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
    let wanted = list
        .iter()
        .zip(squares)
        .filter(|(parameter, _)| is_of_interest(parameter));
    Ok(wanted
        .map(|(parameter, square)| {
            let rms_um = (square / readings).sqrt() * 1e3 / parameter.unit.display_per_internal;
            sensitivity(parameter, vec![rms_um])
        })
        .filter(|found| found.values[0] > NOTHING)
        .collect())
}

fn sensitivity(parameter: &Parameter, values: Vec<f64>) -> Sensitivity {
    Sensitivity {
        id: parameter.id.clone(),
        unit: parameter.unit.name.clone(),
        values,
    }
}

/// What the coordinates of a vector are called.
fn names(station: &Station<f64>) -> [&'static str; 3] {
    match station {
        Station::RTest(rtest) if rtest.sensors.is_some() => ["du", "dv", "dw"],
        Station::RTest(_) => ["dx", "dy", "dz"],
        _ => ["x", "y", "z"],
    }
}
