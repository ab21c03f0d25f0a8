//! The error on readings that the fit did not see.
//!
//! One run at a time is left out, or contiguous blocks where there are no runs, or seeded folds where rows are independent poses. Nothing of the left-out
//! fold enters: with `W` such that `WᵀAW = I` for the normal matrix `A` of all readings, `T = J·W` of the fold's rows `[J | r]` and `y` what is left to
//! do in these directions, the step to the fit of the others is `W(I − TᵀT)⁻¹(y − Tᵀr)`, which takes a matrix no larger than the fold has rows
//! (Woodbury). Where the others hardly see a direction any more, their triangles are merged and solved anew.

use std::collections::BTreeSet;

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
    /// Groups of consecutive runs of each test, where there are very many runs.
    RunGroups,
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
            FoldKind::RunGroups => "one group of consecutive runs of a test at a time",
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
/// The most folds of runs: more cost time and say no more. Where the run column changes from reading to reading, each reading would be a fold.
const MOST_FOLDS_OF_RUNS: usize = 64;
/// Into how many folds they are grouped where there are more.
const FOLDS_OF_MANY_RUNS: usize = 32;

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
        let runs: Vec<_> = readings.iter().map(|r| r.runs()).collect();
        let kind = if runs.iter().any(|runs| runs.len() < 2) {
            FoldKind::Blocks
        } else if runs.iter().map(Vec::len).sum::<usize>() <= MOST_FOLDS_OF_RUNS {
            FoldKind::Runs
        } else {
            FoldKind::RunGroups
        };
        let groups = (FOLDS_OF_MANY_RUNS / readings.len().max(1)).max(2);
        let mut count = 0;
        let of_row = readings
            .iter()
            .zip(runs)
            .map(|(r, runs)| {
                let mut rows = vec![0; r.rows()];
                let parts: Vec<std::ops::Range<usize>> = match kind {
                    FoldKind::Runs => runs,
                    FoldKind::RunGroups => {
                        let groups = groups.min(runs.len());
                        let first = |k: usize| {
                            runs.get(k * runs.len() / groups)
                                .map_or(r.rows(), |run| run.start)
                        };
                        (0..groups).map(|k| first(k)..first(k + 1)).collect()
                    }
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

/// Runs of fewer readings than this on average are no traversals, if their numbers come back.
const SHORT_RUN: f64 = 4.0;
/// The fewest readings of a test whose run column is judged.
const LEAST_READINGS: usize = 24;

/// A warning for each test whose run column does not number traversals: the number changes from reading to reading.
pub fn mislabelled_runs(tests: &[&Test]) -> Vec<String> {
    let warning = |test: &&Test| {
        let readings = test.readings.as_ref()?;
        let runs = readings.runs();
        let numbers: BTreeSet<i64> = runs
            .iter()
            .map(|run| readings.run.get(run.start).copied().unwrap_or(0))
            .collect();
        let length = readings.rows() as f64 / runs.len().max(1) as f64;
        let come_back = numbers.len() < runs.len();
        let one_each = length < 1.5;
        let wrong = readings.rows() >= LEAST_READINGS && length < SHORT_RUN && (come_back || one_each);
        wrong.then(|| {
            format!(
                "the `run` column of test {} changes {} times in {} readings, and a run is one traversal in one direction: directions of travel, repeats and \
                 held-out runs cannot be taken from it; number the traversals, in the order in which they were measured",
                test.name,
                runs.len() - 1,
                readings.rows()
            )
        })
    };
    tests.iter().filter_map(warning).collect()
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

/// Leaves out one fold after another. `beta` is the fit of all readings, `triangles` those of the folds there, `whole` that of all readings and priors,
/// `basis` spans the seen directions (unknowns × rank).
///
/// # Errors
/// If the model cannot be evaluated.
pub fn held_out(
    problem: &Problem<'_>,
    beta: &[f64],
    triangles: &[Triangle],
    whole: &Triangle,
    basis: &Mat<f64>,
) -> Result<HeldOut, IdentifyError> {
    let all = Directions::of(whole, basis)?;
    let steps: Vec<Vec<f64>> = (0..triangles.len())
        .into_par_iter()
        .map(|fold| match all.step_without(&triangles[fold])? {
            Some(step) => Ok(step),
            None => {
                let mut rest = problem.prior_triangle(beta);
                let others = triangles.iter().enumerate();
                others
                    .filter(|(other, _)| *other != fold)
                    .for_each(|(_, triangle)| rest.merge(triangle));
                step_without(&rest, beta, basis)
            }
        })
        .collect::<Result<_, IdentifyError>>()?;
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

/// What the others have to see of a direction, as a share of what all readings see of it, for the fit of all to lead to theirs.
const LEAST_SHARE: f64 = 1e-6;

/// The seen directions, in which the normal matrix of all readings is the identity.
struct Directions {
    /// `W`: unknowns × rank.
    spread: Mat<f64>,
    /// `y`: the step that all readings still ask for.
    left: Mat<f64>,
}

impl Directions {
    fn of(whole: &Triangle, basis: &Mat<f64>) -> Result<Directions, IdentifyError> {
        let (r, c, _) = whole.parts();
        let rank = basis.ncols();
        if rank == 0 {
            return Ok(Directions {
                spread: Mat::zeros(basis.nrows(), 0),
                left: Mat::zeros(0, 1),
            });
        }
        let svd = (&r * basis)
            .thin_svd()
            .map_err(|_| IdentifyError::Decomposition)?;
        let singular = svd.S().column_vector();
        let mut spread = basis * svd.V();
        for (k, mut column) in spread.col_iter_mut().enumerate() {
            // A direction of nothing is none: what leaves it out solves anew.
            column *= faer::Scale(1.0 / singular[k]);
        }
        let right = Mat::from_fn(c.len(), 1, |i, _| c[i]);
        Ok(Directions {
            left: svd.U().transpose() * right,
            spread,
        })
    }

    /// The step to the fit of all readings but a fold's; `None` where they hardly see a direction any more.
    fn step_without(&self, fold: &Triangle) -> Result<Option<Vec<f64>>, IdentifyError> {
        if !self.spread.is_all_finite() {
            return Ok(None);
        }
        let rows = fold.rows();
        let unknowns = fold.columns();
        if rows.nrows() == 0 || self.spread.ncols() == 0 {
            let step = &self.spread * &self.left;
            return Ok(Some(step.col(0).iter().copied().collect()));
        }
        let t = rows.subcols(0, unknowns) * &self.spread;
        let asked = &self.left - t.transpose() * rows.subcols(unknowns, 1);
        let leverage = &t * t.transpose();
        let eigen = leverage
            .self_adjoint_eigen(faer::Side::Lower)
            .map_err(|_| IdentifyError::Decomposition)?;
        let shares: Vec<f64> = eigen
            .S()
            .column_vector()
            .iter()
            .map(|share| 1.0 - share)
            .collect();
        if shares.iter().any(|share| *share < LEAST_SHARE) {
            return Ok(None);
        }
        let mut along = eigen.U().transpose() * (&t * &asked);
        for (k, share) in shares.iter().enumerate() {
            along[(k, 0)] /= share;
        }
        let step = &self.spread * (asked + t.transpose() * (eigen.U() * along));
        Ok(Some(step.col(0).iter().copied().collect()))
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    /// Rows of `[J | r]`, drawn.
    fn drawn(rows: usize, unknowns: usize, random: &mut rand_pcg::Pcg64Mcg) -> Triangle {
        let mut triangle = Triangle::new(unknowns);
        let block = Mat::from_fn(rows, unknowns + 1, |_, _| random.random_range(-1.0..1.0));
        triangle.absorb(block.as_ref());
        triangle
    }

    #[test]
    fn a_fold_is_left_out_as_if_the_others_were_solved_anew() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(1);
        let unknowns = 6;
        // Two combinations of the unknowns are not among the directions that are fitted.
        let basis = Mat::from_fn(
            unknowns,
            4,
            |i, k| if i == k { 1.0 } else { 0.1 * (i * k) as f64 },
        );
        let basis = basis.qr().compute_thin_Q();
        let folds: Vec<Triangle> = (0..5).map(|_| drawn(9, unknowns, &mut random)).collect();
        let merged = |folds: &[Triangle], but: usize| {
            let mut whole = Triangle::new(unknowns);
            let others = folds.iter().enumerate().filter(|(fold, _)| *fold != but);
            others.for_each(|(_, fold)| whole.merge(fold));
            whole
        };
        let end = Directions::of(&merged(&folds, usize::MAX), &basis).unwrap();
        let step: Vec<f64> = (&end.spread * &end.left).col(0).iter().copied().collect();
        let moved: Vec<Triangle> = folds.iter().map(|fold| fold.after(&step)).collect();
        // From the end of the fit, where nothing is left to do, and from before it, where much is.
        for (folds, beta) in [(moved, step), (folds, vec![0.0; unknowns])] {
            let all = Directions::of(&merged(&folds, usize::MAX), &basis).unwrap();
            for (number, fold) in folds.iter().enumerate() {
                let short = all.step_without(fold).unwrap().unwrap();
                let anew = step_without(&merged(&folds, number), &beta, &basis).unwrap();
                for (short, anew) in short.iter().zip(&anew) {
                    assert!((short - anew).abs() < 1e-12, "{short} {anew}");
                }
            }
        }
    }

    #[test]
    fn what_one_fold_alone_sees_is_not_left_to_the_short_way() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(2);
        let unknowns = 3;
        let mut others = Triangle::new(unknowns);
        let block = Mat::from_fn(9, unknowns + 1, |_, j| {
            if j == 2 {
                0.0
            } else {
                random.random_range(-1.0..1.0)
            }
        });
        others.absorb(block.as_ref());
        let alone = drawn(9, unknowns, &mut random);
        let mut whole = others.clone();
        whole.merge(&alone);
        let all = Directions::of(&whole, &Mat::identity(unknowns, unknowns)).unwrap();
        assert!(all.step_without(&alone).unwrap().is_none());
        assert!(all.step_without(&others).unwrap().is_some());
    }
}
