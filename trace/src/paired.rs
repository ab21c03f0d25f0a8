//! Compares two models on held-out readings by paired differences: the decrease of the held-out error and its standard
//! error.
//!
//! With the held-out residuals `r₀` and `r₁` of the two models and the change of the prediction `δ = r₀ − r₁`, the
//! decrease is
//!
//! ```text
//! Σ (r₀² − r₁²) = Σ δ (2 r₁ + δ)
//! ```
//!
//! For given predictions it scatters by the noise `ε` of the held-out readings, as `2 Σ δ ε`. Neighbouring readings are
//! not independent: noise is autocorrelated along a run. The readings are therefore divided into independent units
//! (runs, blocks or poses), and the variance is `Σ (2 Σ δ ε)²` over the units, with the residual of the model fitted to
//! all readings as `ε` (sandwich estimate: White, Econometrica 48 (1980) 817). The scatter of the decrease between units
//! would be too large. An effect that shows mostly in one run, such as a warm-up, decreases the error mostly there.

use std::collections::BTreeMap;

use abbe_identify::numerics::tails::chi_square_tail;

/// Number of units below which the standard error is unreliable. Folds are then divided into blocks.
const MIN_UNITS: usize = 8;
/// Least number of rows of a block: many times the correlation length of the noise.
const MIN_BLOCK: usize = 16;

/// The unit of each row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Units {
    of_row: Vec<usize>,
    count: usize,
}

impl Units {
    /// Numbers the units of the rows.
    pub fn of<K: Ord>(rows: impl Iterator<Item = K>) -> Units {
        let mut numbers: BTreeMap<K, usize> = BTreeMap::new();
        let of_row = rows.map(|unit| {
            let next = numbers.len();
            *numbers.entry(unit).or_insert(next)
        });
        let of_row = of_row.collect();
        Units { of_row, count: numbers.len() }
    }

    /// Divides each unit into blocks of consecutive rows if there are too few units for a standard error.
    pub fn divided(self) -> Units {
        if self.count >= MIN_UNITS || self.count == 0 {
            return self;
        }
        let wanted = MIN_UNITS.div_ceil(self.count);
        let mut rows = vec![0; self.count];
        self.of_row.iter().for_each(|unit| rows[*unit] += 1);
        let mut counted = vec![0; self.count];
        let parts = self.of_row.iter().map(|unit| {
            let blocks = wanted.min(rows[*unit] / MIN_BLOCK).max(1);
            let block = counted[*unit] * blocks / rows[*unit];
            counted[*unit] += 1;
            (*unit, block)
        });
        Units::of(parts)
    }

    /// The decrease of the squared held-out residuals from one model to another. `noise` is the residual of the other
    /// model fitted to all readings.
    pub fn decrease(&self, before: &[f64], after: &[f64], noise: &[f64]) -> HeldOutDecrease {
        let by = before.iter().zip(after).map(|(before, after)| before * before - after * after).sum();
        let mut sums = vec![0.0; self.count];
        for ((unit, noise), (before, after)) in self.of_row.iter().zip(noise).zip(before.iter().zip(after)) {
            sums[*unit] += 2.0 * (before - after) * noise;
        }
        HeldOutDecrease { by, standard_error: sums.iter().map(|sum| sum * sum).sum::<f64>().sqrt() }
    }
}

/// The decrease of the sum of squares of held-out residuals, divided by the noise variance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HeldOutDecrease {
    /// The decrease; negative if the sum increases.
    pub by: f64,
    /// Standard error of the decrease.
    pub standard_error: f64,
}

impl HeldOutDecrease {
    /// From the sums of squares over blocks that are replicates of each other, under one model and another. The standard
    /// error follows from the scatter of the differences. A single block has no scatter. Its whole difference counts as
    /// its uncertainty.
    pub fn over_blocks(before: &[f64], after: &[f64]) -> HeldOutDecrease {
        let differences: Vec<f64> = before.iter().zip(after).map(|(before, after)| before - after).collect();
        let (count, by) = (differences.len() as f64, differences.iter().sum::<f64>());
        let variance = match differences[..] {
            [alone] => alone * alone,
            _ => differences.iter().map(|d| (d - by / count).powi(2)).sum::<f64>() * count / (count - 1.0),
        };
        HeldOutDecrease { by, standard_error: variance.sqrt() }
    }

    /// Whether the held-out error decreases by more than the standard error.
    pub fn is_significant(self) -> bool {
        self.by > self.standard_error
    }

    /// One-sided probability of at least this decrease without a difference between the models, for a Gaussian decrease.
    pub fn p_value(self) -> f64 {
        let z = self.by / self.standard_error.max(f64::MIN_POSITIVE);
        let both = chi_square_tail(z * z, 1.0);
        if z > 0.0 { 0.5 * both } else { 1.0 - 0.5 * both }
    }

    /// Whether the held-out error increases by more than the standard error.
    pub fn is_increase(self) -> bool {
        -self.by > self.standard_error
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    use super::*;

    /// Three blocks that decrease by 10, 11 and 12, and one alone.
    #[test]
    fn blocks_give_the_scatter_of_their_differences() {
        let decrease = HeldOutDecrease::over_blocks(&[110.0, 111.0, 112.0], &[100.0; 3]);
        assert_eq!(decrease.by, 33.0);
        // Σ (d − mean)² n/(n − 1) of 10, 11, 12.
        assert!((decrease.standard_error - 3.0_f64.sqrt()).abs() < 1e-12);
        assert!(decrease.is_significant() && !decrease.is_increase());
        assert!(HeldOutDecrease::over_blocks(&[100.0; 3], &[110.0, 111.0, 112.0]).is_increase());
        assert_eq!(HeldOutDecrease::over_blocks(&[3.0], &[1.0]), HeldOutDecrease { by: 2.0, standard_error: 2.0 });
    }

    /// The tail of the normal distribution beyond two standard deviations is 0.02275.
    #[test]
    fn a_decrease_has_the_tail_of_a_normal_distribution() {
        let tail = |by: f64| HeldOutDecrease { by, standard_error: 1.5 }.p_value();
        assert!((tail(3.0) - 0.022_750_131_9).abs() < 1e-9 && (tail(-3.0) - 0.977_249_868_1).abs() < 1e-9);
        assert!((tail(0.0) - 0.5).abs() < 1e-12);
    }

    /// Sixteen runs of autocorrelated noise. An effect acts mostly in one of them, and a model predicts nine tenths of
    /// it. Over many draws of the noise the scatter of the decrease equals its standard error.
    #[test]
    fn the_decrease_scatters_by_its_standard_error() {
        const RUNS: usize = 16;
        const ROWS: usize = 50;
        const DRAWS: usize = 4000;
        let units = Units::of((0..RUNS * ROWS).map(|row| row / ROWS)).divided();
        let effect = |row: usize| if row < ROWS { 1.0 } else { 0.05 } * (row % ROWS) as f64 / ROWS as f64;
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        let mut noise = vec![0.0; RUNS * ROWS];
        let (mut sum, mut squares, mut variances) = (0.0, 0.0, 0.0);
        for _ in 0..DRAWS {
            for row in 0..noise.len() {
                let before = if row % ROWS == 0 { 0.0 } else { noise[row - 1] };
                let standard: f64 = random.sample(StandardNormal);
                noise[row] = 0.8 * before + 0.6 * standard;
            }
            let with = |share: f64| (0..noise.len()).map(|row| share * effect(row) + noise[row]).collect::<Vec<f64>>();
            let decrease = units.decrease(&with(1.0), &with(0.1), &noise);
            sum += decrease.by;
            squares += decrease.by.powi(2);
            variances += decrease.standard_error.powi(2);
        }
        let expected: f64 = (0..noise.len()).map(|row| 0.99 * effect(row).powi(2)).sum();
        let (mean, count) = (sum / DRAWS as f64, DRAWS as f64);
        let variance = squares / count - mean * mean;
        // Four standard errors of the mean; the relative standard error of a variance from this number of draws is 2 %.
        assert!((mean - expected).abs() < 4.0 * (variance / count).sqrt(), "{mean} {expected}");
        assert!((variances / count / variance - 1.0).abs() < 0.1, "{} {variance}", variances / count);
    }

    #[test]
    fn few_long_folds_are_divided_and_many_are_not() {
        let few = Units::of((0..200).map(|row| row / 100));
        assert_eq!(few.count, 2);
        let divided = few.divided();
        assert_eq!(divided.count, MIN_UNITS);
        // Blocks are stretches of consecutive rows of one fold.
        assert!(divided.of_row.is_sorted());
        assert_ne!(divided.of_row[99], divided.of_row[100]);
        let many = Units::of((0..200).map(|row| row / 20));
        assert_eq!(many.clone().divided(), many);
        // Folds too short to be divided stay whole.
        let short = Units::of((0..20).map(|row| row / 10));
        assert_eq!(short.clone().divided(), short);
    }
}
