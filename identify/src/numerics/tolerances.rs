//! The shares below which a singular value, an eigenvalue or a length counts as zero.
//!
//! Each is far from the values on both sides of it, so that its exact size decides nothing.
//! [`MIN_IDENTIFIABLE`] alone has a meaning of its own.

/// Singular value, in standard deviations per physical size, below which a direction is not identifiable.
pub const MIN_IDENTIFIABLE: f64 = 1.0;

/// Singular values of a triangular factor: below this share of the largest, per column, they are rounding errors.
/// Exact dependencies of a nominal geometry give shares of 10⁻¹⁶ to 10⁻¹⁴.
pub const ROUNDING: f64 = 1e-14;

/// Singular values of columns of a similar length, such as sines, cosines and levers: below this share of the largest
/// the columns are collinear. Exact dependencies give shares below 10⁻¹⁰, others 10⁻³ or more.
pub const COLLINEAR: f64 = 1e-7;

/// Eigenvalues of a product `XᵀX`, which are squares of singular values: below this share of the largest they are
/// rounding errors.
pub const ROUNDING_OF_SQUARES: f64 = 1e-12;

/// Least share of a candidate's squared column length that has to remain after projection for the candidate to count
/// as observable.
pub const MIN_OBSERVABLE: f64 = 1e-7;

/// Length of the part of a parameter in a null space below which it is a rounding error, and the same for a coefficient
/// of a combination, as a share of the largest.
pub const ROUNDING_OF_COMBINATIONS: f64 = 1e-5;

/// Least share of the information on a direction that the other folds must hold for an update of the solution without
/// one fold. Below it the difference of nearly equal numbers loses digits.
pub const MIN_UPDATE_SHARE: f64 = 1e-6;
