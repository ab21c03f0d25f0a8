//! Estimates scales, noise and inflation: scales and noise in turn for an inflation, and the inflation at which the
//! held-out folds are covered.

use abbe_model::Diagnostic;

use super::{FIRST_INFLATION, FoldEquations, START_PRECISION, Scales};
use crate::problem::Problem;

/// How exact an estimate is. The calibration of held-out folds changes by about a twentieth of what the inflation changes.
struct Tolerances {
    /// Of the calibration, relative.
    calibrated: f64,
    /// Of the noise variance, relative.
    settled: f64,
}

/// Two fits of the same readings from different starts have equal uncertainties.
const OF_A_FIT: Tolerances = Tolerances { calibrated: 3e-4, settled: 1e-5 };
/// A search compares models.
const OF_A_SEARCH: Tolerances = Tolerances { calibrated: 0.01, settled: 1e-3 };
/// Least noise variance over that of the whitening. Readings with as many parameters as values leave no residual.
const LEAST_VARIANCE: f64 = 1e-8;
/// Maximum number of estimates of scales and noise in turn.
const MAX_ROUNDS: usize = 8;
/// Factor between inflations that are tried until the right one is between two of them.
const STEP: f64 = 4.0;
/// Largest inflation: one piece of information in a thousand readings.
const MAX_INFLATION: f64 = 1e3;

/// From where scales and noise are estimated.
struct Start {
    /// Precision of each family, over scaled parameters.
    precisions: Vec<f64>,
    /// Variance of a reading in units of the whitening.
    variance: f64,
}

impl From<&Scales> for Start {
    fn from(scales: &Scales) -> Start {
        Start { precisions: scales.precisions.clone(), variance: scales.variance }
    }
}

impl FoldEquations {
    /// Estimates scales, noise and inflation.
    ///
    /// # Errors
    /// If the equations are not positive definite.
    pub fn estimate(&self) -> Result<Scales, Diagnostic> {
        let precisions = vec![START_PRECISION; self.equations.families.len()];
        self.estimate_from(FIRST_INFLATION, Start { precisions, variance: 1.0 }, &OF_A_FIT)
    }

    /// The same for a search, in fewer steps: from the scales that the problem of the equations has and its inflation, and
    /// less exactly. Before the first estimate there is no inflation.
    ///
    /// # Errors
    /// See [`FoldEquations::estimate`].
    pub fn estimate_near(&self, problem: &Problem, inflation: Option<f64>) -> Result<Scales, Diagnostic> {
        // An estimated inflation is part of the whitening.
        let variance = inflation.map_or(1.0, |inflation| 1.0 / inflation);
        let start = Start { precisions: self.precisions(problem), variance };
        self.estimate_from(inflation.unwrap_or(FIRST_INFLATION), start, &OF_A_SEARCH)
    }

    fn estimate_from(&self, inflation: f64, start: Start, to: &Tolerances) -> Result<Scales, Diagnostic> {
        if self.equations.families.is_empty() {
            return self.at(1.0, start, to).map(|(scales, _)| scales);
        }
        let first = self.at(inflation, start, to)?;
        if first.1.ln().abs() < to.calibrated {
            return Ok(first.0);
        }
        // The calibration decreases with the inflation. ln κ is bracketed and found by regula falsi (Illinois).
        let rises = first.1 > 1.0;
        let mut present = first;
        let (mut low, mut high) = loop {
            let inflation = present.0.inflation;
            if inflation == if rises { MAX_INFLATION } else { 1.0 } {
                return Ok(present.0);
            }
            let next = if rises { (inflation * STEP).min(MAX_INFLATION) } else { (inflation / STEP).max(1.0) };
            let next = self.at(next, (&present.0).into(), to)?;
            match (rises, next.1 <= 1.0) {
                (true, true) => break (present, next),
                (false, false) => break (next, present),
                _ => present = next,
            }
        };
        let (mut weight_low, mut weight_high) = (1.0, 1.0);
        for _ in 0..MAX_ROUNDS {
            let (a, b) = (low.0.inflation.ln(), high.0.inflation.ln());
            let (of_low, of_high) = (weight_low * low.1.ln(), weight_high * high.1.ln());
            let middle = (a * of_high - b * of_low) / (of_high - of_low);
            let next = self.at(middle.exp(), (&high.0).into(), to)?;
            if next.1.ln().abs() < to.calibrated {
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
    fn at(&self, inflation: f64, start: Start, to: &Tolerances) -> Result<(Scales, f64), Diagnostic> {
        let Start { mut precisions, mut variance } = start;
        let mut rounds = 0;
        let posterior = loop {
            let posterior;
            (precisions, posterior) = self.equations.maximise(inflation * variance, &precisions)?;
            let freedom = (self.readings - posterior.effective_total).max(1.0);
            let next = (posterior.residual_square / freedom).max(LEAST_VARIANCE);
            let change = (next / variance - 1.0).abs();
            rounds += 1;
            if change < to.settled || rounds == MAX_ROUNDS {
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
