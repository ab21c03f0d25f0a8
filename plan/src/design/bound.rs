//! How far a design is from the best one.
//!
//! The best `n` of the candidates are at most as good as the best weights `w ≥ 0` with the sum `n`. For a function `ψ` of
//! the information `M(w)` that is concave and larger for better designs, the equivalence theorem (Kiefer, Ann. Stat. 2
//! (1974) 849; Pukelsheim, Optimal Design of Experiments, 2006, ch. 7) bounds it from any weights by the largest
//! sensitivity of a candidate:
//!
//! ```text
//! ψ(best) ≤ ψ(M) + n max_i d_i − Σ_i w_i d_i,        d_i = tr(∇ψ J_iᵀJ_i)
//! ```
//!
//! `ψ` is `det(C)^(−1/p)` of the `p` targets for D, and `1/Σ λ_t C_tt` for A and for the worst uncertainty, whose weights
//! `λ` are those of the largest bound. The weights follow the multiplicative iteration `w_i ← w_i d_i^δ` (Yu, Ann. Stat. 38
//! (2010) 1593).

use abbe_identify::numerics::parallel;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::exchange::Design;
use super::goal::Goal;

/// Relative gap between bound and continuous design at which the iteration ends.
const GAP: f64 = 2e-3;
/// Largest number of iterations.
const MAX_ITERATIONS: usize = 1000;
/// Largest number of operations: some seconds.
const MAX_OPERATIONS: f64 = 6e9;
/// Exponent of the weights of the targets in the worst uncertainty.
const TARGET_EXPONENT: f64 = 0.5;

/// A lower bound of the value that any `chosen.len()` candidates can reach, in the unit of the goal. `None` for a
/// separation, or if the information is singular.
pub fn best_value(design: &Design<'_>, chosen: &[usize]) -> Option<f64> {
    if matches!(design.goal, Goal::Separation { .. }) || chosen.is_empty() {
        return None;
    }
    let candidates = Scaled::of(design);
    let count = chosen.len() as f64;
    let uniform = count / candidates.rows.len() as f64;
    let mut weights = vec![0.5 * uniform; candidates.rows.len()];
    chosen.iter().for_each(|candidate| weights[*candidate] += 0.5);
    let targets = design.shared.targets;
    let mut lambda = vec![1.0 / targets as f64; targets];
    let mut best: f64 = 0.0;
    for _ in 0..candidates.iterations() {
        let now = candidates.at(&weights, &lambda, design.goal)?;
        let largest = now.sensitivities.iter().copied().fold(0.0, f64::max);
        let mean: f64 = weights.iter().zip(&now.sensitivities).map(|(weight, d)| weight * d).sum();
        let bound = now.value / (1.0 + count * largest - mean).sqrt();
        best = best.max(bound);
        let reached = if *design.goal == Goal::WorstUncertainty { now.worst } else { now.value };
        if best >= (1.0 - GAP) * reached || mean <= 0.0 {
            break;
        }
        let exponent = if *design.goal == Goal::D { 1.0 } else { 0.5 };
        weights.iter_mut().zip(&now.sensitivities).for_each(|(weight, d)| *weight *= (d / largest).powf(exponent));
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight *= count / sum);
        if *design.goal == Goal::WorstUncertainty {
            lambda.iter_mut().zip(&now.variances).for_each(|(own, variance)| *own *= variance.powf(TARGET_EXPONENT));
            let sum: f64 = lambda.iter().sum();
            lambda.iter_mut().for_each(|own| *own /= sum);
        }
    }
    Some(best)
}

/// The candidates at the physical sizes of the parameters.
struct Scaled {
    rows: Vec<Mat<f64>>,
    base: Mat<f64>,
    /// Number of parameters before the targets.
    first: usize,
    /// Display units per physical size, of each target.
    display: Vec<f64>,
}

/// The continuous design at some weights.
struct Now {
    /// Value of the goal with the weights of its targets, display units.
    value: f64,
    /// The largest uncertainty, display units.
    worst: f64,
    variances: Vec<f64>,
    /// The relative increase of `ψ` by a unit weight of each candidate.
    sensitivities: Vec<f64>,
}

impl Scaled {
    fn of(design: &Design<'_>) -> Scaled {
        let shared = design.shared;
        let scaled = |rows: faer::MatRef<'_, f64>| {
            Mat::from_fn(rows.nrows(), rows.ncols(), |i, j| rows[(i, j)] * shared.size[j])
        };
        let root = scaled(design.base.as_ref());
        let first = shared.ids.len() - shared.targets;
        Scaled {
            rows: design.rows.iter().map(|rows| scaled(*rows)).collect(),
            base: root.transpose() * &root,
            first,
            display: (first..shared.ids.len()).map(|j| shared.size[j] * shared.display_per_internal[j]).collect(),
        }
    }

    fn iterations(&self) -> usize {
        let columns = self.base.ncols() as f64;
        let rows: usize = self.rows.iter().map(Mat::nrows).sum();
        let operations = 4.0 * rows as f64 * columns * columns;
        ((MAX_OPERATIONS / operations) as usize).clamp(3, MAX_ITERATIONS)
    }

    fn at(&self, weights: &[f64], lambda: &[f64], goal: &Goal) -> Option<Now> {
        let mut information = self.base.clone();
        let sums = parallel::map(CHUNKS, &|chunk| {
            let mut sum = Mat::<f64>::zeros(information.nrows(), information.ncols());
            for candidate in (chunk..self.rows.len()).step_by(CHUNKS) {
                let rows = &self.rows[candidate];
                sum += faer::Scale(weights[candidate]) * (rows.transpose() * rows);
            }
            sum
        });
        sums.iter().for_each(|sum| information += sum);
        let columns = information.ncols();
        let covariance = information.llt(Side::Lower).ok()?.solve(Mat::<f64>::identity(columns, columns));
        let targets = self.display.len();
        // The columns of the targets, in display units.
        let of_targets = Mat::from_fn(columns, targets, |i, t| covariance[(i, self.first + t)] * self.display[t]);
        let variances: Vec<f64> = (0..targets).map(|t| of_targets[(self.first + t, t)] * self.display[t]).collect();
        let worst = variances.iter().copied().fold(0.0, f64::max).sqrt();
        let gradient = if *goal == Goal::D {
            let own = Mat::from_fn(targets, targets, |i, t| of_targets[(self.first + i, t)] * self.display[i]);
            let factor = own.llt(Side::Lower).ok()?;
            let log: f64 = (0..targets).map(|t| 2.0 * factor.L()[(t, t)].ln()).sum();
            let inverse = factor.solve(Mat::<f64>::identity(targets, targets));
            let root = inverse.llt(Side::Lower).ok()?;
            let share = (1.0 / targets as f64).sqrt();
            (goal.of_log_determinant(log, targets), faer::Scale(share) * (&of_targets * root.L()))
        } else {
            let sum: f64 = variances.iter().zip(lambda).map(|(variance, own)| variance * own).sum();
            let weighted = Mat::from_fn(columns, targets, |i, t| of_targets[(i, t)] * (lambda[t] / sum).sqrt());
            (sum.sqrt(), weighted)
        };
        let (value, direction) = gradient;
        let sensitivities =
            parallel::map(self.rows.len(), &|candidate| (&self.rows[candidate] * &direction).squared_norm_l2());
        // ψ is the inverse square of the value for A, and of the geometric mean for D.
        Some(Now { value, worst, variances, sensitivities })
    }
}

/// Parts of the sum over candidates that are formed beside each other.
const CHUNKS: usize = 16;

#[cfg(test)]
mod tests {
    use super::super::information::SharedParameters;
    use super::*;

    /// Candidates of a polynomial of the second degree on −1 … 1: one row each.
    fn polynomial() -> Vec<Mat<f64>> {
        (0..=200).map(|k| Mat::from_fn(1, 3, |_, j| (0.01 * f64::from(k) - 1.0).powi(j as i32))).collect()
    }

    fn bound(goal: &Goal, chosen: &[usize], ridge: f64) -> (f64, f64) {
        let rows = polynomial();
        let shared = SharedParameters {
            ids: ["EX0C", "EY0C", "EZ0C"].map(|id| id.parse().unwrap()).to_vec(),
            size: vec![1.0; 3],
            display_per_internal: vec![1.0; 3],
            targets: 3,
        };
        let base = Mat::from_fn(3, 3, |i, j| if i == j { ridge } else { 0.0 });
        let rows = rows.iter().map(|rows| rows.as_ref()).collect();
        let design = Design { shared: &shared, base: &base, rows, goal, repeats: true };
        (best_value(&design, chosen).unwrap(), goal.value(&shared, &design.with(chosen)))
    }

    /// The continuous optima of a parabola (Pukelsheim 2006, ch. 9): D has weights 1/3 at −1, 0, 1, with
    /// `det M = n³·4/27`; A has 1/4, 1/2, 1/4, with `tr C = 8/n`.
    #[test]
    fn the_bound_is_the_continuous_optimum_of_a_parabola() {
        let (of_d, value) = bound(&Goal::D, &[0, 100, 200, 30, 150, 60], 1e-6);
        let best = (27.0_f64 / 4.0 / 216.0).powf(1.0 / 6.0);
        assert!(of_d <= best * (1.0 + 1e-6) && of_d > 0.995 * best, "{of_d} {best}");
        assert!(value > best);
        let (of_a, _) = bound(&Goal::A, &[0, 100, 200, 30, 150, 60, 1, 2], 1e-6);
        let best = (8.0_f64 / 8.0 / 3.0).sqrt();
        assert!(of_a <= best * (1.0 + 1e-6) && of_a > 0.995 * best, "{of_a} {best}");
        // A design that is the optimum reaches its bound.
        let (own, value) = bound(&Goal::A, &[0, 100, 100, 200], 1e-6);
        assert!((value / own - 1.0).abs() < 5e-3 && own <= value * (1.0 + 1e-9), "{own} {value}");
    }

    /// With weights `u` at zero and `v` at both ends together, the variances are `1/u`, `1/v` and `1/u + 1/v`: the
    /// worst one is smallest with `u = v`.
    #[test]
    fn the_bound_of_the_worst_uncertainty_is_its_optimum() {
        let (own, value) = bound(&Goal::WorstUncertainty, &[0, 100, 100, 200], 1e-6);
        assert!((value * value - 1.0).abs() < 1e-6, "{value}");
        assert!(own <= value * (1.0 + 1e-9) && own > 0.99 * value, "{own} {value}");
    }
}
