//! Leaves out whole tests: a test is predicted by the model that the other tests identify.
//!
//! Runs of one test stand at the same positions, so a left-out run tests noise. A left-out test has another radius, bar
//! or axis. An effect that is attributed to the right component predicts it.
//!
//! Let `S` be the set-up parameters that only the left-out test has, and `M` all others: errors, effects, shared
//! set-ups. `M` follows from the other tests and the priors. `S` follows from the left-out test and its priors with `M`
//! fixed, because no other test contains information on it. The residual of the left-out test is judged after that.
//! In parameters scaled by their physical size, with normal matrices `N` of the other tests and priors and `A` of the
//! left-out test and the priors,
//!
//! ```text
//! δM = (N⁻¹ g)_M,    δS = A_SS⁻¹ (a_S − A_SM δM)
//! ```
//!
//! The readings of the left-out test have the information `K = A_MM − A_MS A_SS⁻¹ A_SM` on `M`. The variances of their
//! predictions sum to `tr(K N⁻¹)` in units of the noise variance. If their mean exceeds 1, the other tests do not
//! identify what the left-out test needs. It is then not judged, and the parameters of the worst direction are named.

use abbe_model::Diagnostic;
use faer::linalg::solvers::Llt;
use faer::prelude::Solve;
use faer::{Mat, Side};

use super::{FoldKind, predicted, stated_rms_mm};
use crate::error;
use crate::fit::Fit;
use crate::numerics::parallel;
use crate::numerics::symmetric::Symmetric;
use crate::numerics::triangle::Triangle;
use crate::problem::Problem;

/// Largest mean variance of the predicted readings, in variances of the noise, for a test to be judged.
const MAX_PREDICTED_VARIANCE: f64 = 1.0;
/// Information on a direction below which it counts as not determined, per physical size squared.
const MIN_INFORMATION: f64 = 1.0;
/// The same as a share of the largest information: below it, differences of normal matrices are rounding errors.
const MIN_INFORMATION_SHARE: f64 = 1e-12;
/// Share of the largest entry from which a parameter belongs to the named direction.
const NAMED_SHARE: f64 = 0.5;
/// Maximum number of named parameters.
const MAX_NAMED: usize = 3;

/// A test that cannot be left out.
#[derive(Clone, Debug)]
pub struct NotLeftOut {
    /// Index of the test.
    pub test: usize,
    /// Identifiers of the parameters that the other tests do not identify, the largest share first.
    pub parameters: Vec<String>,
}

/// The tests of a session, each predicted by the others.
#[derive(Clone, Debug)]
pub struct LeftOutTests {
    /// Residuals of each test, mm, outliers included; `None` for a test that cannot be left out.
    pub residuals: Vec<Option<Vec<f64>>>,
    /// The tests that cannot be left out.
    pub not_left_out: Vec<NotLeftOut>,
}

impl LeftOutTests {
    /// Root mean square over the readings of the judged tests that `problem` does not exclude, mm. `None` if no test is
    /// judged.
    pub fn rms_mm(&self, problem: &Problem) -> Option<f64> {
        let judged = self.residuals.iter().any(Option::is_some);
        let residuals: Vec<Vec<f64>> = self.residuals.iter().map(|own| own.clone().unwrap_or_default()).collect();
        judged.then(|| stated_rms_mm(problem, &residuals))
    }
}

/// Leaves out each test in turn, for the model linearised at `beta`. A session of one test has none to leave out.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn left_out_tests(problem: &Problem, beta: &[f64]) -> Result<LeftOutTests, Diagnostic> {
    left_out(problem, beta, None)
}

/// The same at the solution of a fit.
pub(super) fn left_out_tests_of_fit(problem: &Problem, fit: &Fit) -> Result<LeftOutTests, Diagnostic> {
    left_out(problem, &fit.beta, triangles_of_tests(problem, fit))
}

/// The triangular factors of the tests from those of the folds, if each fold is a part of a test and the factors take less to
/// merge than the readings to linearise.
fn triangles_of_tests(problem: &Problem, fit: &Fit) -> Option<Vec<Triangle>> {
    let (folds, count) = (&problem.folds, fit.beta.len());
    let are_parts = matches!(folds.kind, FoldKind::Runs | FoldKind::RunGroups | FoldKind::Blocks);
    if !are_parts || problem.readings() < folds.count * count * count {
        return None;
    }
    let of_test = |test: usize| {
        let mut parts: Vec<usize> = folds.of_row[test].chunk_by(|a, b| a == b).map(|part| part[0]).collect();
        parts.sort_unstable();
        parts.dedup();
        Triangle::new(count).merged(parts.into_iter().map(|part| &fit.triangles[part]))
    };
    Some(parallel::map(problem.models.len(), &of_test))
}

fn left_out(problem: &Problem, beta: &[f64], triangles: Option<Vec<Triangle>>) -> Result<LeftOutTests, Diagnostic> {
    let tests = problem.models.len();
    if tests < 2 {
        return Ok(LeftOutTests { residuals: vec![None; tests], not_left_out: Vec::new() });
    }
    let problem = problem.folded_by_test();
    let size = problem.parameters.sizes();
    let triangles = triangles.map_or_else(|| problem.triangles(beta), Ok)?;
    let of_tests: Vec<Normal> = parallel::map(tests, &|test| Normal::of(&triangles[test], &size));
    let prior = Normal::of(&problem.prior_triangle(beta), &size);
    let whole = of_tests.iter().fold(prior.clone(), |sum, own| sum.plus(own, 1.0));
    let judged = parallel::map(tests, &|test| {
        let rows = problem.scalars_of(test);
        LeftOut { own: own_setup(&problem, test), of_test: &of_tests[test], prior: &prior, whole: &whole, rows }
            .step(problem.own_parameters(test))
    });
    let mut steps = Vec::with_capacity(tests);
    let mut not_left_out = Vec::new();
    for (test, judged) in judged.into_iter().enumerate() {
        match judged? {
            Ok(step) => steps.push(Some(step.iter().zip(&size).map(|(step, size)| step * size).collect::<Vec<f64>>())),
            Err(named) => {
                let parameters = named.into_iter().map(|j| problem.parameters.list[j].id.to_string()).collect();
                not_left_out.push(NotLeftOut { test, parameters });
                steps.push(None);
            }
        }
    }
    let zero = vec![0.0; beta.len()];
    let of_test: Vec<Vec<f64>> = steps.iter().map(|step| step.clone().unwrap_or_else(|| zero.clone())).collect();
    let (_, residuals) = predicted(&problem, beta, &of_test)?;
    let judged = residuals.into_iter().zip(&steps).map(|(residual, step)| step.as_ref().map(|_| residual));
    Ok(LeftOutTests { residuals: judged.collect(), not_left_out })
}

/// The set-up parameters that only one test has.
fn own_setup(problem: &Problem, test: usize) -> Vec<usize> {
    let elsewhere = |j: usize| {
        let mut others = (0..problem.models.len()).filter(|other| *other != test);
        others.any(|other| problem.own_parameters(other).contains(&j))
    };
    let own = problem.own_parameters(test).iter().copied();
    own.filter(|j| problem.parameters.list[*j].id.is_setup() && !elsewhere(*j)).collect()
}

/// Normal matrix and right-hand side, in parameters scaled by their physical size.
#[derive(Clone)]
struct Normal {
    matrix: Mat<f64>,
    right: Mat<f64>,
}

impl Normal {
    fn of(triangle: &Triangle, size: &[f64]) -> Normal {
        let rows = triangle.rows();
        let scaled = Mat::from_fn(rows.nrows(), size.len(), |i, j| rows[(i, j)] * size[j]);
        Normal { matrix: scaled.transpose() * &scaled, right: scaled.transpose() * rows.subcols(size.len(), 1) }
    }

    fn plus(mut self, other: &Normal, factor: f64) -> Normal {
        self.matrix += faer::Scale(factor) * &other.matrix;
        self.right += faer::Scale(factor) * &other.right;
        self
    }

    /// The least information that counts, added to every parameter.
    fn with_least_information(mut self) -> Normal {
        let largest = (0..self.matrix.nrows()).map(|j| self.matrix[(j, j)]).fold(0.0, f64::max);
        let least = MIN_INFORMATION.max(MIN_INFORMATION_SHARE * largest);
        (0..self.matrix.nrows()).for_each(|j| self.matrix[(j, j)] += least);
        self
    }

    fn over(&self, rows: &[usize], columns: &[usize]) -> Mat<f64> {
        Mat::from_fn(rows.len(), columns.len(), |i, j| self.matrix[(rows[i], columns[j])])
    }
}

fn cholesky(matrix: &Mat<f64>) -> Result<Llt<f64>, Diagnostic> {
    Llt::new(matrix.as_ref(), Side::Lower).map_err(|_| error::decomposition())
}

/// A test to leave out.
struct LeftOut<'n> {
    /// Its own set-up parameters.
    own: Vec<usize>,
    of_test: &'n Normal,
    prior: &'n Normal,
    /// All tests and priors.
    whole: &'n Normal,
    /// Number of its scalar readings.
    rows: usize,
}

impl LeftOut<'_> {
    /// The scaled step to the model that predicts the test, or the parameters that the other tests do not identify.
    /// `parameters` are those on which the readings of the test depend.
    fn step(&self, parameters: &[usize]) -> Result<Result<Vec<f64>, Vec<usize>>, Diagnostic> {
        let others = self.whole.clone().plus(self.of_test, -1.0).with_least_information();
        let information = cholesky(&others.matrix)?;
        let by_others = information.solve(&others.right);
        let mut step: Vec<f64> = by_others.col(0).iter().copied().collect();

        // The readings of the test with the priors of its set-up.
        let all: Vec<usize> = (0..step.len()).collect();
        let with_prior = self.of_test.clone().plus(self.prior, 1.0).with_least_information();
        let of_setup = cholesky(&with_prior.over(&self.own, &self.own))?;
        self.own.iter().for_each(|j| step[*j] = 0.0);
        let coupling = with_prior.over(&self.own, &all);
        let right = Mat::from_fn(self.own.len(), 1, |i, _| {
            let moved: f64 = step.iter().enumerate().map(|(j, step)| coupling[(i, j)] * step).sum();
            with_prior.right[(self.own[i], 0)] - moved
        });
        let setup = of_setup.solve(&right);
        self.own.iter().enumerate().for_each(|(i, j)| step[*j] = setup[(i, 0)]);

        let shared: Vec<usize> = parameters.iter().copied().filter(|j| !self.own.contains(j)).collect();
        let across = self.of_test.over(&self.own, &shared);
        let gained = self.of_test.over(&shared, &shared) - across.transpose() * of_setup.solve(&across);
        let columns = Mat::from_fn(step.len(), shared.len(), |i, k| if i == shared[k] { 1.0 } else { 0.0 });
        let inverse = information.solve(&columns);
        let covariance = Mat::from_fn(shared.len(), shared.len(), |i, k| inverse[(shared[i], k)]);
        let root = Symmetric::of(covariance.as_ref())?;
        let root =
            Mat::from_fn(shared.len(), shared.len(), |i, k| root.vectors[(i, k)] * root.values[k].max(0.0).sqrt());
        let variances = Symmetric::of((root.transpose() * &gained * &root).as_ref())?;
        if variances.values.iter().sum::<f64>() <= MAX_PREDICTED_VARIANCE * self.rows as f64 {
            return Ok(Ok(step));
        }
        let worst = (0..shared.len()).max_by(|a, b| variances.values[*a].total_cmp(&variances.values[*b])).unwrap_or(0);
        let direction = &root * variances.vectors.col(worst);
        let mut named: Vec<(f64, usize)> = direction.iter().map(|v| v.abs()).zip(shared).collect();
        named.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let largest = named.first().map_or(0.0, |(share, _)| *share);
        let named = named.into_iter().take(MAX_NAMED).filter(|(share, _)| *share >= NAMED_SHARE * largest);
        Ok(Err(named.map(|(_, j)| j).collect()))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;

    use super::*;
    use crate::fit::prepare;
    use crate::numerics::solve::Svd;

    /// Least squares of least norm over dense rows `[J | r]`, for the chosen columns scaled by their size.
    fn solved(rows: &Mat<f64>, columns: &[usize], size: &[f64]) -> Vec<f64> {
        let scaled = Mat::from_fn(rows.nrows(), columns.len(), |i, k| rows[(i, columns[k])] * size[columns[k]]);
        let right: Vec<f64> = (0..rows.nrows()).map(|i| rows[(i, size.len())]).collect();
        let solution = Svd::of(scaled.as_ref()).unwrap().solve(&right, 0.0);
        solution.iter().zip(columns).map(|(step, j)| step * size[*j]).collect()
    }

    /// Rows of a test and priors, one below another: those of `tests`, and the priors on the columns in `prior_of`.
    fn dense(problem: &Problem, beta: &[f64], tests: &[usize], prior_of: &[usize]) -> Mat<f64> {
        let values = problem.slot_values(beta);
        let mut parts: Vec<Mat<f64>> = Vec::new();
        for block in problem.blocks().iter().filter(|block| tests.contains(&block.test)) {
            let kept = problem.kept_rows(block);
            parts.push(problem.whitened(problem.rows(&values, block).unwrap(), &kept));
        }
        let width = beta.len() + 1;
        for j in prior_of {
            if let abbe_model::session::Prior::Gaussian(u) = problem.parameters.list[*j].prior {
                let entry = |k: usize| {
                    if k == *j {
                        1.0 / u
                    } else if k + 1 == width {
                        -beta[*j] / u
                    } else {
                        0.0
                    }
                };
                parts.push(Mat::from_fn(1, width, |_, k| entry(k)));
            }
        }
        let rows = parts.iter().map(Mat::nrows).sum();
        let mut all = Mat::zeros(rows, width);
        let mut start = 0;
        for part in &parts {
            all.get_mut(start..start + part.nrows(), ..).copy_from(part);
            start += part.nrows();
        }
        all
    }

    /// The factors of tests that follow from those of folds are those of their readings.
    #[test]
    fn folds_give_the_factors_of_tests() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        // Each reading many times, so that the readings take more to linearise than the factors to merge.
        for test in &mut session.tests {
            let readings = test.readings.as_ref().unwrap();
            let rows: Vec<usize> = (0..readings.rows()).flat_map(|row| [row; 30]).collect();
            test.readings = Some(std::sync::Arc::new(readings.of_rows(&rows)));
        }
        let (problem, fit) = prepare(&session, 1).unwrap();
        let of_folds = triangles_of_tests(&problem, &fit).unwrap();
        let of_tests = problem.folded_by_test().triangles(&fit.beta).unwrap();
        for (found, wanted) in of_folds.iter().zip(&of_tests) {
            let product = |triangle: &Triangle| triangle.rows().transpose() * triangle.rows();
            let (found, wanted) = (product(found), product(wanted));
            let size = |j: usize| wanted[(j, j)].sqrt();
            for (i, j) in (0..wanted.nrows()).flat_map(|i| (0..wanted.ncols()).map(move |j| (i, j))) {
                assert!((found[(i, j)] - wanted[(i, j)]).abs() <= 1e-8 * size(i) * size(j), "{i} {j}");
            }
        }
    }

    /// The residual of each left-out test equals that of two dense least-squares problems: the model from the rows of
    /// the other tests and all priors, then the set-up of the left-out test from its rows and priors.
    #[test]
    fn the_residuals_equal_those_of_two_dense_problems() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let (problem, fit) = prepare(&session, 1).unwrap();
        let found = left_out_tests(&problem, &fit.beta).unwrap();
        let (size, count) = (problem.parameters.sizes(), fit.beta.len());
        let all: Vec<usize> = (0..count).collect();
        let mut judged = 0;
        for test in (0..problem.models.len()).filter(|test| found.residuals[*test].is_some()) {
            let others: Vec<usize> = (0..problem.models.len()).filter(|other| *other != test).collect();
            let mut step = solved(&dense(&problem, &fit.beta, &others, &all), &all, &size);
            let own = own_setup(&problem, test);
            own.iter().for_each(|j| step[*j] = 0.0);
            let mut rows = dense(&problem, &fit.beta, &[test], &own);
            for i in 0..rows.nrows() {
                rows[(i, count)] -= (0..count).map(|j| rows[(i, j)] * step[j]).sum::<f64>();
            }
            solved(&rows, &own, &size).iter().zip(&own).for_each(|(value, j)| step[*j] = *value);
            let values = problem.slot_values(&fit.beta);
            let blocks = problem.blocks();
            let expected = blocks.iter().filter(|block| block.test == test).flat_map(|block| {
                let rows = problem.rows(&values, block).unwrap();
                let residual = |i: usize| rows[(i, count)] - (0..count).map(|j| rows[(i, j)] * step[j]).sum::<f64>();
                (0..rows.nrows()).map(residual).collect::<Vec<f64>>()
            });
            for (found, expected) in found.residuals[test].as_ref().unwrap().iter().zip(expected) {
                assert!((found - expected).abs() < 1e-8, "{found} {expected}");
            }
            judged += 1;
        }
        assert_eq!((judged, found.not_left_out.len()), (2, 2));
    }
}
