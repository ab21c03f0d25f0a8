//! The smallest detectable amplitude of an effect: the power of the χ² test of its coefficients.
//!
//! Under an effect of amplitude `a` the gain of `k` coefficients is noncentral χ² with noncentrality `a²·λ`. `λ` is the
//! information on the coefficients with the parameters of the fit eliminated (Kay, Fundamentals of Statistical Signal
//! Processing II, 1998, sect. 13.5).

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Probability of a false alarm.
pub const SIGNIFICANCE: f64 = 0.01;
/// Probability of detecting an effect that is present.
pub const POWER: f64 = 0.95;

/// The significance of one of `tests` tests if `SIGNIFICANCE` is that of all together (Šidák, J. Am. Stat. Assoc. 62
/// (1967) 626). Similar candidates count as one test each, so that the true significance is smaller.
pub fn corrected(tests: usize) -> f64 {
    -f64::exp_m1(f64::ln_1p(-SIGNIFICANCE) / tests.max(1) as f64)
}

/// The noncentrality at which a test of `freedom` coefficients at `significance` has the power [`POWER`].
pub fn noncentrality(freedom: usize, significance: f64) -> f64 {
    let Ok(law) = ChiSquared::new(freedom as f64) else {
        return f64::INFINITY;
    };
    let critical = critical_value(&law, significance);
    let (mut low, mut high) = (0.0, 1.0);
    while power(freedom, critical, high) < POWER {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if power(freedom, critical, middle) < POWER {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// The value that χ² exceeds with this probability, by bisection on the upper tail, which keeps its relative precision
/// where it is small.
fn critical_value(law: &ChiSquared, significance: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while law.sf(high) > significance {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if law.sf(middle) > significance {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// The probability that noncentral χ² exceeds the critical value, as a Poisson mixture of central distributions
/// (Johnson, Kotz & Balakrishnan, Continuous Univariate Distributions 2, 1995, ch. 29).
fn power(freedom: usize, critical: f64, noncentrality: f64) -> f64 {
    let half = 0.5 * noncentrality;
    let most = (half + 12.0 * half.sqrt() + 20.0) as usize;
    let mut weight_log = -half;
    let mut sum = 0.0;
    for j in 0..=most {
        if j > 0 {
            weight_log += (half / j as f64).ln();
        }
        if weight_log > -40.0
            && let Ok(law) = ChiSquared::new((freedom + 2 * j) as f64)
        {
            sum += weight_log.exp() * law.sf(critical);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_coefficient_is_the_two_sided_normal_test() {
        // (z_0.995 + z_0.95)² = (2.575829 + 1.644854)². The far tail is negligible.
        let expected = (2.575_829_304_f64 + 1.644_853_627).powi(2);
        assert!((noncentrality(1, 0.01) - expected).abs() < 1e-3, "{}", noncentrality(1, 0.01));
    }

    #[test]
    fn more_coefficients_and_more_tests_need_a_larger_noncentrality() {
        assert!(noncentrality(2, 0.01) > noncentrality(1, 0.01));
        assert!(noncentrality(1, corrected(1000)) > noncentrality(1, 0.01));
        assert!((corrected(1) - SIGNIFICANCE).abs() < 1e-15);
    }
}
