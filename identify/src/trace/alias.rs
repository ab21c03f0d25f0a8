//! What else would look the same.
/// Difference in `−ln P` below which two candidates cannot be told apart: 2 σ for one column.
pub const INDISTINGUISHABLE: f64 = 2.0;
