//! Linear algebra and statistics that know no machine, no session and no effect.
//!
//! The rows of a least-squares problem become one [`triangle`]. Solutions, covariances, rank and null space follow from
//! its singular values (`solve`) and from nothing else. Symmetric products have their own decomposition
//! (`symmetric`). Every share below which a number counts as zero stands in `tolerances`.

pub mod circle;
pub mod evidence;
pub mod gain;
pub mod golden_section;
pub mod least_squares;
mod median;
pub mod null_space;
pub mod parallel;
pub mod power;
pub(crate) mod products;
pub mod rank;
pub mod ranking;
pub mod reduction;
mod reflections;
pub mod regression;
pub mod solve;
pub mod symmetric;
pub mod tails;
pub mod tolerances;
pub mod triangle;

pub use median::{median, robust_deviation};

/// The least and the greatest of some values; infinite without any.
pub fn ends(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], x| [least.min(*x), most.max(*x)])
}

/// Their difference; 0 without any.
pub fn range(values: &[f64]) -> f64 {
    let [least, most] = ends(values);
    (most - least).max(0.0)
}
