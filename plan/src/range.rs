//! The smallest range of a sweep, about its middle, at which no uncertainty doubles.

use faer::Mat;
use schemars::JsonSchema;
use serde::Serialize;

use abbe_identify::linear::{Linearisation, is_of_interest};
use abbe_identify::problem::Problem;
use abbe_identify::results::Interval;
use abbe_model::Diagnostic;

/// How far a sweep can shrink.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Shrinkage {
    /// The test.
    pub test: String,
    /// The axis that sweeps.
    pub axis: String,
    /// Range as planned, in `unit`.
    pub range: Interval,
    /// Unit of the ranges: `deg`, `mm`.
    pub unit: String,
    /// The smallest range at which no uncertainty has doubled, in `unit`; `null` if the test can be left out.
    pub minimum_range: Option<Interval>,
    /// The error whose uncertainty doubles first.
    pub first_to_double: Option<String>,
}

/// The position of an axis at each whitened row, and the rows.
type PlacedRows = (Vec<f64>, Mat<f64>);

/// Number of bisections of the range, for a resolution of one thousandth.
const BISECTIONS: usize = 10;

/// The smallest range of every test in which a single axis moves.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn shrinkages(problem: &Problem) -> Result<Vec<Shrinkage>, Diagnostic> {
    let nominal = vec![0.0; problem.parameters.list.len()];
    let linear = Linearisation::of(problem, &nominal)?;
    let of_interest: Vec<usize> = (0..problem.parameters.list.len())
        .filter(|j| is_of_interest(&problem.parameters.list[*j]) && linear.rank.is_identifiable(*j))
        .collect();
    let mut found = Vec::new();
    for test in 0..problem.tests.len() {
        let Some((axis, low, high)) = swept(problem, test) else {
            continue;
        };
        let others = linear.tests.iter().enumerate().filter(|(other, _)| *other != test);
        let rest = linear.prior.clone().merged(others.map(|(_, triangle)| triangle));
        let rows = whitened(problem, test, axis)?;
        // The largest ratio of uncertainties at a share of the range, and its parameter.
        let worst = |share: f64| -> Result<(f64, usize), Diagnostic> {
            let (middle, half) = (0.5 * (low + high), 0.5 * share * (high - low) + 1e-9);
            let mut whole = rest.clone();
            for (positions, white) in rows.iter().filter(|_| share > 0.0) {
                let kept: Vec<usize> =
                    (0..positions.len()).filter(|i| (positions[*i] - middle).abs() <= half).collect();
                whole.absorb(Mat::from_fn(kept.len(), white.ncols(), |i, j| white[(kept[i], j)]).as_ref());
            }
            let (rank, covariance) = linear.with(&whole)?;
            let ratios = of_interest.iter().map(|&j| {
                let ratio = (covariance[(j, j)] / linear.covariance[(j, j)]).sqrt();
                (if rank.is_identifiable(j) { ratio } else { f64::INFINITY }, j)
            });
            Ok(ratios.fold((0.0, 0), |most, next| if next.0 > most.0 { next } else { most }))
        };
        let kind = problem.session.machine.axes[axis].kind;
        let display_per_internal = kind.to_display(1.0);
        let none = worst(0.0)?;
        let mut shrinkage = Shrinkage {
            test: problem.tests[test].name.clone(),
            axis: problem.session.machine.axes[axis].name.clone(),
            range: [low * display_per_internal, high * display_per_internal].into(),
            unit: kind.unit().to_string(),
            minimum_range: None,
            first_to_double: None,
        };
        if none.0 >= 2.0 {
            let (mut enough, mut too_little, mut parameter) = (1.0, 0.0, none.1);
            for _ in 0..BISECTIONS {
                let share = 0.5 * (enough + too_little);
                let (ratio, j) = worst(share)?;
                if ratio < 2.0 {
                    enough = share;
                } else {
                    (too_little, parameter) = (share, j);
                }
            }
            let (middle, half) = (0.5 * (low + high), 0.5 * enough * (high - low));
            shrinkage.minimum_range =
                Some([(middle - half) * display_per_internal, (middle + half) * display_per_internal].into());
            shrinkage.first_to_double = Some(problem.parameters.list[parameter].id.to_string());
        }
        found.push(shrinkage);
    }
    Ok(found)
}

/// The axis that moves alone in a test, and its limits.
fn swept(problem: &Problem, test: usize) -> Option<(usize, f64, f64)> {
    let readings = problem.tests[test].readings.as_ref()?;
    let mut moving = readings.positions.iter().enumerate().filter_map(|(axis, positions)| {
        let low = positions.iter().copied().fold(f64::INFINITY, f64::min);
        let high = positions.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (high - low > 1e-6).then_some((axis, low, high))
    });
    let only = moving.next()?;
    moving.next().is_none().then_some(only)
}

/// The whitened rows of a test, block by block, each with the position of an axis.
fn whitened(problem: &Problem, test: usize, axis: usize) -> Result<Vec<PlacedRows>, Diagnostic> {
    let values = problem.slot_values(&vec![0.0; problem.parameters.list.len()]);
    let Some(readings) = &problem.tests[test].readings else {
        return Ok(Vec::new());
    };
    problem
        .blocks()
        .iter()
        .filter(|block| block.test == test)
        .map(|block| {
            let (white, _) = problem.whiten(&problem.rows(&values, block)?, block);
            let row = |i: &usize| block.rows.start + i / problem.channels(test);
            let positions = problem.kept_rows(block).iter().map(|i| readings.positions[axis][row(i)]).collect();
            Ok((positions, white))
        })
        .collect()
}
