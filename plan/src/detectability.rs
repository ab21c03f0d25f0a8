//! The probabilities at which an effect counts as detectable by a plan.

/// Probability of a false alarm.
pub(crate) const SIGNIFICANCE: f64 = 0.01;
/// Probability of detecting an effect that is present.
pub(crate) const POWER: f64 = 0.95;

/// The significance of one of `tests` tests if `SIGNIFICANCE` is that of all together (Šidák, J. Am. Stat. Assoc. 62
/// (1967) 626). Similar candidates count as one test each, so that the true significance is smaller.
pub fn corrected(tests: usize) -> f64 {
    -f64::exp_m1(f64::ln_1p(-SIGNIFICANCE) / tests.max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_test_has_the_significance_itself() {
        assert!((corrected(1) - SIGNIFICANCE).abs() < 1e-15);
        assert!((1.0 - (1.0 - corrected(1000)).powi(1000) - SIGNIFICANCE).abs() < 1e-12);
    }
}
