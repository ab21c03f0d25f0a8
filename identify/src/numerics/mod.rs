//! Linear algebra and statistics that know no machine, no session and no effect.
//!
//! The rows of a least-squares problem become one [`triangle`]. Solutions, covariances, rank and null space follow from
//! its singular values (`solve`) and from nothing else. Symmetric products have their own decomposition
//! (`symmetric`). Every share below which a number counts as zero stands in `tolerances`.

pub mod circle;
pub(crate) mod evidence;
pub(crate) mod gain;
pub mod least_squares;
mod median;
pub(crate) mod null_space;
pub(crate) mod parallel;
pub(crate) mod power;
pub mod rank;
pub(crate) mod reduction;
pub(crate) mod regression;
pub(crate) mod solve;
pub(crate) mod symmetric;
pub(crate) mod tails;
pub(crate) mod tolerances;
pub mod triangle;

pub(crate) use median::{median, robust_deviation};
