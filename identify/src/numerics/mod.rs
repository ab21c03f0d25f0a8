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
pub mod regression;
pub mod solve;
pub mod symmetric;
pub mod tails;
pub mod tolerances;
pub mod triangle;

pub use median::{median, robust_deviation};
