//! The error on readings that the fit did not see.
//!
//! One run at a time is left out, or contiguous blocks where there are no runs, or seeded folds where rows are independent poses. The
//! triangles of the folds that remain are merged and solved anew; nothing of the left-out fold enters.

use abbe_model::instrument::InstrumentKind;
use abbe_model::session::{Session, Test};
use faer::Mat;
use rand::SeedableRng;
use rand::seq::SliceRandom;

use crate::error::IdentifyError;
use crate::problem::Problem;
use crate::triangle::Triangle;

/// How readings are grouped for judging.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoldKind {
    /// Each run of each test.
    Runs,
    /// Five contiguous blocks of each test.
    Blocks,
    /// Ten seeded folds of poses.
    Poses,
}

impl FoldKind {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            FoldKind::Runs => "one run at a time",
            FoldKind::Blocks => "one of five contiguous blocks of each test at a time",
            FoldKind::Poses => "one of ten seeded folds of poses at a time",
        }
    }
}

/// Which readings are left out together.
#[derive(Clone, Debug)]
pub struct Folds {
    /// How they were made.
    pub kind: FoldKind,
    /// Number of folds.
    pub count: usize,
    /// The fold of each row of each test.
    pub of_row: Vec<Vec<usize>>,
}

const BLOCKS_A_TEST: usize = 5;
const FOLDS_OF_POSES: usize = 10;

impl Folds {
    /// The folds of a session.
    pub fn of(session: &Session, tests: &[&Test], seed: u64) -> Folds {
        let readings: Vec<_> = tests.iter().filter_map(|test| test.readings.as_ref()).collect();
        let poses = matches!(
            session.instrument,
            InstrumentKind::Tracker | InstrumentKind::Socket
        ) && readings.iter().all(|r| r.run.is_empty());
        if poses {
            let total: usize = readings.iter().map(|r| r.rows()).sum();
            let folds = FOLDS_OF_POSES.min(total.max(1));
            let mut order: Vec<usize> = (0..total).collect();
            order.shuffle(&mut rand_pcg::Pcg64::seed_from_u64(seed));
            let mut fold_of = vec![0; total];
            for (place, row) in order.into_iter().enumerate() {
                fold_of[row] = place % folds;
            }
            let mut start = 0;
            let of_row = readings
                .iter()
                .map(|r| {
                    let rows = fold_of[start..start + r.rows()].to_vec();
                    start += r.rows();
                    rows
                })
                .collect();
            return Folds {
                kind: FoldKind::Poses,
                count: folds,
                of_row,
            };
        }
        let kind = if readings.iter().all(|r| r.runs().len() > 1) {
            FoldKind::Runs
        } else {
            FoldKind::Blocks
        };
        let mut count = 0;
        let of_row = readings
            .iter()
            .map(|r| {
                let mut rows = vec![0; r.rows()];
                let parts: Vec<std::ops::Range<usize>> = match kind {
                    FoldKind::Runs => r.runs(),
                    _ => {
                        let blocks = BLOCKS_A_TEST.min(r.rows().max(1));
                        (0..blocks)
                            .map(|k| k * r.rows() / blocks..(k + 1) * r.rows() / blocks)
                            .collect()
                    }
                };
                for part in parts {
                    rows[part].fill(count);
                    count += 1;
                }
                rows
            })
            .collect();
        Folds { kind, count, of_row }
    }
}

/// The error on left-out readings.
#[derive(Clone, Debug)]
pub struct HeldOut {
    /// The residual of every scalar reading under the fit that did not see it, mm, by test.
    pub residuals: Vec<Vec<f64>>,
    /// Root mean square over scalar readings that count, mm.
    pub rms_mm: f64,
}

/// Root mean square over the scalar readings that count, mm.
pub fn rms_mm(problem: &Problem<'_>, residuals: &[Vec<f64>]) -> f64 {
    let coordinates = problem.coordinates();
    let (mut sum, mut count) = (0.0, 0_usize);
    for (residual, rejected) in residuals.iter().zip(&problem.rejected) {
        for (i, value) in residual.iter().enumerate() {
            if !rejected[i / coordinates] {
                sum += value * value;
                count += 1;
            }
        }
    }
    (sum / count.max(1) as f64).sqrt()
}

/// Leaves out one fold after another. `beta` is the fit of all readings, `triangles` those of the folds there, `basis` spans the seen
/// directions (unknowns × rank).
///
/// # Errors
/// If the model cannot be evaluated.
pub fn held_out(
    problem: &Problem<'_>,
    beta: &[f64],
    triangles: &[Triangle],
    basis: &Mat<f64>,
) -> Result<HeldOut, IdentifyError> {
    let prior = problem.prior_triangle(beta);
    let steps = triangles
        .iter()
        .enumerate()
        .map(|(fold, _)| {
            let mut rest = prior.clone();
            for (other, triangle) in triangles.iter().enumerate() {
                if other != fold {
                    rest.merge(triangle);
                }
            }
            step_without(&rest, beta, basis)
        })
        .collect::<Result<Vec<_>, _>>()?;
    let values = problem.slot_values(beta);
    let unknowns = beta.len();
    let mut residuals: Vec<Vec<f64>> = problem
        .models
        .iter()
        .map(|model| vec![0.0; model.rows() * problem.coordinates()])
        .collect();
    for block in problem.blocks() {
        let rows = problem.rows(&values, &block)?;
        for i in 0..rows.nrows() {
            let scalar = block.rows.start * problem.coordinates() + i;
            let fold = problem.folds.of_row[block.test][scalar / problem.coordinates()];
            let predicted: f64 = (0..unknowns).map(|j| rows[(i, j)] * steps[fold][j]).sum();
            residuals[block.test][scalar] = rows[(i, unknowns)] - predicted;
        }
    }
    Ok(HeldOut {
        rms_mm: rms_mm(problem, &residuals),
        residuals,
    })
}

/// From the fit of all readings to that of the readings in `rest`: the least solution in absolute terms, so that what the remaining readings do
/// not see goes to its nominal value and not to what the left-out ones said.
fn step_without(rest: &Triangle, beta: &[f64], basis: &Mat<f64>) -> Result<Vec<f64>, IdentifyError> {
    let (r, c, _) = rest.parts();
    let (n, rank) = (basis.nrows(), basis.ncols());
    if rank == 0 {
        return Ok(vec![0.0; n]);
    }
    let absolute: Vec<f64> = (0..n)
        .map(|i| c[i] + (i..n).map(|j| r[(i, j)] * beta[j]).sum::<f64>())
        .collect();
    let reduced = &r * basis;
    let svd = reduced.svd().map_err(|_| IdentifyError::Decomposition)?;
    let singular: Vec<f64> = svd.S().column_vector().iter().copied().collect();
    let negligible = singular[0] * 1e-12;
    let mut step: Vec<f64> = beta.iter().map(|value| -value).collect();
    for k in 0..rank {
        if singular[k] <= negligible {
            continue;
        }
        let along = (0..n).map(|i| svd.U()[(i, k)] * absolute[i]).sum::<f64>() / singular[k];
        for j in 0..n {
            let direction: f64 = (0..rank).map(|l| basis[(j, l)] * svd.V()[(l, k)]).sum();
            step[j] += along * direction;
        }
    }
    Ok(step)
}
