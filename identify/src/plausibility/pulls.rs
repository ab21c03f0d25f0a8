//! Pulls of set-up parameters: the deviation of the estimate from the stated value, over its standard deviation.
//!
//! With `P` the stated variances, `V` the covariance after the fit, and `A = V⁻¹ − P⁻¹` the information of the
//! readings, the estimate is `m = V A θ + V Jᵀ W ε`. If the session is right, θ scatters by `P` and ε by `κ` times the
//! variance that the fit assumes, so that
//!
//! ```text
//! Cov m = (P − 2 V + V P⁻¹ V) + κ (V − V P⁻¹ V),    for κ = 1:  P − V
//! ```
//!
//! Errors of the machine have no prior and do not enter: the estimate is unbiased in them. A pull is `m / √(Cov m)`,
//! standard normal whatever the number of readings. Readings whose noise is serially correlated count less: `κ` is the
//! excess of their χ² times `(1 + ρ)/(1 − ρ)`.

use abbe_model::session::Prior;
use faer::Mat;

use crate::fit::Fit;
use crate::noise::enlargement_of_mean;
use crate::numerics::gain::ObservableSubspace;
use crate::numerics::tails::{chi_square_quantile, chi_square_tail, normal_quantile};
use crate::problem::Problem;

/// Probability that a correct session is reported as contradicted, once for the largest pull and once for all set-up
/// parameters together.
const SIGNIFICANCE: f64 = 1e-4;
/// A parameter whose estimate scatters by less than this share of its stated uncertainty is not tested.
const MIN_SHARE: f64 = 0.1;
/// More set-up parameters than this are tested one by one only.
const MAX_TESTED_JOINTLY: usize = 200;
/// Least share of the stated variance by which the estimates scatter along a direction that the readings determine.
const DETERMINED: f64 = 0.5;
/// Largest autocorrelation that is attributed to noise.
const MAX_CORRELATED: f64 = 0.95;

/// One set-up parameter with a stated uncertainty.
#[derive(Clone, Debug)]
pub struct Pull {
    /// Index of the parameter.
    pub parameter: usize,
    /// Its estimate, mm or rad.
    pub estimate: f64,
    /// Its stated standard uncertainty, mm or rad.
    pub stated_u: f64,
    /// Estimate over the standard deviation that it has if the session is right.
    pub pull: f64,
}

/// The pulls of a fit.
#[derive(Clone, Debug, Default)]
pub struct Pulls {
    /// Of every set-up parameter about which the readings contain information.
    pub each: Vec<Pull>,
    /// Absolute pull above which a parameter contradicts its statement (Bonferroni over `each`).
    pub limit: f64,
    /// χ² of all set-up parameters in the directions that the readings determine, and how many these are.
    pub together: f64,
    /// Degrees of freedom of `together`.
    pub freedom: usize,
}

impl Pulls {
    /// Of a fit.
    pub fn of(problem: &Problem, fit: &Fit) -> Pulls {
        let (places, prior): (Vec<usize>, Vec<f64>) = (problem.parameters.list.iter().enumerate())
            .filter_map(|(j, parameter)| match parameter.prior {
                Prior::Gaussian(u) if parameter.id.is_setup() && fit.rank.is_identifiable(j) => Some((j, u)),
                _ => None,
            })
            .unzip();
        let count = places.len();
        if count == 0 {
            return Pulls::default();
        }
        let kappa = excess(problem, fit);
        // Everything in units of the stated uncertainties: P is the unit matrix.
        let v = Mat::from_fn(count, count, |i, k| fit.covariance[(places[i], places[k])] / (prior[i] * prior[k]));
        let squared = &v * &v;
        let covariance = Mat::from_fn(count, count, |i, k| {
            let of_prior = f64::from(u8::from(i == k)) - 2.0 * v[(i, k)] + squared[(i, k)];
            of_prior + kappa * (v[(i, k)] - squared[(i, k)])
        });
        let moved: Vec<f64> = (0..count).map(|i| fit.beta[places[i]] / prior[i]).collect();
        let each: Vec<Pull> = (0..count)
            .filter_map(|i| {
                let deviation = covariance[(i, i)].max(0.0).sqrt();
                (deviation >= MIN_SHARE).then(|| Pull {
                    parameter: places[i],
                    estimate: fit.beta[places[i]],
                    stated_u: prior[i],
                    pull: moved[i] / deviation,
                })
            })
            .collect();
        // χ² in those directions along which the readings, not the priors, decide where the estimates lie.
        let (together, freedom) = if count <= MAX_TESTED_JOINTLY {
            let determined = ObservableSubspace::above(covariance.as_ref(), DETERMINED);
            (determined.quadratic(&moved), determined.freedom)
        } else {
            (0.0, 0)
        };
        Pulls { limit: limit(each.len()), each, together, freedom }
    }

    /// The parameters that contradict their statements, the largest pull first.
    pub fn contradicted(&self) -> Vec<&Pull> {
        let mut list: Vec<&Pull> = (self.each.iter()).filter(|pull| pull.pull.abs() > self.limit).collect();
        list.sort_by(|a, b| b.pull.abs().total_cmp(&a.pull.abs()));
        list
    }

    /// Whether all set-up parameters together contradict their statements.
    pub fn contradicted_together(&self) -> bool {
        chi_square_tail(self.together, self.freedom as f64) < SIGNIFICANCE
    }

    /// By how much χ² of the set-up parameters exceeds its least value with the probability `SIGNIFICANCE` if their
    /// statements are right.
    pub fn allowed(&self) -> f64 {
        chi_square_quantile(SIGNIFICANCE, self.freedom as f64).max(limit(self.each.len()).powi(2))
    }

    /// The largest pull, absolute; 0 of none.
    pub fn largest(&self) -> f64 {
        self.each.iter().fold(0.0, |most, pull| most.max(pull.pull.abs()))
    }
}

/// The absolute pull that one of so many exceeds with the probability [`SIGNIFICANCE`].
fn limit(count: usize) -> f64 {
    normal_quantile(SIGNIFICANCE / (2.0 * count.max(1) as f64))
}

/// By how much the noise of an average exceeds what the fit assumes: the readings' own χ² over their degrees of
/// freedom, where that is above 1, times what the autocorrelation of the residual along a run adds.
fn excess(problem: &Problem, fit: &Fit) -> f64 {
    let (mut squares, mut count, mut products, mut pairs) = (0.0, 0_usize, 0.0, 0.0);
    for (number, test) in problem.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        let (residual, channels) = (&fit.residuals[number], problem.channels(number));
        for run in readings.runs() {
            for i in (run.start * channels..run.end * channels).filter(|i| problem.counts(number, *i)) {
                squares += residual[i] * residual[i];
                count += 1;
                if i / channels > run.start && problem.counts(number, i - channels) {
                    products += residual[i] * residual[i - channels];
                    pairs += 0.5 * (residual[i].powi(2) + residual[i - channels].powi(2));
                }
            }
        }
    }
    let free = (0..problem.parameters.list.len()).filter(|j| problem.parameters.list[*j].prior == Prior::Free);
    let freedom = count.saturating_sub(free.count()).max(1) as f64;
    let ratio = (squares / freedom / problem.noise.sigma_mm.powi(2)).max(1.0);
    let poses = problem.folds.kind.is_poses();
    if poses || !problem.noise.ar_coefficients.is_empty() {
        return ratio;
    }
    ratio * enlargement_of_mean(products, pairs, MAX_CORRELATED)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of the standard normal distribution, from tables: 1 − 10⁻⁴/2 and, over 19 parameters, 1 − 10⁻⁴/38.
    #[test]
    fn the_limit_is_bonferronis() {
        assert!((limit(1) - 3.8906).abs() < 1e-3, "{}", limit(1));
        assert!((limit(19) - 4.557).abs() < 5e-3, "{}", limit(19));
    }
}
