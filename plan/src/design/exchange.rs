//! Greedy choice of candidates and their exchange.
//!
//! Greedy: the candidate with the smallest figure is added, repeatedly. Exchange: each chosen candidate is removed in
//! turn and replaced by the best one, until none changes (Fedorov's algorithm: Atkinson, Donev & Tobias, Optimum
//! Experimental Designs, 2007, ch. 12).

use abbe_identify::numerics::parallel;
use abbe_identify::numerics::ranking::smallest_first;
use abbe_identify::numerics::reduction::inverse_of_upper;
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, Side};

use super::goal::Goal;
use super::information::{Root, SharedParameters, sum_of};

/// Relative gain below which a candidate is neither added nor exchanged.
pub const MIN_GAIN: f64 = 1e-6;
/// Largest number of rounds of exchanges.
const MAX_ROUNDS: usize = 30;

/// Candidates beside known information, and a goal.
pub struct Design<'d> {
    /// The shared parameters.
    pub shared: &'d SharedParameters,
    /// The information without candidates.
    pub base: &'d Root,
    /// The rows of each candidate, whitened: rows × shared parameters.
    pub rows: Vec<MatRef<'d, f64>>,
    /// What is made small.
    pub goal: &'d Goal,
    /// Whether a candidate may be chosen more than once.
    pub repeats: bool,
}

/// Whether a figure is not smaller than another beyond rounding.
pub fn is_no_gain(before: f64, after: f64) -> bool {
    before - after <= MIN_GAIN * before.abs()
}

impl Design<'_> {
    /// The information with some candidates.
    pub fn with(&self, chosen: &[usize]) -> Root {
        sum_of(std::iter::once(self.base.as_ref()).chain(chosen.iter().map(|candidate| self.rows[*candidate])))
    }

    /// The figure of some candidates.
    pub fn figure(&self, chosen: &[usize]) -> f64 {
        self.goal.figure(self.shared, &self.with(chosen))
    }

    /// The figures of each candidate beside others, whose information is `root`.
    pub fn figures(&self, root: &Root, others: &[usize]) -> Vec<f64> {
        let thin = Thin::of(self, root);
        parallel::map(self.rows.len(), &|candidate| match &thin {
            _ if !self.repeats && others.contains(&candidate) => f64::INFINITY,
            Some(thin) if 2 * self.rows[candidate].nrows() < root.ncols() => thin.figure(self.rows[candidate]),
            _ => self.goal.figure(self.shared, &sum_of([root.as_ref(), self.rows[candidate]].into_iter())),
        })
    }

    /// The candidate with the smallest figure beside others, and the figures of all. Of equal ones the first counts.
    pub fn best(&self, others: &[usize]) -> Option<(usize, Vec<f64>)> {
        let figures = self.figures(&self.with(others), others);
        let best = (0..figures.len()).min_by(|a, b| smallest_first(figures[*a], figures[*b]))?;
        figures[best].is_finite().then_some((best, figures))
    }

    /// A set of candidates, chosen one after the other.
    pub fn greedy(&self, count: usize) -> Vec<usize> {
        let mut chosen = Vec::with_capacity(count);
        while chosen.len() < count
            && let Some((best, _)) = self.best(&chosen)
        {
            chosen.push(best);
        }
        chosen
    }

    /// Exchanges candidates until nothing improves. The exchanges, as the candidate that goes and the one that comes.
    pub fn exchange(&self, chosen: &mut [usize]) -> Vec<[usize; 2]> {
        let mut exchanged = Vec::new();
        let mut now = self.figure(chosen);
        for _ in 0..MAX_ROUNDS {
            let before = exchanged.len();
            for place in 0..chosen.len() {
                let others: Vec<usize> =
                    chosen.iter().enumerate().filter(|(k, _)| *k != place).map(|(_, candidate)| *candidate).collect();
                let Some((best, figures)) = self.best(&others) else { continue };
                if !is_no_gain(now, figures[best]) {
                    exchanged.push([chosen[place], best]);
                    (chosen[place], now) = (best, figures[best]);
                }
            }
            if exchanged.len() == before {
                break;
            }
        }
        exchanged
    }

    /// A greedy set, exchanged. The worst uncertainty has many local optima: the set with the smallest mean variance is
    /// exchanged too, and the better result counts.
    pub fn run(&self, count: usize) -> Vec<usize> {
        let mut own = self.greedy(count);
        self.exchange(&mut own);
        if *self.goal != Goal::WorstUncertainty {
            return own;
        }
        let mean = Design { goal: &Goal::A, rows: self.rows.clone(), ..*self };
        let mut other = mean.greedy(count);
        mean.exchange(&mut other);
        self.exchange(&mut other);
        if self.figure(&other) < self.figure(&own) { other } else { own }
    }
}

/// Figures of candidates with few rows, from the inverse of a root: a product with it and a factor of the size of one
/// reading.
struct Thin<'t> {
    goal: &'t Goal,
    inverse: Mat<f64>,
    /// Number of parameters before the targets.
    first: usize,
    /// Display units per internal unit of each target, and its variance in display units.
    targets: Vec<[f64; 2]>,
    log_determinant: f64,
}

impl<'t> Thin<'t> {
    /// `None` for a separation.
    fn of(design: &'t Design<'_>, root: &Root) -> Option<Thin<'t>> {
        let shared = design.shared;
        if matches!(design.goal, Goal::Separation { .. }) {
            return None;
        }
        let first = shared.ids.len() - shared.targets;
        let displays = shared.display_per_internal[first..].iter();
        let targets = displays.zip(shared.uncertainties(root)).map(|(display, u)| [*display, u * u]).collect();
        let inverse = inverse_of_upper(root.as_ref());
        Some(Thin { goal: design.goal, inverse, first, targets, log_determinant: shared.log_determinant(root) })
    }

    fn figure(&self, rows: MatRef<'_, f64>) -> f64 {
        let z = self.inverse.transpose() * rows.transpose();
        let rest = z.as_ref().subrows(0, self.first);
        let of_targets = z.as_ref().subrows(self.first, self.targets.len());
        let one = |z: MatRef<'_, f64>| {
            let mut w = z.transpose() * z;
            (0..w.nrows()).for_each(|k| w[(k, k)] += 1.0);
            w
        };
        let w = one(z.as_ref());
        if *self.goal == Goal::D {
            // det C_T falls by det(I + zᵀz)/det(I + z_Rᵀz_R), with the rows z_R of all other parameters.
            let log = self.log_determinant + one(rest).determinant().ln() - w.determinant().ln();
            return self.goal.of_log_determinant(log, self.targets.len());
        }
        let Ok(factor) = w.llt(Side::Lower) else { return f64::INFINITY };
        let block = self.inverse.as_ref().submatrix(self.first, self.first, self.targets.len(), self.targets.len());
        let v = block * of_targets;
        let gained = factor.solve(v.transpose());
        self.goal.of_variances(self.targets.iter().enumerate().map(|(k, [display, variance])| {
            let gain: f64 = (0..w.nrows()).map(|i| v[(k, i)] * gained[(i, k)]).sum();
            (variance - gain * display * display).max(0.0)
        }))
    }
}
