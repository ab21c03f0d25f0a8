//! Compares two models on held-out readings by paired differences: the decrease of the held-out error and its standard
//! error.
//!
//! Neighbouring readings are not independent. Noise is autocorrelated along a run, and one fit predicts a whole fold.
//! The differences between the squared held-out residuals of two models are therefore summed over independent units
//! (runs, blocks or poses). Units of one test are replicates of each other. Tests are strata, because an effect need
//! not act in all of them. The variance of the sum follows from the scatter of the units within their test.

use std::collections::BTreeMap;

use crate::numerics::tails::chi_square_tail;

/// Degrees of freedom below which the scatter of whole folds is unreliable. Folds are then divided into blocks.
const MIN_FREEDOM: usize = 6;
/// Least number of rows of a block: many times the correlation length of the noise.
const MIN_BLOCK: usize = 16;

/// The unit of each row and the stratum of each unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Units {
    of_row: Vec<usize>,
    stratum: Vec<usize>,
}

impl Units {
    /// Numbers the units by the stratum and the unit of each row.
    pub fn of<K: Ord>(rows: impl Iterator<Item = (usize, K)>) -> Units {
        let mut numbers: BTreeMap<(usize, K), usize> = BTreeMap::new();
        let mut units = Units::default();
        for (stratum, unit) in rows {
            let next = numbers.len();
            let number = *numbers.entry((stratum, unit)).or_insert(next);
            if number == next {
                units.stratum.push(stratum);
            }
            units.of_row.push(number);
        }
        units
    }

    /// Divides each unit into blocks of consecutive rows if there are too few units for a standard error.
    pub fn divided(self) -> Units {
        let strata = self.stratum.iter().max().map_or(0, |last| last + 1);
        let freedom = self.stratum.len().saturating_sub(strata);
        if freedom >= MIN_FREEDOM || self.stratum.is_empty() {
            return self;
        }
        let wanted = (MIN_FREEDOM + strata).div_ceil(self.stratum.len());
        let mut rows = vec![0; self.stratum.len()];
        self.of_row.iter().for_each(|unit| rows[*unit] += 1);
        let mut counted = vec![0; self.stratum.len()];
        let parts = self.of_row.iter().map(|unit| {
            let blocks = wanted.min(rows[*unit] / MIN_BLOCK).max(1);
            let block = counted[*unit] * blocks / rows[*unit];
            counted[*unit] += 1;
            (self.stratum[*unit], (*unit, block))
        });
        Units::of(parts)
    }

    /// Sums of squares by unit.
    pub fn sums(&self, squares: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut sums = vec![0.0; self.stratum.len()];
        for (unit, square) in self.of_row.iter().zip(squares) {
            sums[*unit] += square;
        }
        sums
    }

    /// The decrease from the sums of squares by unit under one model to those under another.
    pub fn decrease(&self, before: &[f64], after: &[f64]) -> HeldOutDecrease {
        let differences = before.iter().zip(after).map(|(before, after)| before - after);
        let mut strata: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for (stratum, difference) in self.stratum.iter().zip(differences) {
            strata.entry(*stratum).or_default().push(difference);
        }
        let mut decrease = HeldOutDecrease::default();
        let mut variance = 0.0;
        for differences in strata.values() {
            let count = differences.len() as f64;
            let sum: f64 = differences.iter().sum();
            decrease.by += sum;
            variance += match differences[..] {
                // A single unit has no scatter. Its whole difference counts as its uncertainty.
                [alone] => alone * alone,
                _ => {
                    let squares = differences.iter().map(|d| (d - sum / count).powi(2));
                    squares.sum::<f64>() * count / (count - 1.0)
                }
            };
        }
        decrease.standard_error = variance.sqrt();
        decrease
    }
}

/// The decrease of the sum of squares of held-out residuals, divided by the noise variance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HeldOutDecrease {
    /// The decrease; negative if the sum increases.
    pub by: f64,
    /// Standard error of the decrease, from the paired differences of the units.
    pub standard_error: f64,
}

impl HeldOutDecrease {
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

    /// Two tests of three runs. Only the first test shows an effect. The scatter within tests counts, not the
    /// difference between them.
    #[test]
    fn the_standard_error_comes_from_the_scatter_within_tests() {
        let rows = [(0, 0), (0, 1), (0, 2), (1, 3), (1, 4), (1, 5)];
        let units = Units::of(rows.into_iter());
        let before = [110.0, 111.0, 112.0, 50.0, 50.0, 50.0];
        let after = [100.0, 100.0, 100.0, 50.0, 50.0, 50.0];
        let decrease = units.decrease(&before, &after);
        assert_eq!(decrease.by, 33.0);
        // Σ (d − mean)² n/(n − 1) of 10, 11, 12.
        assert!((decrease.standard_error - 3.0_f64.sqrt()).abs() < 1e-12);
        assert!(decrease.is_significant() && !decrease.is_increase());
        assert!(units.decrease(&after, &before).is_increase());
        let same = units.decrease(&before, &before);
        assert!(!same.is_significant() && !same.is_increase());
    }

    /// Over many simulated sets of units, the scatter of the decrease equals its standard error.
    #[test]
    fn the_decrease_scatters_by_its_standard_error() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        let units = Units::of((0..16).map(|unit| (unit / 4, unit)));
        let (mut squares, mut variances) = (0.0, 0.0);
        const SETS: usize = 4000;
        for _ in 0..SETS {
            // Test k decreases by k with a standard deviation of 1 + k.
            let differences: Vec<f64> = (0..16)
                .map(|unit| {
                    let test = f64::from(unit / 4);
                    let standard: f64 = random.sample(StandardNormal);
                    test + (1.0 + test) * standard
                })
                .collect();
            let decrease = units.decrease(&differences, &[0.0; 16]);
            squares += (decrease.by - 24.0).powi(2);
            variances += decrease.standard_error.powi(2);
        }
        // 4 · (1 + 4 + 9 + 16). The relative standard error of the variance from this number of sets is 2 %.
        for variance in [squares, variances] {
            assert!((variance / SETS as f64 / 120.0 - 1.0).abs() < 0.08, "{variance}");
        }
    }

    #[test]
    fn few_long_folds_are_divided_and_many_are_not() {
        let few = Units::of((0..200).map(|row| (0, row / 100)));
        assert_eq!(few.stratum.len(), 2);
        let divided = few.divided();
        assert!(divided.stratum.len() > MIN_FREEDOM, "{}", divided.stratum.len());
        assert!(divided.stratum.iter().all(|stratum| *stratum == 0));
        // Blocks are stretches of consecutive rows of one fold.
        assert!(divided.of_row.is_sorted());
        assert_ne!(divided.of_row[99], divided.of_row[100]);
        let many = Units::of((0..200).map(|row| (0, row / 20)));
        assert_eq!(many.clone().divided(), many);
        // Folds too short to be divided stay whole.
        let short = Units::of((0..20).map(|row| (0, row / 10)));
        assert_eq!(short.clone().divided(), short);
    }
}
