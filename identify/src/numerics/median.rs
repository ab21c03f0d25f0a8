//! The median, and the robust standard deviation that follows from it.

/// The median; reorders the values. Of an even number the upper of the two middle values. 0 for no values.
pub fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    let (_, value, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    *value
}

/// The standard deviation of Gaussian deviations from zero, from the median of their sizes.
pub fn robust_deviation(deviations: &[f64]) -> f64 {
    // The median of |x| of a Gaussian is 0.6745 standard deviations.
    1.4826 * median(&mut deviations.iter().map(|deviation| deviation.abs()).collect::<Vec<f64>>())
}
