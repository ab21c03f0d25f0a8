//! The median.

/// The median; sorts the values. Of an even number the upper of the two middle values. 0 for no values.
///
/// Selection without sorting takes quadratic time in the standard library of the page, which is built for size.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
