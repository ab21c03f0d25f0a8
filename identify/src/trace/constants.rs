//! The constants of the search.

/// Difference in `−ln P` below which two candidates are confounded. It corresponds to 2 σ for one column.
pub const INDISTINGUISHABLE: f64 = 2.0;
