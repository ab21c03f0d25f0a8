//! The power of the χ² test: how large an effect has to be for its detection.
//!
//! Under an effect of amplitude `a` the gain of `k` coefficients is noncentral χ² with noncentrality `a²·λ`. `λ` is the
//! information on the coefficients with the parameters of the fit eliminated (Kay, Fundamentals of Statistical Signal
//! Processing II, 1998, sect. 13.5).

use super::tails::chi_square_tail;

/// The noncentrality at which a test of `freedom` coefficients at `significance` detects with the probability `wanted`.
pub fn noncentrality(freedom: usize, significance: f64, wanted: f64) -> f64 {
    if freedom == 0 {
        return f64::INFINITY;
    }
    // On the upper tail, which keeps its relative precision where it is small.
    let critical = least(|x| chi_square_tail(x, freedom as f64) <= significance);
    least(|noncentrality| power(freedom, critical, noncentrality) >= wanted)
}

/// The least positive number from which on a condition holds, by bisection.
fn least(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while !holds(high) {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
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
        if weight_log > -40.0 {
            sum += weight_log.exp() * chi_square_tail(critical, (freedom + 2 * j) as f64);
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
        let found = noncentrality(1, 0.01, 0.95);
        assert!((found - expected).abs() < 1e-3, "{found}");
    }

    #[test]
    fn more_coefficients_and_a_lower_significance_need_a_larger_noncentrality() {
        assert!(noncentrality(2, 0.01, 0.95) > noncentrality(1, 0.01, 0.95));
        assert!(noncentrality(1, 1e-5, 0.95) > noncentrality(1, 0.01, 0.95));
    }
}
