//! Sorts figures by their first significant digits, then by name or index, so that rounding decides no order.
//!
//! Figures that are equal in theory differ by rounding errors, which differ between processors. A comparison "equal
//! within a tolerance" is not transitive and cannot sort. Rounded figures can be sorted.

use std::cmp::Ordering;

/// Significant digits of the comparison: well above rounding, and well below a relevant difference between tests.
const DIGITS: i32 = 8;

/// Rounds to eight significant digits.
pub fn rounded(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let places = DIGITS - 1 - value.abs().log10().floor() as i32;
    // Two steps keep a large power of ten in range.
    let (half, rest) = (places / 2, places - places / 2);
    let scaled = value * 10.0_f64.powi(half) * 10.0_f64.powi(rest);
    scaled.round() / 10.0_f64.powi(half) / 10.0_f64.powi(rest)
}

/// Smallest first.
pub fn smallest_first(a: f64, b: f64) -> Ordering {
    // −0 and 0 are equal.
    (rounded(a) + 0.0).total_cmp(&(rounded(b) + 0.0))
}

/// Largest magnitude first, equal ones by name.
pub fn largest_first(a: (f64, &str), b: (f64, &str)) -> Ordering {
    smallest_first(b.0.abs(), a.0.abs()).then_with(|| a.1.cmp(b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_that_differ_by_rounding_are_sorted_by_name() {
        let names = ["EX0C", "EA0C", "EY0C", "EB0C"];
        // The same magnitude as four processors may compute it, with either sign.
        let figures = [0.3, -(0.1 + 0.2), 0.3 - 1e-16, 0.300_000_000_01];
        let mut turned: Vec<(f64, &str)> = figures.into_iter().zip(names).collect();
        for turn in 0..4 {
            turned.rotate_left(turn);
            let mut sorted = turned.clone();
            sorted.sort_by(|a, b| largest_first(*a, *b));
            let order: Vec<&str> = sorted.iter().map(|(_, name)| *name).collect();
            assert_eq!(order, ["EA0C", "EB0C", "EX0C", "EY0C"]);
        }
        assert_eq!(largest_first((0.300_000_1, "Z"), (0.3, "A")), Ordering::Less);
        assert_eq!(smallest_first(0.3, 0.1 + 0.2), Ordering::Equal);
        assert_eq!(smallest_first(0.0, -0.0), Ordering::Equal);
        assert_eq!(smallest_first(1.0, f64::INFINITY), Ordering::Less);
    }

    #[test]
    fn eight_significant_digits_decide() {
        for value in [1.234_567_89e-300, 9.999_999_94, 12_345_678.4, 7.0e300] {
            let off = (rounded(value) / value - 1.0).abs();
            assert!(off < 5e-8, "{value}: {off}");
            assert_eq!(rounded(-value), -rounded(value));
        }
        assert_eq!(rounded(0.123_456_784_9), 0.123_456_78);
    }
}
