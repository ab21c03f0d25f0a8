//! The robust standard deviation that follows from a median.

pub use abbe_model::median::median;

/// The standard deviation of Gaussian deviations from zero, from the median of their sizes.
pub fn robust_deviation(deviations: &[f64]) -> f64 {
    // The median of |x| of a Gaussian is 0.6745 standard deviations.
    1.4826 * median(&mut deviations.iter().map(|deviation| deviation.abs()).collect::<Vec<f64>>())
}
