//! Numbers as tables of a plan show them.

/// A number with three digits.
pub fn three_digits(value: f64) -> String {
    if !value.is_finite() {
        return "∞".to_string();
    }
    if value == 0.0 {
        return "0".to_string();
    }
    // The digits of the rounded number: 0.9999 and 1.0001 are both 1.00.
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    let places = (2.0 - rounded.abs().max(1e-9).log10().floor()).clamp(0.0, 5.0) as usize;
    format!("{value:.places$}")
}

#[cfg(test)]
mod tests {
    use super::three_digits;

    #[test]
    fn numbers_that_rounding_parts_are_printed_alike() {
        for (value, printed) in [
            (1.0 - 1e-12, "1.00"),
            (1.0 + 1e-12, "1.00"),
            (-9.996, "-10.0"),
            (0.099_96, "0.100"),
            (0.0994, "0.0994"),
            (1234.0, "1234"),
            (1e-12, "0.00000"),
        ] {
            assert_eq!(three_digits(value), printed, "{value}");
        }
    }
}
