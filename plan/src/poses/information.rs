//! The covariance of a set of poses, and the exchange of poses.
//!
//! With the scaled Jacobian `J` of a pose and the covariance `C` of the others
//!
//! ```text
//! C − V (I + J V)⁻¹ Vᵀ,   V = C Jᵀ        with the pose          C + V (I − J V)⁻¹ Vᵀ        without it
//! ```
//!
//! so that a candidate costs a product with `C` and a factor of the size of one reading.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::PoseCriterion;
use crate::PlanError;
use abbe_identify::numerics::parallel;
use abbe_identify::numerics::solve::Directions;
use abbe_identify::numerics::triangle::Triangle;
use abbe_identify::problem::{Problem, RowBlock};

/// Information of a unit weight on every parameter at its physical size. It makes the covariance of few poses exist.
const RIDGE: f64 = 1e-6;
/// Share of the mean variance in the criterion of the worst one, so that ties are decided.
const TIE: f64 = 1e-3;
/// Largest number of rounds.
const MAX_ROUNDS: usize = 30;
/// Relative gain below which poses are not exchanged.
const MIN_GAIN: f64 = 1e-9;

/// The candidates' information, and the criterion.
pub(super) struct Exchange {
    /// Whitened rows of each candidate, coordinates × parameters, at the physical sizes of the parameters.
    rows: Vec<Mat<f64>>,
    /// Rows of the priors, at the physical sizes of the parameters.
    prior: Mat<f64>,
    /// Information of the priors and the ridge.
    base: Mat<f64>,
    /// The parameters that the criterion counts.
    targets: Vec<usize>,
    /// Display units per physical size, of each target.
    display: Vec<f64>,
    criterion: PoseCriterion,
}

impl Exchange {
    /// The candidates are the readings of all tests, in their order.
    pub fn new(
        problem: &Problem,
        kept: &[usize],
        targets: &[usize],
        criterion: PoseCriterion,
    ) -> Result<Exchange, PlanError> {
        let list = &problem.parameters.list;
        let nominal = vec![0.0; list.len()];
        let values = problem.slot_values(&nominal);
        let sigma = problem.noise.sigma_mm;
        let mut rows = Vec::new();
        for (test, model) in problem.models.iter().enumerate() {
            let channels = problem.channels(test);
            let whole = problem.rows(&values, &RowBlock { test, rows: 0..model.rows() })?;
            rows.extend((0..model.rows()).map(|pose| {
                Mat::from_fn(channels, kept.len(), |i, k| {
                    whole[(pose * channels + i, kept[k])] * list[kept[k]].size / sigma
                })
            }));
        }
        let prior = problem.prior_triangle(&nominal).r();
        let scaled = Mat::from_fn(prior.nrows(), kept.len(), |i, k| prior[(i, kept[k])] * list[kept[k]].size);
        let mut base = scaled.transpose() * &scaled;
        (0..kept.len()).for_each(|k| base[(k, k)] += RIDGE);
        let display = |k: &usize| list[kept[*k]].size * list[kept[*k]].unit.display_per_internal;
        Ok(Exchange {
            rows,
            prior: scaled,
            base,
            targets: targets.to_vec(),
            display: targets.iter().map(display).collect(),
            criterion,
        })
    }

    /// The covariance of a set of poses; `None` if it is singular.
    fn covariance(&self, poses: &[usize]) -> Option<Mat<f64>> {
        let mut information = self.base.clone();
        for pose in poses {
            information += self.rows[*pose].transpose() * &self.rows[*pose];
        }
        let n = information.nrows();
        let factor = information.llt(Side::Lower).ok()?;
        Some(factor.solve(Mat::<f64>::identity(n, n)))
    }

    /// Numerical rank of the readings of some poses with the priors, without the ridge, and the number of parameters
    /// that they involve: the place of a socket without a pose is none of them. The uncertainties of poses of full rank
    /// contain the ridge with a share of at most [`RIDGE`].
    pub fn rank(&self, poses: &[usize]) -> Result<[usize; 2], PlanError> {
        let involved = |k: &usize| {
            self.targets.contains(k) || poses.iter().any(|pose| self.rows[*pose].col(*k).iter().any(|x| *x != 0.0))
        };
        let [own, others]: [Vec<usize>; 2] = {
            let (own, others) = (0..self.prior.ncols()).partition(involved);
            [own, others]
        };
        // A prior that connects a parameter with one that is not involved tells nothing of it.
        let is_own = |row: &usize| others.iter().all(|k| self.prior[(*row, *k)] == 0.0);
        let prior_rows: Vec<usize> = (0..self.prior.nrows()).filter(is_own).collect();
        let prior = Mat::from_fn(prior_rows.len(), own.len() + 1, |i, k| {
            own.get(k).map_or(0.0, |column| self.prior[(prior_rows[i], *column)])
        });
        let mut rows = Triangle::new(own.len());
        for pose in poses {
            let block = &self.rows[*pose];
            let with_residuals =
                Mat::from_fn(block.nrows(), own.len() + 1, |i, k| own.get(k).map_or(0.0, |column| block[(i, *column)]));
            rows.absorb(with_residuals.as_ref());
        }
        rows.absorb(prior.as_ref());
        Ok([Directions::of(rows.r().as_ref())?.identifiable_rank(), own.len()])
    }

    /// Standard uncertainties of the targets at some poses, in display units.
    pub fn uncertainties(&self, poses: &[usize]) -> Vec<f64> {
        let Some(covariance) = self.covariance(poses) else {
            return vec![f64::INFINITY; self.targets.len()];
        };
        let of = |(target, display): (&usize, &f64)| covariance[(*target, *target)].max(0.0).sqrt() * display;
        self.targets.iter().zip(&self.display).map(of).collect()
    }

    /// The criterion of a set of poses, in display units.
    pub fn value(&self, poses: &[usize]) -> f64 {
        let u = self.uncertainties(poses);
        match self.criterion {
            PoseCriterion::WorstUncertainty => u.into_iter().fold(0.0, f64::max),
            PoseCriterion::A => (u.iter().map(|u| u * u).sum::<f64>() / u.len() as f64).sqrt(),
            PoseCriterion::D => {
                let determinant = self.covariance(poses).and_then(|covariance| self.log_determinant(&covariance));
                determinant.map_or(f64::INFINITY, |log| (0.5 * log / self.targets.len() as f64).exp())
            }
        }
    }

    /// The logarithm of the determinant of the targets' covariance in display units.
    fn log_determinant(&self, covariance: &Mat<f64>) -> Option<f64> {
        let own = self.of_targets(covariance);
        let factor = own.llt(Side::Lower).ok()?;
        let diagonal = factor.L().diagonal();
        let roots: f64 = (0..own.nrows()).map(|k| diagonal[k].ln()).sum();
        Some(2.0 * roots)
    }

    /// The covariance of the targets in display units.
    fn of_targets(&self, covariance: &Mat<f64>) -> Mat<f64> {
        let targets = &self.targets;
        Mat::from_fn(targets.len(), targets.len(), |i, k| {
            covariance[(targets[i], targets[k])] * self.display[i] * self.display[k]
        })
    }

    /// A greedy set of poses, exchanged until nothing improves. The worst uncertainty has many local optima: it is also
    /// exchanged from the set with the smallest mean variance, and the better result counts.
    pub fn run(&self, count: usize) -> Vec<usize> {
        let own = self.exchanged(self.greedy(count));
        if self.criterion != PoseCriterion::WorstUncertainty {
            return own;
        }
        let mean = Exchange { criterion: PoseCriterion::A, base: self.base.clone(), ..self.parts() };
        let other = self.exchanged(mean.exchanged(mean.greedy(count)));
        if self.value(&other) < self.value(&own) { other } else { own }
    }

    fn parts(&self) -> Exchange {
        Exchange {
            rows: self.rows.clone(),
            prior: self.prior.clone(),
            base: Mat::new(),
            targets: self.targets.clone(),
            display: self.display.clone(),
            criterion: self.criterion,
        }
    }

    fn greedy(&self, count: usize) -> Vec<usize> {
        let mut chosen = Vec::with_capacity(count);
        while chosen.len() < count {
            let Some(covariance) = self.covariance(&chosen) else { break };
            match self.best(&covariance, &chosen) {
                Some((best, _)) => chosen.push(best),
                None => break,
            }
        }
        chosen
    }

    fn exchanged(&self, mut chosen: Vec<usize>) -> Vec<usize> {
        let mut now = self.figure_of(&chosen);
        for _ in 0..MAX_ROUNDS {
            let mut changed = false;
            for place in 0..chosen.len() {
                let others: Vec<usize> =
                    chosen.iter().enumerate().filter(|(k, _)| *k != place).map(|(_, pose)| *pose).collect();
                let Some(covariance) = self.covariance(&others) else { continue };
                let Some((best, figure)) = self.best(&covariance, &others) else { continue };
                if figure < now - MIN_GAIN * now.abs() {
                    (chosen[place], now) = (best, figure);
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        chosen
    }

    /// The candidate with the smallest figure beside some poses.
    fn best(&self, covariance: &Mat<f64>, others: &[usize]) -> Option<(usize, f64)> {
        let inverse = match self.criterion {
            PoseCriterion::D => {
                let own = self.of_targets(covariance);
                Some((self.log_determinant(covariance)?, own.llt(Side::Lower).ok()?))
            }
            PoseCriterion::A | PoseCriterion::WorstUncertainty => None,
        };
        let figure = |pose: usize| -> f64 {
            if others.contains(&pose) {
                return f64::INFINITY;
            }
            let j = &self.rows[pose];
            let v = covariance * j.transpose();
            let mut w = j * &v;
            (0..w.nrows()).for_each(|k| w[(k, k)] += 1.0);
            let Ok(factor) = w.llt(Side::Lower) else { return f64::INFINITY };
            match &inverse {
                None => {
                    let gained = factor.solve(v.transpose());
                    let variance = |(k, display): (usize, &f64)| {
                        let target = self.targets[k];
                        let gain: f64 = (0..w.nrows()).map(|i| v[(target, i)] * gained[(i, target)]).sum();
                        (covariance[(target, target)] - gain) * display * display
                    };
                    self.of_variances(self.display.iter().enumerate().map(variance))
                }
                Some((log, own)) => {
                    // det(C_T − V_T W⁻¹ V_Tᵀ) = det(C_T) det(W − V_Tᵀ C_T⁻¹ V_T)/det(W)
                    let vt =
                        Mat::from_fn(self.targets.len(), w.nrows(), |k, i| v[(self.targets[k], i)] * self.display[k]);
                    let smaller = &w - vt.transpose() * own.solve(&vt);
                    log + (smaller.determinant() / w.determinant()).max(f64::MIN_POSITIVE).ln()
                }
            }
        };
        let figures = parallel::map(self.rows.len(), &figure);
        let best = (0..figures.len()).min_by(|a, b| figures[*a].total_cmp(&figures[*b]))?;
        figures[best].is_finite().then_some((best, figures[best]))
    }

    /// The figure that exchanges compare, of a set of poses.
    fn figure_of(&self, poses: &[usize]) -> f64 {
        match self.criterion {
            PoseCriterion::D => {
                self.covariance(poses).and_then(|covariance| self.log_determinant(&covariance)).unwrap_or(f64::INFINITY)
            }
            PoseCriterion::A | PoseCriterion::WorstUncertainty => {
                self.of_variances(self.uncertainties(poses).into_iter().map(|u| u * u))
            }
        }
    }

    fn of_variances(&self, variances: impl Iterator<Item = f64>) -> f64 {
        let (mut sum, mut worst, mut count) = (0.0, 0.0_f64, 0.0_f64);
        for variance in variances {
            sum += variance;
            worst = worst.max(variance);
            count += 1.0;
        }
        match self.criterion {
            PoseCriterion::WorstUncertainty => worst + TIE * sum / count.max(1.0),
            PoseCriterion::A | PoseCriterion::D => sum,
        }
    }
}
