//! Cross-validation: the residual of readings that the fit did not use.
//!
//! A fold is one run, or a contiguous block where there are no runs, or a block of joint space among independent poses.
//! The fit of the other folds does not use the held-out fold. Let `A` be the normal matrix of all readings and `W` such
//! that `WᵀAW = I`. Let `T = J·W` for the fold's rows `[J | r]`, and `y` the remaining step in these directions. The
//! step to the fit of the other folds is `W(I − TᵀT)⁻¹(y − Tᵀr)`, with a matrix no larger than the number of the fold's rows
//! (Woodbury). If the other folds barely determine a direction, their triangular factors are merged and solved again.

mod figures;
pub(crate) mod folds;
mod joint_space;
mod left_out;

use std::ops::Range;

use abbe_model::Diagnostic;
use faer::Mat;

use crate::numerics::parallel;
use crate::numerics::solve::Svd;
use crate::numerics::symmetric::Symmetric;
use crate::numerics::tolerances::MIN_UPDATE_SHARE;
use crate::numerics::triangle::Triangle;
use crate::problem::{Problem, Swept, put};
pub use figures::cross_validation;
pub use folds::{FoldKind, Folds, mislabelled_runs};
pub use joint_space::{coordinates, nearest_of};
pub use left_out::{LeftOutTests, NotLeftOut, left_out_tests};

/// Held-out residuals.
#[derive(Clone, Debug)]
pub struct HeldOut {
    /// The residual of every scalar reading under the fit without its fold, mm, by test.
    pub residuals: Vec<Vec<f64>>,
    /// Root mean square over the scalar readings that are not excluded, mm.
    pub rms_mm: f64,
}

/// Root mean square over the scalar readings that are not excluded, mm.
pub fn rms_mm(problem: &Problem, residuals: &[Vec<f64>]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for (test, residual) in residuals.iter().enumerate() {
        for (i, value) in residual.iter().enumerate() {
            if problem.counts(test, i) {
                sum += value * value;
                count += 1;
            }
        }
    }
    (sum / count.max(1) as f64).sqrt()
}

/// Root mean square over the scalar readings of lengths, and over those of angles at the session's lever, mm; `None`
/// without one that is not excluded.
pub fn rms_by_unit_mm(problem: &Problem, residuals: &[Vec<f64>]) -> [Option<f64>; 2] {
    let mut sums = [(0.0, 0_usize); 2];
    for (test, residual) in residuals.iter().enumerate() {
        let channels = problem.models[test].channels();
        for (i, value) in residual.iter().enumerate().filter(|(i, _)| problem.counts(test, *i)) {
            let (sum, count) = &mut sums[usize::from(channels[i % channels.len()].is_angle())];
            *sum += value * value;
            *count += 1;
        }
    }
    sums.map(|(sum, count)| (count > 0).then(|| (sum / count as f64).sqrt()))
}

/// Root mean square over the scalar readings as results state it, mm: over lengths, if there are angles too.
pub fn stated_rms_mm(problem: &Problem, residuals: &[Vec<f64>]) -> f64 {
    match rms_by_unit_mm(problem, residuals) {
        [Some(lengths), Some(_)] => lengths,
        _ => rms_mm(problem, residuals),
    }
}

/// The residuals of every test, mm, and those with each fold held out in turn. `beta` is the fit of all readings, `triangles`
/// are the factors of the folds there,
/// `whole` is the factor of all readings and priors, `basis` spans the identifiable directions (parameters × rank).
///
/// # Errors
/// If the model cannot be evaluated.
pub fn held_out(
    problem: &Problem,
    beta: &[f64],
    triangles: &[Triangle],
    whole: &Triangle,
    basis: &Mat<f64>,
) -> Result<(Residuals, HeldOut), Diagnostic> {
    let all = WhitenedDirections::of(whole, basis)?;
    let steps = parallel::map(triangles.len(), &|fold| match all.step_without(&triangles[fold])? {
        Some(step) => Ok(step),
        None => {
            let others = triangles.iter().enumerate().filter(|(other, _)| *other != fold);
            step_without(&problem.prior_triangle(beta).merged(others.map(|(_, triangle)| triangle)), beta, basis)
        }
    });
    let steps: Vec<Vec<f64>> = steps.into_iter().collect::<Result<_, Diagnostic>>()?;
    let (residuals, held_out) = predicted(problem, beta, &steps)?;
    Ok((residuals, HeldOut { rms_mm: rms_mm(problem, &held_out), residuals: held_out }))
}

/// Residuals by test, mm.
type Residuals = Vec<Vec<f64>>;

/// The residuals of every test, mm, outliers included: at `beta`, and each fold under the model linearised there, after the
/// fold's step.
fn predicted(problem: &Problem, beta: &[f64], steps: &[Vec<f64>]) -> Result<(Residuals, Residuals), Diagnostic> {
    let values = problem.slot_values(beta);
    let (mut residuals, mut held_out) =
        (vec![Vec::new(); problem.models.len()], vec![Vec::new(); problem.models.len()]);
    let blocks = problem.blocks();
    let predicted = parallel::map(blocks.len(), &|number| {
        let block = &blocks[number];
        let of_test = problem.own_parameters(block.test);
        let channels = problem.channels(block.test);
        let mut present = vec![0.0; block.rows.len() * channels];
        let mut changes = present.clone();
        let mut folds: Vec<(Range<usize>, usize)> = Vec::new();
        for of_fold in problem.folds.of_row[block.test][block.rows.clone()].chunk_by(|a, b| a == b) {
            let start = folds.last().map_or(0, |(rows, _)| rows.end);
            folds.push((start..start + of_fold.len(), of_fold[0]));
        }
        problem.sweep(&values[block.test], block, |output, start, values| {
            let (channel, own) = match output {
                Swept::Residual { channel } => {
                    return put(&mut present[start * channels + channel..], channels, values.iter().copied(), true);
                }
                Swept::Derivative { channel, own } => (channel, own),
            };
            for (rows, fold) in folds.iter().filter(|(rows, _)| rows.start < start + values.len() && rows.end > start) {
                let rows = rows.start.max(start)..rows.end.min(start + values.len());
                let step = |parameter: &usize| steps[*fold][of_test[*parameter]];
                let first = rows.start * channels + channel;
                let values = &values[rows.start - start..rows.end - start];
                let constant: f64 = own.iter().filter(|(_, basis)| basis.is_none()).map(|(own, _)| step(own)).sum();
                put(&mut changes[first..], channels, values.iter().map(|d| d * constant), false);
                for (parameter, basis) in own.iter().filter_map(|(own, basis)| Some((own, basis.as_ref()?))) {
                    let step = step(parameter);
                    let terms = values.iter().zip(&basis[block.rows.start + rows.start..]);
                    put(&mut changes[first..], channels, terms.map(|(d, b)| d * b * step), false);
                }
            }
        })?;
        let first = block.rows.start * channels;
        for i in (0..present.len()).filter(|i| problem.is_missing(block.test, first + i)) {
            (present[i], changes[i]) = (0.0, 0.0);
        }
        changes.iter_mut().zip(&present).for_each(|(change, present)| *change = present - *change);
        Ok::<_, Diagnostic>((present, changes))
    });
    // Blocks are in the order of the rows.
    for (block, residual) in blocks.iter().zip(predicted) {
        let (present, without) = residual?;
        residuals[block.test].extend(present);
        held_out[block.test].extend(without);
    }
    Ok((residuals, held_out))
}

/// The identifiable directions, scaled so that the normal matrix of all readings is the identity.
struct WhitenedDirections {
    /// `W`: parameters × rank.
    scaled_basis: Mat<f64>,
    /// `y`: the remaining step of the fit of all readings.
    step: Mat<f64>,
    /// Whether the readings contain information on every direction.
    complete: bool,
}

impl WhitenedDirections {
    fn of(whole: &Triangle, basis: &Mat<f64>) -> Result<WhitenedDirections, Diagnostic> {
        let (r, c, _) = whole.parts();
        let directions = Svd::of((&r * basis).as_ref())?;
        let right = Mat::from_fn(c.len(), 1, |i, _| c[i]);
        Ok(WhitenedDirections {
            scaled_basis: basis * directions.inverse_root(),
            step: directions.left().transpose() * right,
            complete: directions.numerical_rank() == basis.ncols(),
        })
    }

    /// The step to the fit without a fold; `None` if the other folds barely determine a direction.
    fn step_without(&self, fold: &Triangle) -> Result<Option<Vec<f64>>, Diagnostic> {
        if !self.complete {
            return Ok(None);
        }
        let parameters = fold.columns();
        // The eigenvalues of many rows cost more than the factor of these rows.
        let reduced = (fold.rows().nrows() > parameters + 1).then(|| fold.reduced());
        let rows = reduced.as_ref().map_or(fold.rows(), Mat::as_ref);
        if rows.nrows() == 0 || self.scaled_basis.ncols() == 0 {
            let step = &self.scaled_basis * &self.step;
            return Ok(Some(step.col(0).iter().copied().collect()));
        }
        let t = rows.subcols(0, parameters) * &self.scaled_basis;
        let residual_step = &self.step - t.transpose() * rows.subcols(parameters, 1);
        let leverage = &t * t.transpose();
        let Symmetric { values, vectors } = Symmetric::of(leverage.as_ref())?;
        if values.iter().any(|share| 1.0 - share < MIN_UPDATE_SHARE) {
            return Ok(None);
        }
        let mut along = vectors.transpose() * (&t * &residual_step);
        for (k, share) in values.iter().enumerate() {
            along[(k, 0)] /= 1.0 - share;
        }
        let step = &self.scaled_basis * (residual_step + t.transpose() * (vectors * along));
        Ok(Some(step.col(0).iter().copied().collect()))
    }
}

/// The step from the fit of all readings to that of the readings in `rest`. It is the minimum-norm solution: a
/// direction that the remaining readings do not determine returns to its nominal value.
fn step_without(rest: &Triangle, beta: &[f64], basis: &Mat<f64>) -> Result<Vec<f64>, Diagnostic> {
    let (r, c, _) = rest.parts();
    let n = beta.len();
    let absolute: Vec<f64> = (0..n).map(|i| c[i] + (i..n).map(|j| r[(i, j)] * beta[j]).sum::<f64>()).collect();
    let solution = Svd::of((&r * basis).as_ref())?.solve(&absolute, 0.0);
    let value = |j: usize| -> f64 { solution.iter().enumerate().map(|(k, z)| basis[(j, k)] * z).sum() };
    Ok((0..n).map(|j| value(j) - beta[j]).collect())
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// Simulated rows of `[J | r]`.
    fn simulated(rows: usize, parameters: usize, random: &mut rand_pcg::Pcg64Mcg) -> Triangle {
        let mut triangle = Triangle::new(parameters);
        let block = Mat::from_fn(rows, parameters + 1, |_, _| random.random_range(-1.0..1.0));
        triangle.absorb(block.as_ref());
        triangle
    }

    #[test]
    fn the_update_without_a_fold_equals_a_new_solution() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(1);
        let parameters = 6;
        // Two combinations of the parameters are outside the fitted directions.
        let basis = Mat::from_fn(parameters, 4, |i, k| if i == k { 1.0 } else { 0.1 * (i * k) as f64 });
        let basis = basis.qr().compute_thin_Q();
        let folds: Vec<Triangle> = (0..5).map(|_| simulated(9, parameters, &mut random)).collect();
        let merged = |folds: &[Triangle], but: usize| {
            let others = folds.iter().enumerate().filter(|(fold, _)| *fold != but);
            Triangle::new(parameters).merged(others.map(|(_, fold)| fold))
        };
        let end = WhitenedDirections::of(&merged(&folds, usize::MAX), &basis).unwrap();
        let step: Vec<f64> = (&end.scaled_basis * &end.step).col(0).iter().copied().collect();
        let moved: Vec<Triangle> = folds.iter().map(|fold| fold.after(&step)).collect();
        // At the solution, where the remaining step is zero, and before it.
        for (folds, beta) in [(moved, step), (folds, vec![0.0; parameters])] {
            let all = WhitenedDirections::of(&merged(&folds, usize::MAX), &basis).unwrap();
            for (number, fold) in folds.iter().enumerate() {
                let updated = all.step_without(fold).unwrap().unwrap();
                let solved = step_without(&merged(&folds, number), &beta, &basis).unwrap();
                for (updated, solved) in updated.iter().zip(&solved) {
                    assert!((updated - solved).abs() < 1e-12, "{updated} {solved}");
                }
            }
        }
    }

    #[test]
    fn a_direction_identifiable_from_one_fold_only_is_solved_again() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(2);
        let parameters = 3;
        let mut others = Triangle::new(parameters);
        let block = Mat::from_fn(9, parameters + 1, |_, j| if j == 2 { 0.0 } else { random.random_range(-1.0..1.0) });
        others.absorb(block.as_ref());
        let single_fold = simulated(9, parameters, &mut random);
        let mut whole = others.clone();
        whole.merge(&single_fold);
        let all = WhitenedDirections::of(&whole, &Mat::identity(parameters, parameters)).unwrap();
        assert!(all.step_without(&single_fold).unwrap().is_none());
        assert!(all.step_without(&others).unwrap().is_some());
    }
}
