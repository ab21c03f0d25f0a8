//! Estimates scales, noise and inflation: scales and noise in turn for an inflation, and the inflation at which the
//! held-out folds are covered.

use super::{FIRST_INFLATION, FoldEquations, START_PRECISION, Scales};
use crate::error::IdentifyError;

/// Relative tolerance of the calibration of held-out folds.
const CALIBRATED: f64 = 0.01;
/// Relative tolerance of the noise variance.
const SETTLED: f64 = 1e-3;
/// Least noise variance over that of the whitening. Readings with as many parameters as values leave no residual.
const LEAST_VARIANCE: f64 = 1e-8;
/// Maximum number of estimates of scales and noise in turn.
const MAX_ROUNDS: usize = 8;
/// Largest inflation: one piece of information in a thousand readings.
const MAX_INFLATION: f64 = 1e3;

impl FoldEquations {
    /// Estimates scales, noise and inflation.
    ///
    /// # Errors
    /// If the equations are not positive definite.
    pub fn estimate(&self) -> Result<Scales, IdentifyError> {
        let start = vec![START_PRECISION; self.equations.families.len()];
        let first = self.at(FIRST_INFLATION, &start)?;
        if self.equations.families.is_empty() {
            return self.at(1.0, &start).map(|(scales, _)| scales);
        }
        // The calibration decreases with the inflation. ln κ is bracketed and found by regula falsi (Illinois).
        let (mut low, mut high) = if first.1 > 1.0 {
            let last = self.at(MAX_INFLATION, &first.0.precisions)?;
            if last.1 >= 1.0 {
                return Ok(last.0);
            }
            (first, last)
        } else {
            let least = self.at(1.0, &first.0.precisions)?;
            if least.1 <= 1.0 {
                return Ok(least.0);
            }
            (least, first)
        };
        let (mut weight_low, mut weight_high) = (1.0, 1.0);
        for _ in 0..MAX_ROUNDS {
            let (a, b) = (low.0.inflation.ln(), high.0.inflation.ln());
            let (of_low, of_high) = (weight_low * low.1.ln(), weight_high * high.1.ln());
            let middle = (a * of_high - b * of_low) / (of_high - of_low);
            let next = self.at(middle.exp(), &high.0.precisions)?;
            if next.1.ln().abs() < CALIBRATED {
                return Ok(next.0);
            }
            if next.1 > 1.0 {
                (low, weight_low, weight_high) = (next, 1.0, 0.5 * weight_high);
            } else {
                (high, weight_high, weight_low) = (next, 1.0, 0.5 * weight_low);
            }
        }
        Ok(high.0)
    }

    /// Scales and noise for an inflation, and the calibration of the held-out folds.
    fn at(&self, inflation: f64, start: &[f64]) -> Result<(Scales, f64), IdentifyError> {
        let (mut precisions, mut variance) = (start.to_vec(), 1.0);
        let mut rounds = 0;
        let posterior = loop {
            let posterior;
            (precisions, posterior) = self.equations.maximise(inflation * variance, &precisions)?;
            let freedom = (self.readings - posterior.effective_total).max(1.0);
            let next = (posterior.residual_square / freedom).max(LEAST_VARIANCE);
            let change = (next / variance - 1.0).abs();
            rounds += 1;
            if change < SETTLED || rounds == MAX_ROUNDS {
                break posterior;
            }
            variance = next;
        };
        let of_folds = self.held_out(inflation * variance, &precisions)?;
        let calibrated: f64 = (self.folds.iter().zip(&of_folds))
            .map(|(fold, (square, predicted))| {
                let expected = fold.readings * variance + predicted;
                if fold.readings > 0.0 { fold.readings * square / expected } else { 0.0 }
            })
            .sum();
        let held_out = of_folds.into_iter().map(|(square, _)| square).collect();
        let calibration = calibrated / self.readings.max(1.0);
        Ok((Scales { precisions, variance, inflation, posterior, held_out }, calibration))
    }
}
