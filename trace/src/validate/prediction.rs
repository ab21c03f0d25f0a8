//! The predicted variance of every residual, coverage of the prediction intervals, and χ².
//!
//! The set-up is estimated from the same readings. With `G = (J_sᵀWJ_s + prior)⁻¹ J_sᵀW J_m` and `j̃ = j_m − j_s·G`, a
//! residual has the variance
//!
//! ```text
//! s² = σ²·(1 − h) + j̃·C·j̃ᵀ,   h = j_s·Cov(set-up)·j_sᵀ/σ²
//! ```
//!
//! The interval `±1.96 s` covers the residual with a probability of 95 %.

use abbe_identify::noise::{NoiseSource, ShownNoise};
use abbe_identify::numerics::parallel;
use abbe_identify::numerics::solve::{Svd, solve_square};
use abbe_identify::numerics::symmetric::Symmetric;
use abbe_identify::numerics::tails::{normal_quantile, residual_tail};
use abbe_identify::numerics::tolerances::MIN_IDENTIFIABLE;
use abbe_model::Diagnostic;
use faer::Mat;

use super::known::{KnownErrors, Linearised, Rms};
use crate::validate::{JudgedResidual, RmsResult};

/// Probability of the intervals.
const COVERAGE: f64 = 0.95;
/// Least coverage of a model that predicts its uncertainty.
const LEAST_COVERAGE: f64 = 0.90;
/// Largest excess of the residual over the predicted one that is of no practical significance.
const LARGEST_RATIO: f64 = 1.05;
/// Significance level of the test of the residual.
const SIGNIFICANCE: f64 = 1e-3;

/// Residuals against their prediction.
pub(super) struct Prediction {
    /// Predicted standard deviation of every residual, by test, mm.
    pub predicted_mm: Vec<Vec<f64>>,
    /// Root mean square of them, mm.
    pub rms_mm: f64,
    /// Share of residuals inside the intervals.
    pub coverage_95: f64,
    /// `rᵀV⁻¹r` of the whitened residual.
    pub chi_square: f64,
    /// Its degrees of freedom.
    pub freedom: usize,
    /// Probability of a larger χ², with the uncertainty of the noise.
    pub p_value: f64,
}

impl Prediction {
    /// The prediction at known errors and an estimated set-up.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn of(known: &KnownErrors<'_>, at: &Linearised) -> Result<Prediction, Diagnostic> {
        let chi_square = chi_square(at);
        let freedom = at.freedom;
        let (predicted_mm, residuals) = predicted(known, at)?;
        let limit = normal_quantile((1.0 - COVERAGE) / 2.0);
        let (mut inside, mut count, mut sum) = (0_usize, 0_usize, 0.0);
        for (test, (predicted, residuals)) in predicted_mm.iter().zip(&residuals).enumerate() {
            for (i, (deviation, residual)) in predicted.iter().zip(residuals).enumerate() {
                if known.full.counts(test, i) {
                    inside += usize::from(residual.abs() <= limit * deviation);
                    sum += deviation * deviation;
                    count += 1;
                }
            }
        }
        let freedom_of_noise = match known.noise_source {
            NoiseSource::Repeats | NoiseSource::Targets => {
                let kept = |test: usize, row: usize| !known.full.rejected[test][row];
                ShownNoise::of(&known.full.tests, &residuals, kept).map(|shown| shown.freedom)
            }
            _ => None,
        };
        Ok(Prediction {
            predicted_mm,
            rms_mm: (sum / count.max(1) as f64).sqrt(),
            coverage_95: inside as f64 / count.max(1) as f64,
            chi_square,
            freedom,
            p_value: residual_tail(chi_square, freedom as f64, freedom_of_noise),
        })
    }

    /// `√(χ²/ν)`: the residual over the predicted one.
    pub fn ratio(&self) -> f64 {
        (self.chi_square / self.freedom as f64).sqrt()
    }

    /// As JSON has it, with the residual itself.
    pub fn judged(&self, rms: &Rms) -> JudgedResidual {
        JudgedResidual {
            rms: RmsResult::from(rms),
            predicted_rms_um: self.rms_mm * 1e3,
            residual_ratio: self.ratio(),
            chi_square: self.chi_square,
            degrees_of_freedom: self.freedom,
            p_value: self.p_value,
            coverage_95: self.coverage_95,
        }
    }

    /// Whether the residual is as large as predicted, and the intervals cover it.
    pub fn is_as_predicted(&self) -> bool {
        let small = self.ratio() <= LARGEST_RATIO || self.p_value >= SIGNIFICANCE;
        small && self.coverage_95 >= LEAST_COVERAGE
    }
}

/// `ρ² + cᵀ(I + R·C·Rᵀ)⁻¹c`.
fn chi_square(at: &Linearised) -> f64 {
    let (r, c, rest) = at.machine.parts();
    let count = c.len();
    let v = &r * &at.covariance * r.transpose() + Mat::<f64>::identity(count, count);
    let right = Mat::from_fn(count, 1, |i, _| c[i]);
    let solved = solve_square(v.as_ref(), right.as_ref());
    rest + (0..count).map(|i| c[i] * solved[(i, 0)]).sum::<f64>()
}

/// Number of null directions of the model on which the readings depend by more than their noise.
///
/// # Errors
/// If the factor has entries that are not finite.
pub(super) fn undetermined(at: &Linearised) -> Result<usize, Diagnostic> {
    let signal = at.machine.r() * &at.null_directions;
    let values = Svd::of(signal.as_ref())?.singular_values;
    Ok(values.iter().filter(|value| **value >= MIN_IDENTIFIABLE).count())
}

/// Predicted standard deviations and residuals of all readings, by test, mm.
fn predicted(known: &KnownErrors<'_>, at: &Linearised) -> Result<(Vec<Vec<f64>>, Vec<Vec<f64>>), Diagnostic> {
    let problem = &known.full;
    let sizes = problem.parameters.sizes();
    let set_up: Vec<usize> = (0..sizes.len()).filter(|j| !known.columns.contains(j)).collect();
    let r = at.triangle.r();
    let of_set_up = Mat::from_fn(r.nrows(), set_up.len(), |i, k| r[(i, set_up[k])] * sizes[set_up[k]]);
    let of_machine = Mat::from_fn(r.nrows(), known.columns.len(), |i, k| r[(i, known.columns[k])]);
    let directions = Svd::of(of_set_up.as_ref())?;
    let absorbed = directions.pseudo_inverse() * of_machine;
    let root_of_set_up = directions.inverse_root();
    // C = L·Lᵀ.
    let Symmetric { values, vectors } = Symmetric::of(at.covariance.as_ref())?;
    let root = Mat::from_fn(vectors.nrows(), values.len(), |i, k| vectors[(i, k)] * values[k].max(0.0).sqrt());
    let sigma = problem.noise.sigma_mm;
    let slot_values = problem.slot_values(&at.beta);
    let blocks = problem.blocks();
    let found = parallel::map(blocks.len(), &|number| {
        let rows = problem.rows(&slot_values, &blocks[number])?;
        let j_s = Mat::from_fn(rows.nrows(), set_up.len(), |i, k| rows[(i, set_up[k])] * sizes[set_up[k]]);
        let j_m = Mat::from_fn(rows.nrows(), known.columns.len(), |i, k| rows[(i, known.columns[k])]);
        let of_model = (j_m - &j_s * &absorbed) * &root;
        let of_fit = &j_s * &root_of_set_up;
        let square = |matrix: &Mat<f64>, i: usize| (0..matrix.ncols()).map(|k| matrix[(i, k)].powi(2)).sum::<f64>();
        let deviations = (0..rows.nrows()).map(|i| {
            let noise = (sigma * sigma - square(&of_fit, i)).max(0.0);
            (noise + square(&of_model, i)).sqrt()
        });
        let residuals = (0..rows.nrows()).map(|i| rows[(i, rows.ncols() - 1)]);
        Ok::<_, Diagnostic>((deviations.collect::<Vec<f64>>(), residuals.collect::<Vec<f64>>()))
    });
    let mut predicted = vec![Vec::new(); problem.models.len()];
    let mut residuals = predicted.clone();
    for (block, found) in blocks.iter().zip(found) {
        let (deviations, of_block) = found?;
        predicted[block.test].extend(deviations);
        residuals[block.test].extend(of_block);
    }
    Ok((predicted, residuals))
}
