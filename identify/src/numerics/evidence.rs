//! Scales of Gaussian priors by maximum marginal likelihood (type-II maximum likelihood), from normal equations.
//!
//! Readings `y = J b + e` have noise of the variance `v`. The parameters of family `f` have independent Gaussian priors
//! with mean zero and precision `α_f = 1/τ_f²`; the others have a fixed prior. With `H = JᵀJ/v + P + diag(α)`, the
//! posterior mean `b` and `C = H⁻¹`, the log marginal likelihood is, up to a constant,
//!
//! ```text
//! ln Z = −½ (‖y − J b‖²/v + prior terms + ln|H| − Σ_f m_f ln α_f)
//! ∂ ln Z/∂ ln α_f = ½ (γ_f − α_f ‖b_f‖²),   γ_f = m_f − α_f tr C_ff
//! ```
//!
//! `γ_f` is the effective number of parameters of a family of `m_f` (MacKay, Neural Computation 4 (1992) 415). Newton
//! steps on `ln α` use the exact second derivatives; where these are not concave, MacKay's fixed point
//! `α_f = γ_f/‖b_f‖²` replaces the step. Steps that do not raise `ln Z` are halved, so the iteration is monotone.

use abbe_model::Diagnostic;
use faer::linalg::solvers::DenseSolveCore;
use faer::prelude::Solve;
use faer::{Mat, Side};

use super::products::NormalProducts;
use crate::error;

/// The normal equations of readings of unit variance, the fixed priors, and the families.
#[derive(Clone, Debug)]
pub(crate) struct NormalEquations {
    /// The readings.
    pub readings: NormalProducts,
    /// `P`: precision of the fixed priors.
    pub prior: Mat<f64>,
    /// The fixed priors times their means.
    pub prior_projection: Vec<f64>,
    /// The parameters of each family.
    pub families: Vec<Vec<usize>>,
}

/// The posterior distribution of the parameters for given scales.
pub(crate) struct Posterior {
    /// Mean.
    pub mean: Vec<f64>,
    /// Covariance.
    pub covariance: Mat<f64>,
    /// Effective number of parameters of each family.
    pub effective: Vec<f64>,
    /// Effective number of all parameters: those that the readings determine.
    pub effective_total: f64,
    /// Log marginal likelihood at this noise variance, up to a constant.
    pub log_evidence: f64,
    /// `‖y − J b‖²`.
    pub residual_square: f64,
}

/// Largest change of `ln α` in one step: a factor of 20 in the precision.
const MAX_STEP: f64 = 3.0;
/// Gain of `ln Z` below which the iteration ends.
const MIN_GAIN: f64 = 1e-5;
/// Maximum number of steps. From six orders of magnitude away, some ten are needed.
const MAX_STEPS: usize = 60;
/// Limits of `ln α`, in units of the parameters: scales of 1 and 10⁻⁶ physical sizes.
const LIMITS: [f64; 2] = [0.0, 27.6];

impl NormalEquations {
    /// `H` for a noise variance and the precisions of the families.
    pub fn information(&self, variance: f64, precisions: &[f64]) -> Mat<f64> {
        let (gram, weight) = (&self.readings.gram, 1.0 / variance);
        let mut information =
            Mat::from_fn(gram.nrows(), gram.ncols(), |i, j| self.prior[(i, j)] + gram[(i, j)] * weight);
        for (family, precision) in self.families.iter().zip(precisions) {
            for j in family {
                information[(*j, *j)] += precision;
            }
        }
        information
    }

    /// The right-hand side of the normal equations: `Jᵀy/v` and the fixed priors.
    pub fn right_side(&self, variance: f64) -> Vec<f64> {
        self.readings
            .projection
            .iter()
            .zip(&self.prior_projection)
            .map(|(of_readings, of_prior)| of_readings / variance + of_prior)
            .collect()
    }

    /// The posterior for a noise variance and the precisions of the families.
    ///
    /// # Errors
    /// If the normal equations are not positive definite.
    pub fn posterior(&self, variance: f64, precisions: &[f64]) -> Result<Posterior, Diagnostic> {
        let information = self.information(variance, precisions);
        let count = information.nrows();
        let factor = information.llt(Side::Lower).map_err(|_| error::decomposition())?;
        let right = self.right_side(variance);
        let column = Mat::from_fn(count, 1, |i, _| right[i]);
        let mean: Vec<f64> = factor.solve(&column).col(0).iter().copied().collect();
        let covariance = factor.inverse();
        let lower = factor.L();
        let log_determinant: f64 = (0..count).map(|i| 2.0 * lower[(i, i)].ln()).sum();
        let log_precisions: f64 =
            self.families.iter().zip(precisions).map(|(family, precision)| family.len() as f64 * precision.ln()).sum();
        let explained: f64 = right.iter().zip(&mean).map(|(right, mean)| right * mean).sum();
        let trace = |family: &[usize]| family.iter().map(|j| covariance[(*j, *j)]).sum::<f64>();
        let effective: Vec<f64> = (self.families.iter().zip(precisions))
            .map(|(family, precision)| (family.len() as f64 - precision * trace(family)).max(0.0))
            .collect();
        let of_column = |j: usize| self.prior.col_as_slice(j).iter().zip(covariance.col_as_slice(j));
        let fixed: f64 = (0..count).flat_map(of_column).map(|(prior, covariance)| prior * covariance).sum();
        let in_families: f64 = self.families.iter().map(|family| family.len() as f64).sum();
        let effective_total = count as f64 - in_families - fixed + effective.iter().sum::<f64>();
        Ok(Posterior {
            log_evidence: -0.5 * (self.readings.square / variance - explained + log_determinant - log_precisions),
            residual_square: self.readings.residual_square(&mean),
            mean,
            covariance,
            effective,
            effective_total,
        })
    }

    /// The precisions of the families at the maximum of the marginal likelihood for a noise variance, and the posterior
    /// there. A family that explains nothing reaches the limit of small scales. A start must leave the readings some
    /// influence: from precisions far above theirs the evidence has no slope.
    ///
    /// # Errors
    /// If the normal equations are not positive definite.
    pub fn maximise(&self, variance: f64, start: &[f64]) -> Result<(Vec<f64>, Posterior), Diagnostic> {
        let mut precisions = start.to_vec();
        let mut present = self.posterior(variance, &precisions)?;
        for _ in 0..MAX_STEPS {
            let Some(step) = self.step(&present, &precisions) else { break };
            let mut share = 1.0;
            let mut next = None;
            while next.is_none() && share > 1e-3 {
                let trial: Vec<f64> = (precisions.iter().zip(&step))
                    .map(|(precision, by)| (precision.ln() + share * by).clamp(LIMITS[0], LIMITS[1]).exp())
                    .collect();
                let posterior = self.posterior(variance, &trial)?;
                if posterior.log_evidence >= present.log_evidence {
                    next = Some((trial, posterior));
                }
                share *= 0.3;
            }
            let Some((trial, posterior)) = next else { break };
            let gain = posterior.log_evidence - present.log_evidence;
            (precisions, present) = (trial, posterior);
            if gain < MIN_GAIN {
                break;
            }
        }
        Ok((precisions, present))
    }

    /// The step of `ln α`; `None` at the maximum.
    fn step(&self, present: &Posterior, precisions: &[f64]) -> Option<Vec<f64>> {
        let count = self.families.len();
        let squares: Vec<f64> =
            self.families.iter().map(|family| family.iter().map(|j| present.mean[*j].powi(2)).sum()).collect();
        let gradient: Vec<f64> =
            (0..count).map(|f| 0.5 * (present.effective[f] - precisions[f] * squares[f])).collect();
        let cross = |f: usize, g: usize| {
            let (mut quadratic, mut square) = (0.0, 0.0);
            for i in &self.families[f] {
                for j in &self.families[g] {
                    let c = present.covariance[(*i, *j)];
                    quadratic += present.mean[*i] * c * present.mean[*j];
                    square += c * c;
                }
            }
            precisions[f] * precisions[g] * (quadratic + 0.5 * square)
        };
        // Minus the second derivatives.
        let curvature = Mat::from_fn(count, count, |f, g| {
            let own = self.families[f].len() as f64 - present.effective[f] + precisions[f] * squares[f];
            (if f == g { 0.5 * own } else { 0.0 }) - cross(f.max(g), f.min(g))
        });
        let newton = curvature.llt(Side::Lower).ok().map(|factor| {
            let solution = factor.solve(&Mat::from_fn(count, 1, |f, _| gradient[f]));
            (0..count).map(|f| solution[(f, 0)]).collect::<Vec<f64>>()
        });
        let step = match newton.filter(|step| step.iter().all(|by| by.abs() <= MAX_STEP)) {
            Some(step) => step,
            None => (0..count)
                .map(|f| {
                    let fixed_point = (present.effective[f] / squares[f].max(f64::MIN_POSITIVE)).max(f64::MIN_POSITIVE);
                    (fixed_point / precisions[f]).ln().clamp(-MAX_STEP, MAX_STEP)
                })
                .collect(),
        };
        let expected: f64 = step.iter().zip(&gradient).map(|(by, gradient)| by * gradient).sum();
        (expected > MIN_GAIN).then_some(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One-way random effects in balanced groups: `n` readings of each of `m` groups. With the between-group mean
    /// square `A = Σ ȳ²/m`, the maximum is at `τ² = A − v/n` (Searle, Casella & McCulloch, Variance Components, 1992,
    /// section 3.7, for a known mean), or at zero.
    #[test]
    fn the_scale_of_random_effects_is_the_closed_form() {
        let (groups, of_group, variance) = (6, 5.0, 0.3);
        for spread in [0.3, 0.01] {
            let means: Vec<f64> = (0..groups).map(|k| spread * ((7 * k % 5) as f64 - 1.7)).collect();
            let square = means.iter().map(|mean| of_group * mean * mean).sum::<f64>() + 12.0;
            let equations = NormalEquations {
                readings: NormalProducts {
                    gram: Mat::from_fn(groups, groups, |i, j| if i == j { of_group } else { 0.0 }),
                    projection: means.iter().map(|mean| of_group * mean).collect(),
                    square,
                },
                prior: Mat::zeros(groups, groups),
                prior_projection: vec![0.0; groups],
                families: vec![(0..groups).collect()],
            };
            let expected = means.iter().map(|mean| mean * mean).sum::<f64>() / groups as f64 - variance / of_group;
            for start in [1.0, 100.0, 1e4] {
                let (precisions, posterior) = equations.maximise(variance, &[start]).unwrap();
                if expected > 0.0 {
                    // The iteration ends within MIN_GAIN of the maximum: ½·(m/2)·(δ ln α)² = 10⁻⁵.
                    assert!((1.0 / precisions[0] / expected - 1.0).abs() < 3e-3, "{start}: {precisions:?} {expected}");
                    let shrunk = of_group / (of_group + variance / expected);
                    assert!((posterior.effective[0] / (groups as f64 * shrunk) - 1.0).abs() < 1e-3);
                    assert!((posterior.mean[1] / (means[1] * shrunk) - 1.0).abs() < 1e-3);
                } else {
                    assert!(posterior.effective[0] < 0.05, "{start}: {}", posterior.effective[0]);
                }
            }
        }
    }

    /// Two families beside two parameters with a fixed prior. The maximum is that of `scipy.optimize.minimize`
    /// (Nelder–Mead) over the density of `y` with the covariance `v I + J D Jᵀ`, in NumPy, to 10⁻⁶.
    #[test]
    fn the_scales_of_two_families_are_those_of_scipy() {
        let (rows, variance) = (60, 0.1);
        let column = |i: usize, j: usize| -> f64 {
            let t = (i * 37 % rows) as f64 / rows as f64 * std::f64::consts::TAU * 0.7;
            match j {
                0 => 1.0,
                1 => t,
                2..12 => {
                    let (sin, cos) = ((j / 2) as f64 * t).sin_cos();
                    if j.is_multiple_of(2) { cos } else { sin }
                }
                // The unit of the second family keeps its scale below one physical size.
                12 => ((i * 11 % 17) as f64 - 8.0) / 0.8,
                _ => ((i * 7 % 13) as f64 - 6.0) / 0.6,
            }
        };
        let b = [3.0, -1.0, 0.5, -0.2, 0.1, 0.3, -0.4, 0.05, 0.2, 0.1, -0.15, 0.25, 0.15, -0.2];
        let jacobian = Mat::from_fn(rows, b.len(), column);
        let y = Mat::from_fn(rows, 1, |i, _| {
            let model: f64 = (0..b.len()).map(|j| column(i, j) * b[j]).sum();
            model + ((i * 29 % 23) as f64 - 11.0) / 11.0 * 0.5
        });
        let projection = jacobian.transpose() * &y;
        let equations = NormalEquations {
            readings: NormalProducts {
                gram: jacobian.transpose() * &jacobian,
                projection: (0..b.len()).map(|j| projection[(j, 0)]).collect(),
                square: y.squared_norm_l2(),
            },
            prior: Mat::from_fn(b.len(), b.len(), |i, j| if i == j && i < 2 { 0.01 } else { 0.0 }),
            prior_projection: vec![0.0; b.len()],
            families: vec![(2..12).collect(), vec![12, 13]],
        };
        for start in [[1.0, 1e6], [1.0, 1.0], [1e5, 1.0]] {
            let (precisions, posterior) = equations.maximise(variance, &start).unwrap();
            for (precision, expected) in precisions.iter().zip([2.567_905, -1.116_190 + 2.0 * 10_f64.ln()]) {
                assert!((precision.ln() - expected).abs() < 5e-3, "{start:?}: {precisions:?}");
            }
            for (effective, expected) in posterior.effective.iter().zip([6.956_811, 1.996_027]) {
                assert!((effective - expected).abs() < 5e-3, "{effective} {expected}");
            }
        }
    }
}
