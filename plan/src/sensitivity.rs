//! The sensitivity of the readings to each parameter (largest, root mean square, along each test), and the leverage of
//! the readings.

use faer::Mat;

use super::results::{Curve, Sensitivity};
use abbe_identify::numerics::parallel;
use abbe_identify::problem::{Problem, RowBlock};
use abbe_model::Diagnostic;

/// Maximum number of points of a curve.
const CURVE_POINTS: usize = 60;

/// Sensitivities to every parameter, internal units (mm of reading per mm or rad), and the leverages of the readings.
pub struct Sensitivities {
    /// By parameter: the largest with its sign, its test, and the root mean square.
    pub summary: Vec<(f64, usize, f64)>,
    /// By parameter and test: along the first run.
    pub curves: Vec<Vec<Vec<f64>>>,
    /// Mean over greatest leverage. The leverage `xᵀ Cov x` of a whitened row `x` is the response of the fitted value
    /// to that reading.
    pub g_efficiency: f64,
}

struct BlockSensitivity {
    test: usize,
    largest: Vec<f64>,
    squares: Vec<f64>,
    curve: Vec<Vec<f64>>,
    leverage_sum: f64,
    leverage_most: f64,
    rows: usize,
}

/// One pass over the rows of a problem.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn sensitivities(problem: &Problem, beta: &[f64], covariance: &Mat<f64>) -> Result<Sensitivities, Diagnostic> {
    let values = problem.slot_values(beta);
    let parameters = beta.len();
    let blocks = problem.blocks();
    let parts = parallel::map(blocks.len(), &|k| {
        let rows = problem.rows(&values, &blocks[k])?;
        Ok(of_block(problem, &blocks[k], &rows, parameters, covariance))
    });
    let parts: Vec<BlockSensitivity> = parts.into_iter().collect::<Result<_, Diagnostic>>()?;
    let tests = problem.tests.len();
    let mut summary = vec![(0.0_f64, 0_usize, 0.0_f64); parameters];
    let mut curves = vec![vec![Vec::new(); tests]; parameters];
    let (mut sum, mut most, mut rows) = (0.0, 0.0_f64, 0);
    for part in parts {
        for j in 0..parameters {
            if part.largest[j].abs() > summary[j].0.abs() {
                (summary[j].0, summary[j].1) = (part.largest[j], part.test);
            }
            summary[j].2 += part.squares[j];
            curves[j][part.test].extend_from_slice(&part.curve[j]);
        }
        sum += part.leverage_sum;
        most = most.max(part.leverage_most);
        rows += part.rows;
    }
    for (_, _, rms) in &mut summary {
        *rms = (*rms / rows.max(1) as f64).sqrt();
    }
    let g_efficiency = if most > 0.0 { sum / rows.max(1) as f64 / most } else { 0.0 };
    Ok(Sensitivities { summary, curves, g_efficiency })
}

fn of_block(
    problem: &Problem,
    block: &RowBlock,
    rows: &Mat<f64>,
    parameters: usize,
    covariance: &Mat<f64>,
) -> BlockSensitivity {
    let channels = problem.channels(block.test);
    let first_run = problem.tests[block.test]
        .readings
        .as_ref()
        .filter(|readings| !readings.run.is_empty())
        .and_then(|readings| readings.runs().first().cloned())
        .unwrap_or(0..0);
    let every = first_run.len().div_ceil(CURVE_POINTS).max(1);
    let picked: Vec<usize> = (0..block.rows.len())
        .filter(|i| {
            let row = block.rows.start + i;
            first_run.contains(&row) && (row - first_run.start).is_multiple_of(every)
        })
        .collect();
    let mut largest = vec![0.0_f64; parameters];
    let mut squares = vec![0.0; parameters];
    let mut curve = vec![Vec::with_capacity(picked.len()); parameters];
    for j in 0..parameters {
        for i in 0..rows.nrows() {
            let value = rows[(i, j)];
            if value.abs() > largest[j].abs() {
                largest[j] = value;
            }
            squares[j] += value * value;
        }
        for i in &picked {
            curve[j].push(match channels {
                1 => rows[(*i, j)],
                _ => (0..channels).map(|c| rows[(i * channels + c, j)].powi(2)).sum::<f64>().sqrt(),
            });
        }
    }
    let (white, _) = problem.whiten(rows, block);
    let spread = white.as_ref().subcols(0, parameters) * covariance;
    let leverages = (0..white.nrows())
        .map(|i| (0..parameters).map(|j| spread[(i, j)] * white[(i, j)]).sum::<f64>())
        .collect::<Vec<f64>>();
    BlockSensitivity {
        test: block.test,
        largest,
        squares,
        curve,
        leverage_sum: leverages.iter().sum(),
        leverage_most: leverages.iter().copied().fold(0.0, f64::max),
        rows: rows.nrows(),
    }
}

/// The summary of a parameter in display units: µm of reading per display unit.
pub fn reported(problem: &Problem, found: &Sensitivities, parameter: usize) -> Sensitivity {
    let (largest, test, rms) = found.summary[parameter];
    let scale = display_scale(problem, parameter);
    Sensitivity {
        largest: largest * scale,
        largest_in_test: problem.tests[test].name.clone(),
        rms: rms * scale,
        unit: format!("um/{}", problem.parameters.list[parameter].unit.name),
    }
}

/// The curves of a parameter in display units, without tests that do not depend on it.
pub fn curves(problem: &Problem, found: &Sensitivities, parameter: usize) -> Vec<Curve> {
    let scale = display_scale(problem, parameter);
    found.curves[parameter]
        .iter()
        .enumerate()
        .filter(|(_, values)| values.iter().any(|value| value.abs() > MIN_SENSITIVITY))
        .map(|(test, values)| Curve {
            test: problem.tests[test].name.clone(),
            values: values.iter().map(|value| value * scale).collect(),
        })
        .collect()
}

/// Sensitivities below this value are rounding errors, mm per mm or rad.
const MIN_SENSITIVITY: f64 = 1e-9;

/// Converts mm of reading per internal unit into µm per display unit.
fn display_scale(problem: &Problem, parameter: usize) -> f64 {
    1e3 / problem.parameters.list[parameter].unit.display_per_internal
}
