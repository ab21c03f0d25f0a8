//! What is known of the scatter of a series before its own sessions.

/// Smallest variance, in units of the stated one: sessions that agree to a millionth of their uncertainties.
pub(super) const LEAST_VARIANCE: f64 = 1e-12;

/// What is known of the variance of a series before its own scatter: that of an estimate with so many degrees of
/// freedom, in units of the stated variance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prior {
    pub variance: f64,
    pub freedom: f64,
}

impl Prior {
    /// Its sum of squares. A trace remains of none, so that sessions without any scatter have a variance.
    pub fn sum_of_squares(&self) -> f64 {
        self.freedom * self.variance + LEAST_VARIANCE
    }
}
