//! The error on readings that the fit did not see.
//!
//! One run at a time is left out, or contiguous blocks where there are no runs, or seeded folds where rows are independent poses. The
//! triangles of the folds that remain are merged and solved anew; nothing of the left-out fold enters.

use abbe_model::instrument::InstrumentKind;
use abbe_model::session::{Session, Test};
use faer::Mat;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rayon::prelude::*;

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
    // All folds before one, and all behind it: what a fold is left out of, in two merges.
    let mut before = vec![problem.prior_triangle(beta)];
    let mut behind = vec![Triangle::new(beta.len())];
    for (first, last) in triangles.iter().zip(triangles.iter().rev()) {
        before.push(with(&before[before.len() - 1], first));
        behind.push(with(&behind[behind.len() - 1], last));
    }
    let steps: Vec<Vec<f64>> = (0..triangles.len())
        .into_par_iter()
        .map(|fold| {
            let rest = with(&before[fold], &behind[triangles.len() - 1 - fold]);
            step_without(&rest, beta, basis)
        })
        .collect::<Result<_, _>>()?;
    let values = problem.slot_values(beta);
    let coordinates = problem.coordinates();
    let mut residuals: Vec<Vec<f64>> = vec![Vec::new(); problem.models.len()];
    let blocks = problem.blocks();
    let predicted = blocks.par_iter().map(|block| {
        let own = problem.own_unknowns(block.test);
        let rows = problem.own_rows(&values[block.test], block)?;
        let mut residual = rows.col(own.len()).to_owned();
        let fold_of = &problem.folds.of_row[block.test][block.rows.clone()];
        for (unknown, column) in own.iter().zip(rows.col_iter()) {
            for (i, residual) in residual.iter_mut().enumerate() {
                *residual -= column[i] * steps[fold_of[i / coordinates]][*unknown];
            }
        }
        Ok(residual)
    });
    // Blocks come in the order of the rows.
    for (block, residual) in blocks
        .iter()
        .zip(predicted.collect::<Result<Vec<_>, IdentifyError>>()?)
    {
        residuals[block.test].extend(residual.iter());
    }
    Ok(HeldOut {
        rms_mm: rms_mm(problem, &residuals),
        residuals,
    })
}

fn with(triangle: &Triangle, other: &Triangle) -> Triangle {
    let mut sum = triangle.clone();
    sum.merge(other);
    sum
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
