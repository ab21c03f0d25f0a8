//! Exact values of constants: the rational number, or the multiple of a root, of which a floating-point number is the
//! rounded value.
//!
//! The sine of 45° is `0.7071067811865475`, and half the root of two is `0.7071067811865476`. As ratios of integers they
//! differ by 1e-16, and a nominal geometry that cancels leaves a residue. Both are `½·√2`.

use num_rational::BigRational;
use num_traits::Zero;

/// Largest relative rounding error of a constant of a nominal geometry: a few units in the last place.
pub(crate) const ROUNDING: f64 = 2e-15;

/// The roots that constants are recognised by. The root of six is the product of two of them.
pub(crate) const ROOTS: [u32; 3] = [2, 3, 5];

/// Significant digits of a decimal number that somebody wrote.
const DIGITS: usize = 10;
/// Largest denominator of a fraction.
const DENOMINATOR: u32 = 100;
/// Largest denominator of the factor of a root.
const DENOMINATOR_OF_ROOT: u32 = 24;
/// Largest numerator of the factor of a root.
const NUMERATOR_OF_ROOT: f64 = 1e4;

/// `factor·√root`, where `root` is a product of [`ROOTS`], or 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Exact {
    pub(crate) factor: BigRational,
    pub(crate) root: u32,
}

impl Exact {
    /// The exact value of a constant, if it is a decimal number, a fraction or a multiple of a root to within rounding.
    pub(crate) fn of(value: f64) -> Option<Exact> {
        if let Some(factor) = rational(value, ROUNDING) {
            return Some(Exact { factor, root: 1 });
        }
        [2, 3, 5, 6].into_iter().find_map(|root| {
            let (numerator, denominator) =
                fraction(value / f64::from(root).sqrt(), DENOMINATOR_OF_ROOT, 2.0 * ROUNDING)?;
            (numerator.abs() <= NUMERATOR_OF_ROOT).then(|| Exact { factor: ratio(numerator, denominator), root })
        })
    }
}

/// The decimal number or the fraction that a value is to within a relative rounding error.
pub(crate) fn rational(value: f64, rounding: f64) -> Option<BigRational> {
    if value == 0.0 || value.fract() == 0.0 {
        return BigRational::from_float(value);
    }
    decimal(value, rounding).or_else(|| {
        let (numerator, denominator) = fraction(value, DENOMINATOR, rounding)?;
        Some(ratio(numerator, denominator))
    })
}

/// The decimal number with few digits.
fn decimal(value: f64, rounding: f64) -> Option<BigRational> {
    let text = format!("{value:.*e}", DIGITS - 1);
    let near: f64 = text.parse().ok()?;
    if (near - value).abs() > rounding * value.abs() {
        return None;
    }
    let (mantissa, exponent) = text.split_once('e')?;
    let exponent: i32 = exponent.parse().ok()?;
    let digits: i64 = mantissa.replace('.', "").parse().ok()?;
    let power = exponent - (DIGITS as i32 - 1);
    if power.abs() > 40 {
        return None;
    }
    let ten = BigRational::from_integer(10.into());
    Some(BigRational::from_integer(digits.into()) * ten.pow(power))
}

/// Numerator and denominator of the fraction with the least denominator.
pub(crate) fn fraction(value: f64, largest: u32, rounding: f64) -> Option<(f64, u32)> {
    (1..=largest).find_map(|denominator| {
        let whole = value * f64::from(denominator);
        let numerator = whole.round();
        (numerator != 0.0 && (whole - numerator).abs() <= rounding * whole.abs()).then_some((numerator, denominator))
    })
}

fn ratio(numerator: f64, denominator: u32) -> BigRational {
    let numerator = BigRational::from_float(numerator).unwrap_or_else(BigRational::zero);
    numerator / BigRational::from_integer(denominator.into())
}

#[cfg(test)]
mod tests {
    use num_traits::ToPrimitive;

    use super::*;

    #[test]
    fn constants_are_what_they_are_the_rounded_values_of() {
        let exact = |value: f64| Exact::of(value).map(|exact| (exact.factor.to_string(), exact.root));
        let is = |factor: &str, root: u32| Some((factor.to_string(), root));
        let degrees = |angle: f64| angle.to_radians();
        assert_eq!(exact(degrees(45.0).sin()), is("1/2", 2));
        assert_eq!(exact(degrees(45.0).cos()), is("1/2", 2));
        assert_eq!(exact(-degrees(60.0).sin()), is("-1/2", 3));
        assert_eq!(exact(degrees(30.0).sin()), is("1/2", 1));
        assert_eq!(exact(degrees(60.0).cos()), is("1/2", 1));
        assert_eq!(exact(12500.0_f64.sqrt()), is("50", 5));
        assert_eq!(exact(1.0 / 6.0_f64.sqrt()), is("1/6", 6));
        assert_eq!(exact(0.1 + 0.2), is("3/10", 1));
        assert_eq!(exact(149.9946), is("749973/5000", 1));
        assert_eq!(exact(2.0 / 3.0), is("2/3", 1));
        assert_eq!(exact(0.0), is("0", 1));
        // Typed with nine digits it is that number, and not the root.
        assert_eq!(exact(0.866025403), is("866025403/1000000000", 1));
    }

    /// None of many drawn numbers is taken for another one.
    #[test]
    fn other_numbers_stay_as_they_are() {
        let mut state = 1_u64;
        let mut taken = 0;
        for _ in 0..20_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let value = (state >> 11) as f64 / (1_u64 << 53) as f64 * 300.0;
            if let Some(exact) = Exact::of(value) {
                taken += 1;
                let found = exact.factor.to_f64().unwrap() * f64::from(exact.root).sqrt();
                assert!((found - value).abs() <= 1e-14 * value);
            }
        }
        assert!(taken < 10, "{taken}");
    }
}
