//! The median.

/// The median; reorders the values. Of an even number the upper of the two middle values. 0 for no values.
///
/// The page sorts: the selection of its standard library, which is built for size, takes quadratic time.
pub fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    if cfg!(target_family = "wasm") {
        values.sort_unstable_by(f64::total_cmp);
        return values[middle];
    }
    #[expect(clippy::disallowed_methods, reason = "never in the page")]
    let (_, value, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    *value
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn of_an_even_number_it_is_the_upper_one() {
        assert_eq!(median(&mut [4.0, -1.0, 3.0]), 3.0);
        assert_eq!(median(&mut [4.0, -1.0, 3.0, 2.0]), 3.0);
        assert_eq!(median(&mut []), 0.0);
    }
}
